"""Trains until the mean return on held-out seeds reaches --return; prints the wall time.

Our walkers are trained with the quick settings. Gymnasium's, which evolution strategies would have
to step in Python, are trained by PPO as the first stage of the included policy.
"""

import argparse
import dataclasses
import json
import pathlib
import sys
import tempfile

import gymnasium
from stable_baselines3.common.vec_env import DummyVecEnv
from walker_sim.commands.train import settings_file, stage_class
from walker_sim.training.settings_file import read_settings

EVALUATE_EVERY = 100_000
HELD_OUT_SEEDS = 100  # evaluations do not count in the time of either side


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--env", required=True)
    parser.add_argument("--environments", choices=("walker_sim", "gymnasium"), required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--return", type=float, required=True, dest="least")
    arguments = parser.parse_args()
    own = {}
    if arguments.environments == "walker_sim":
        settings = read_settings(settings_file(f"{arguments.env}-quick"))
    else:
        settings = read_settings(settings_file(arguments.env)).stage(0)
        walkers = [lambda: gymnasium.make(arguments.env)] * settings.num_envs
        own["walkers"] = DummyVecEnv(walkers)
    frequently = {"evaluate_every": EVALUATE_EVERY, "evaluation_episodes": HELD_OUT_SEEDS}
    stages = tuple({**stage, **frequently} for stage in settings.stages)
    settings = dataclasses.replace(settings, seed=arguments.seed, stages=stages, **frequently)

    def stop_at_return(stage, point):
        if point is not None:
            print(*point, file=sys.stderr, flush=True)
            stage.wants_to_stop = point.evaluation_return >= arguments.least

    with tempfile.TemporaryDirectory() as folder:
        for index in range(settings.num_stages):
            make = stage_class(settings.stage(index), 0)
            options = {"index": index, "report": stop_at_return, **own}
            stage = make(arguments.env, settings, pathlib.Path(folder), **options)
            stage.run()
            stage.close()
            if stage.wants_to_stop:
                break
    last = stage.points[-1]
    if last.evaluation_return < arguments.least:
        sys.exit(f"return {last.evaluation_return} after {last.steps} steps")
    print(json.dumps({"seconds": last.seconds, "steps": last.steps}))


if __name__ == "__main__":
    main()
