"""Trains until the mean return on held-out seeds is what is asked for; prints how long that took.

On our walkers, with reuse_world, and on Gymnasium's own every number is the same, and so is the
number of steps: what differs is the time.
"""

import argparse
import dataclasses
import json
import pathlib
import sys
import tempfile

from promotion import promotion_of_numpy_2
from walker_sim.commands.train import settings_file
from walker_sim.training.run import Training
from walker_sim.training.settings import read_settings

EVALUATE_EVERY = 100_000
HELD_OUT_SEEDS = 100  # evaluations do not count in the time of either side


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--env", required=True)
    parser.add_argument("--environments", choices=("walker_sim", "gymnasium"), required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--return", type=float, required=True, dest="wanted")
    arguments = parser.parse_args()
    settings = read_settings(settings_file(arguments.env))
    parameters = {"reuse_world": True} if arguments.environments == "walker_sim" else {}
    settings = dataclasses.replace(
        settings,
        seed=arguments.seed,
        evaluate_every=EVALUATE_EVERY,
        evaluation_episodes=HELD_OUT_SEEDS,
        parameters=parameters,
    )

    def look(training, point):
        if point is not None:
            print(*point, file=sys.stderr, flush=True)
            training.wants_to_stop = point.evaluation_return >= arguments.wanted

    with tempfile.TemporaryDirectory() as folder, promotion_of_numpy_2():
        training = Training(
            arguments.env,
            settings,
            pathlib.Path(folder),
            environments=arguments.environments,
            report=look,
        )
        training.run()
        training.close()
    last = training.points[-1]
    if last.evaluation_return < arguments.wanted:
        sys.exit(f"{last.evaluation_return} after {last.steps} steps; {arguments.wanted} is wanted")
    print(json.dumps({"seconds": last.seconds, "steps": last.steps}))


if __name__ == "__main__":
    main()
