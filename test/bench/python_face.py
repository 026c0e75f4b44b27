"""One slice of this package as a user of Gymnasium has it, in this process. Prints a line of JSON.

    python_face.py make     --env ID --seconds S                            a single environment
    python_face.py lockstep --env ID --seconds S --server NAME              the same over ROS
    python_face.py make_vec --env ID --seconds S --num-envs N --threads K   many

What it is compared with stands in peers.py and benchmark.cpp, and is done in the same way.
"""

import argparse
import json

import gymnasium
import walker_sim.registration
from peers import Gymnasium, measure, prepared


def name_of(env):
    return f"{walker_sim.registration.NAMESPACE}/{env}"


def make(options):
    return measure(options.seconds, 1, Gymnasium(name_of(options.env)).step_or_reset)


def lockstep(options):
    """Resets take time but are not counted as steps."""
    env = Gymnasium(name_of(options.env), transport="ros", server=options.server)
    return measure(options.seconds, 1, env.step_and_reset)


def make_vec(options):
    envs = gymnasium.make_vec(name_of(options.env), options.num_envs, num_threads=options.threads)
    actions = prepared(envs.single_action_space, options.num_envs)
    envs.reset(seed=0)
    return measure(options.seconds, options.num_envs, lambda: envs.step(next(actions)))


KINDS = {"make": make, "lockstep": lockstep, "make_vec": make_vec}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--env", required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--num-envs", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--server", default="/walker_sim")
    options = parser.parse_args()
    print(json.dumps({"num_envs": options.num_envs, **KINDS[options.kind](options)}))


if __name__ == "__main__":
    main()
