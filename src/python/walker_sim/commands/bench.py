"""``bench``: steps per second, compared with Gymnasium's own walker."""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import statistics
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence

import gymnasium
import numpy as np
from numpy.typing import NDArray

import walker_sim
from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.registration import NAMESPACE

ROUNDS = 5
PREPARED = 512  # actions of each environment, used cyclically
BAR = 24  # length of the longest bar [characters]
GYMNASIUM = "Gymnasium's own, one"

DESCRIPTION = """\
Measures steps per second of wall time in this process: one walker from gymnasium.make, several
from gymnasium.make_vec, and Gymnasium's own where its engine is installed. Actions are random and
prepared beforehand; resets take their time and count as no step. The sides take turns in short
slices, so that a busy machine hits all of them; ratios are of slices of the same round.
"""

EPILOG = f"""\
{common.WALKER_HELP}
examples:
  python3 -m walker_sim bench BipedalWalker-v3
  python3 -m walker_sim bench Walker2d-v5 --num-envs 1,64,1024 --num-threads 2 --seconds 30
  python3 -m walker_sim bench BipedalWalker-v3 --transport ros      # a server in lock-step as well
"""

Play = Callable[[float], float]
"""Steps for a number of seconds and returns the steps per second."""


Speeds = Dict[str, List[float]]
"""Speed in each round by side [steps/s]."""


def _parser() -> common.Parser:
    parser = common.Parser("bench", DESCRIPTION, EPILOG)
    parser.add_argument(
        "--seconds",
        type=common.positive,
        default=10.0,
        metavar="S",
        help="of all slices together (default: 10)",
    )
    parser.add_argument(
        "--num-envs",
        type=common.counts,
        default=[1, 16, 64],
        metavar="N,N,...",
        help="sizes of the vectorised environments (default: 1,16,64); over ROS, the first must be "
        "the server's",
    )
    common.add_walker_options(parser)
    return parser


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    env_id, parameters = common.walker_of(options.walker)
    sides = _own_sides(options, env_id, parameters)
    why = ""
    try:
        sides = {GYMNASIUM: _single(env_id, _gymnasium_keywords(parameters)), **sides}
    except Exception as error:  # Gymnasium's side is optional
        why = f"{type(error).__name__}: {str(error).splitlines()[0]}"
    slice_seconds = options.seconds / ROUNDS / len(sides)
    print("\n".join(_conditions(env_id, options.walker, slice_seconds)) + "\n", flush=True)
    print("\n".join(table(measure(sides, slice_seconds))))
    if why:
        print(f"\n{GYMNASIUM}: not measured, {why}")
    return 0


def _own_sides(
    options: argparse.Namespace, env_id: str, parameters: dict[str, Any]
) -> dict[str, Play]:
    name = f"{NAMESPACE}/{env_id}"
    try:
        sides = {"walker_sim, one": _single(name, parameters)}
        for count in options.num_envs:
            keywords = {**parameters, "num_threads": options.num_threads or 0}
            sides[f"walker_sim, {count} at once"] = _vector(name, count, keywords)
        if options.transport == "ros":
            keywords = {**parameters, "transport": "ros", "server": options.server}
            count = options.num_envs[0]
            side = _single(name, keywords) if count == 1 else _vector(name, count, keywords)
            sides[f"walker_sim over ROS, {count}"] = side
    except (ValueError, TypeError, RuntimeError, ImportError) as error:
        raise common.InputError(str(error)) from error
    return sides


def _gymnasium_keywords(parameters: dict[str, Any]) -> dict[str, Any]:
    """Returns the parameters without `reuse_world`: Gymnasium's walker always reuses its world."""
    return {name: value for name, value in parameters.items() if name != "reuse_world"}


def _actions(space: Any, shape: tuple[int, ...]) -> NDArray[np.float32]:
    random = np.random.default_rng(0)
    return random.uniform(space.low, space.high, (*shape, *space.shape)).astype(np.float32)


