"""Long measurements, run only on request: training time, and policies over ROS in real time."""

import pathlib
import sys

from measure import Failure, Row, run_slice
from over_ros import start_master
from walker_sim import _core

HERE = pathlib.Path(__file__).resolve().parent
WALKER = "BipedalWalker-v3"
WALKING = 300  # mean return over the held-out seeds
FIRST_SEED = 3_000_000
EPISODES = 20
PATIENCE = 3600  # for one training, or for all episodes of one environment [s]


def training(settings):
    """Wall time until a policy walks: quick settings here, PPO on Gymnasium's environments."""
    ours = Row("training", WALKER, "walker_sim, quick", "s")
    theirs = Row("training", WALKER, "PPO, Gymnasium's in DummyVecEnv", "s", peer=ours)
    for seed in range(settings.rounds(2)):
        for environments, row in (("walker_sim", ours), ("gymnasium", theirs)):
            command = [settings.learner, HERE / "time_to_walk.py", "--env", WALKER]
            command += ["--environments", environments, "--seed", seed]
            command += ["--return", -1000 if settings.is_quick else WALKING]
            try:
                if settings.learner is None:
                    raise Failure("Stable-Baselines3 is not installed")
                row.slices += run_slice(command, settings.two_cores, settings.folder, PATIENCE)
                row.values.append(row.slices[-1]["seconds"])
            except Failure as failure:
                row.error = str(failure)
    return [ours, theirs]


def policies(settings):
    """Returns of shipped policies in lock-step, and in real time with late commands."""
    rows = []
    for env in _core.ids():
        lockstep = Row("policies", env, "lock-step", "")
        free = Row("policies", env, "free-running", "", peer=lockstep)
        for row, mode, agent in (
            (lockstep, "lockstep", "service_agent"),
            (free, "free", "topic_agent"),
        ):
            rows.append(row)
            try:
                row.slices = walk(settings, env, mode, agent)
                returns = [line["return"] for line in row.slices]
                row.values.append(sum(returns) / len(returns))
            except Failure as failure:
                row.error = str(failure)
    return rows


def walk(settings, env, mode, agent):
    episodes = settings.count(EPISODES)
    seeds = " ".join(str(FIRST_SEED + index) for index in range(episodes))
    parameters = {"env": env, "mode": mode}
    if mode == "free":
        parameters["auto_reset"] = "false"
    if settings.is_quick:
        parameters["max_episode_steps"] = 100
    with start_master(settings) as master:
        master.server(**parameters)
        process = master.start([settings.programs / agent, "_agent:=policy", f"_seeds:={seeds}"])
        command = [sys.executable, HERE / "episode_returns.py", "--count", episodes]
        command += ["--while", process.pid]
        return run_slice(command, settings.two_cores, settings.folder, PATIENCE)
