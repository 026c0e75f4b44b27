"""One slice of mjbatch, which steps many worlds of MuJoCo. Prints a line of JSON per size.

    mjbatch_peer.py --model FILE --num-envs N[,N...] --threads K --seconds S

Physics alone, four engine steps at a time as in Gymnasium's walkers: without observation, reward
and end of an episode. All worlds are reset every 20 steps, about when a walker with random actions
has fallen; that takes time and does not count.
"""

import argparse
import json
import time

import mjbatch
import mujoco
import numpy

FRAMES = 4  # engine steps per step
STEPS = 20  # per episode


def slice_of(options, num_envs):
    model = mujoco.MjModel.from_xml_path(options.model)
    batch = mjbatch.Batch(model, num_sims=num_envs, num_threads=options.threads)
    control = batch.bind("ctrl")
    actions = numpy.random.default_rng(0).uniform(-1, 1, (STEPS, num_envs, model.nu))
    for duration in (options.seconds / 4, options.seconds):  # the first is the warm-up
        steps, wall = 0, 0.0
        processor, begin = time.process_time(), time.perf_counter()
        while wall < duration:
            if steps % (STEPS * num_envs) == 0:
                batch.reset()
            control[:] = actions[steps // num_envs % STEPS]
            batch.step(nstep=FRAMES)
            steps += num_envs
            wall = time.perf_counter() - begin
        processor = time.process_time() - processor
    return {"num_envs": num_envs, "steps": steps, "seconds": wall, "processor_seconds": processor}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", required=True)
    parser.add_argument("--num-envs", required=True)
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    options = parser.parse_args()
    for num_envs in map(int, options.num_envs.split(",")):
        print(json.dumps(slice_of(options, num_envs)), flush=True)


if __name__ == "__main__":
    main()