def _single(name: str, keywords: dict[str, Any]) -> Play:
    environment = gymnasium.make(name, **keywords)
    actions = list(_actions(environment.action_space, (PREPARED,)))
    environment.reset(seed=0)

    def play(seconds: float) -> float:
        steps, began = 0, time.perf_counter()
        while time.perf_counter() - began < seconds:
            for action in actions[:64]:
                _, _, terminated, truncated, _ = environment.step(action)
                if terminated or truncated:
                    environment.reset()
            steps += 64
            actions.append(actions.pop(0))
        return steps / (time.perf_counter() - began)

    return play


def _vector(name: str, count: int, keywords: dict[str, Any]) -> Play:
    environments = gymnasium.make_vec(name, num_envs=count, **keywords)
    prepared = max(1, min(PREPARED, 100_000 // count))
    actions = _actions(environments.unwrapped.single_action_space, (prepared, count))
    environments.reset(seed=0)
    state = {"call": 0, "resets": 0}  # resets: autoresets of the next call

    def play(seconds: float) -> float:
        steps, began = 0, time.perf_counter()
        while time.perf_counter() - began < seconds:
            state["call"] += 1
            outcome = environments.step(actions[state["call"] % prepared])
            steps += count - state["resets"]
            state["resets"] = int(np.count_nonzero(outcome[2] | outcome[3]))
        return steps / (time.perf_counter() - began)

    return play


def measure(sides: dict[str, Play], seconds: float) -> Speeds:
    """Runs all sides in turn, in reverse order every other round, after a warm-up of each."""
    speeds: Speeds = {name: [] for name in sides}
    for play in sides.values():
        play(min(seconds, 0.1))
    for index in range(ROUNDS):
        for name in list(sides)[:: -1 if index % 2 else 1]:
            speeds[name].append(sides[name](seconds))
    return speeds


def table(speeds: Speeds) -> list[str]:
    """Returns a line per side: median, spread, and the ratio to Gymnasium's own, if measured."""
    peer = speeds.get(GYMNASIUM)
    width = max(map(len, speeds))
    most = max(map(statistics.median, speeds.values()))
    head = f"  {'':<{width}}  {'steps/s':>9}  {'spread':>6}"
    lines = [head + (f"  {'ratio':>6}  (least to most)" if peer else "")]
    for name, rounds in speeds.items():
        median = statistics.median(rounds)
        spread = (max(rounds) - min(rounds)) / 2 / median
        line = f"  {name:<{width}}  {median:>9,.0f}  {f'±{spread:.0%}':>6}"
        if peer:
            ratios = [ours / theirs for ours, theirs in zip(rounds, peer)]
            line += f"  {f'x{statistics.median(ratios):.2f}':>6}"
            span = "" if name == GYMNASIUM else f"({min(ratios):.2f} to {max(ratios):.2f})"
            line += f"  {span:<16}"
        lines.append(f"{line}  {'█' * round(BAR * median / most)}".rstrip())
    return lines


def _conditions(env_id: str, words: Sequence[str], seconds: float) -> list[str]:
    specification = _core.Environment(env_id, {}).specification
    versions = [f"Python {platform.python_version()}", f"NumPy {np.__version__}"]
    versions.append(f"walker_sim {walker_sim.__version__}")
    versions.append(f"{specification['engine']} {specification['engine_version']}")
    versions.append(f"Gymnasium {gymnasium.__version__}{_peer_engine(specification['engine'])}")
    parameters = [word for word in words if "=" in word]
    return [
        f"{' '.join([env_id, *parameters])}: random actions, medians of {ROUNDS} rounds, "
        f"in which the sides took turns of {seconds:.2f} s",
        f"{_processor()}, {_processors()} of {os.cpu_count()} processors",
        ", ".join(versions),
    ]


def _peer_engine(engine: str) -> str:
    name = "mujoco" if engine == "MuJoCo" else engine  # name of the Python package
    try:
        return f" on {name} {importlib.import_module(name).__version__}"
    except (ImportError, AttributeError):
        return ""


def _processors() -> int:
    """Returns the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _processor() -> str:
    path = Path("/proc/cpuinfo")
    if sys.platform == "linux" and path.exists():
        for line in path.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.machine()
