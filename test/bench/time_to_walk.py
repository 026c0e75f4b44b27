"""Trains until the mean return on held-out seeds reaches --return; prints the wall time.

All numbers are equal on our walkers, with reuse_world, and on Gymnasium's own; only the time
differs.
"""

import argparse
import dataclasses
import json
import pathlib
import sys
import tempfile

import gymnasium
from promotion import promotion_of_numpy_2
from stable_baselines3.common.vec_env import DummyVecEnv
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
    parser.add_argument("--return", type=float, required=True, dest="least")
    arguments = parser.parse_args()
    settings = read_settings(settings_file(f"{arguments.env}-quick"))
    settings = dataclasses.replace(
        settings,
        seed=arguments.seed,
        evaluate_every=EVALUATE_EVERY,
        evaluation_episodes=HELD_OUT_SEEDS,
        parameters={"reuse_world": True},
    )
    walkers = None
    if arguments.environments == "gymnasium":
        walkers = DummyVecEnv([lambda: gymnasium.make(arguments.env)] * settings.num_envs)

    def stop_at_return(training, point):
        if point is not None:
            print(*point, file=sys.stderr, flush=True)
            training.wants_to_stop = point.evaluation_return >= arguments.least

    with tempfile.TemporaryDirectory() as folder, promotion_of_numpy_2():
        training = Training(
            *(arguments.env, settings, pathlib.Path(folder)), walkers=walkers, report=stop_at_return
        )
        training.run()
        training.close()
    last = training.points[-1]
    if last.evaluation_return < arguments.least:
        sys.exit(f"return {last.evaluation_return} after {last.steps} steps")
    print(json.dumps({"seconds": last.seconds, "steps": last.steps}))


if __name__ == "__main__":
    main()
