"""Long measurements, run only on request: training time, and policies over ROS in real time."""

import pathlib
import sys

from measure import Failure, Row, run_slice
from ros import Master
from targets import WALKERS

HERE = pathlib.Path(__file__).resolve().parent
WALKER = "BipedalWalker-v3"
WALKING = 300  # mean return over the held-out seeds
FIRST_SEED = 3_000_000
EPISODES = 20
PATIENCE = 3600  # for one training, or for all episodes of one environment [s]


def training(settings):
    """Wall time until a policy walks, on this package's and on Gymnasium's environments."""
    rows = {
        side: Row("training", WALKER, title, "s")
        for side, title in (
            ("walker_sim", "walker_sim"),
            ("gymnasium", "Gymnasium's in DummyVecEnv"),
        )
    }
    if settings.learner is None:
        for row in rows.values():
            row.error = "Stable-Baselines3 is not installed"
        return list(rows.values())
    rows["gymnasium"].peer = rows["walker_sim"]
    for seed in range(settings.rounds(2)):
        for side, row in rows.items():
            command = [settings.learner, HERE / "time_to_walk.py", "--env", WALKER]
            command += ["--environments", side, "--seed", seed]
            command += ["--return", WALKING] if not settings.is_quick else ["--return", -1000]
            try:
                row.slices += run_slice(command, settings.two_cores, settings.folder, PATIENCE)
                row.values.append(row.slices[-1]["seconds"])
            except Failure as failure:
                row.error = str(failure)
    return list(rows.values())


def policies(settings):
    """Returns of shipped policies in lock-step, and in real time with late commands."""
    rows = []
    for env in WALKERS:
        pair = [Row("policies", env, side, "") for side in ("lock-step", "free-running")]
        pair[1].peer = pair[0]
        for row, mode, agent in zip(pair, ("lockstep", "free"), ("service_agent", "topic_agent")):
            try:
                row.slices = walk(settings, env, mode, agent)
                returns = [line["return"] for line in row.slices]
                row.values.append(sum(returns) / len(returns))
            except Failure as failure:
                row.error = str(failure)
        rows += pair
    return rows


def walk(settings, env, mode, agent):
    episodes = settings.count(EPISODES)
    seeds = " ".join(str(FIRST_SEED + index) for index in range(episodes))
    parameters = {"env": env, "mode": mode}
    if mode == "free":
        parameters["auto_reset"] = "false"
    if settings.is_quick:
        parameters["max_episode_steps"] = 100
    with Master(settings) as master:
        master.server(**parameters)
        walker = master.process([settings.programs / agent, "_agent:=policy", f"_seeds:={seeds}"])
        command = [sys.executable, HERE / "episode_returns.py", "--count", episodes]
        command += ["--while", walker.pid]
        return run_slice(command, settings.two_cores, settings.folder, PATIENCE)
