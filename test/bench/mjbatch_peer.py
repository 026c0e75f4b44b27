"""One slice of mjbatch, which steps many worlds of MuJoCo. Prints lines of JSON.

    mjbatch_peer.py --model FILE --num-envs N[,N...] --threads K --seconds S

Physics alone, four engine steps at a time as Gymnasium's walker makes them: no observation, reward
or end of an episode is computed. All begin anew every 20 steps, about when a walker with random
actions has fallen; that takes time and is not counted.
"""

import argparse
import itertools
import json

import mjbatch
import mujoco
import numpy
from peers import VALUES, measure

FRAMES = 4  # engine steps per step
STEPS = 20  # per episode


def slice_of(options, num_envs):
    model = mujoco.MjModel.from_xml_path(options.model)
    batch = mjbatch.Batch(model, num_sims=num_envs, num_threads=options.threads)
    control = batch.bind("ctrl")
    rows = max(VALUES // (num_envs * model.nu), 1)
    random = numpy.random.default_rng(0).uniform(-1, 1, (rows, num_envs, model.nu))
    actions = itertools.cycle(random)
    counter = itertools.count()
    batch.reset()

    def step():
        if next(counter) % STEPS == 0:
            batch.reset()
        control[:] = next(actions)
        batch.step(nstep=FRAMES)

    return {"num_envs": num_envs, **measure(options.seconds, num_envs, step)}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", required=True)
    parser.add_argument(
        "--num-envs", type=lambda text: [int(count) for count in text.split(",")], required=True
    )
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    options = parser.parse_args()
    for num_envs in options.num_envs:
        print(json.dumps(slice_of(options, num_envs)), flush=True)


if __name__ == "__main__":
    main()
