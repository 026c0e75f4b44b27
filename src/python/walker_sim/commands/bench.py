"""``bench``: steps per second, compared with Gymnasium's own walker. test/bench measures with the
same functions."""

from __future__ import annotations

import argparse
import importlib
import itertools
import os
import platform
import re
import statistics
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Sequence

import gymnasium
import numpy as np
from numpy.typing import NDArray

import walker_sim
from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.registration import NAMESPACE

ROUNDS = 5
MAX_VALUES = 1 << 15  # prepared values of actions, used cyclically
BAR = 24  # length of the longest bar [characters]
GYMNASIUM = "Gymnasium's own, one"

DESCRIPTION = """\
Measures steps per second of wall time in this process: of one walker from gymnasium.make, of
several from gymnasium.make_vec, and of Gymnasium's own walker if its engine is installed. Actions
are random and drawn beforehand. Resets take time and do not count as steps. The sides take turns in
short slices, so that other load on the machine affects all of them; ratios compare slices of the
same round.
"""

EPILOG = f"""\
{common.WALKER_HELP}
examples:
  python3 -m walker_sim bench BipedalWalker-v3
  python3 -m walker_sim bench Walker2d-v5 --num-envs 1,64,1024 --num-threads 2 --seconds 30
  python3 -m walker_sim bench BipedalWalker-v3 --transport ros      # also a lock-step server
"""

Step = Callable[[], int]
"""Makes one call of an environment and returns the number of steps in it."""

Speeds = Dict[str, List[float]]
"""Speed in each round by side [steps/s]."""


class Slice(NamedTuple):
    """Result of a measurement."""

    steps: int
    seconds: float  # wall time
    processor_seconds: float  # of all threads of this process


def measure(seconds: float, step: Step) -> Slice:
    """Calls `step` repeatedly, for `seconds` and at least once."""
    steps = 0
    processor, began = time.process_time(), time.perf_counter()
    while True:
        steps += step()
        elapsed = time.perf_counter() - began
        if elapsed >= seconds:
            return Slice(steps, elapsed, time.process_time() - processor)


def random_actions(space: Any, *shape: int) -> Iterator[NDArray[Any]]:
    """Yields prepared actions of the space in a cycle: float32 values, in the space's type."""
    rows = max(MAX_VALUES // int(np.prod((*shape, *space.shape))), 1)
    size = (rows, *shape, *space.shape)
    values = np.random.default_rng(0).uniform(space.low, space.high, size)
    return itertools.cycle(values.astype(np.float32).astype(space.dtype))


def single(name: str, **keywords: Any) -> Step:
    """Returns a function that steps a walker of `gymnasium.make` and resets it at an end."""
    environment = gymnasium.make(name, **keywords)
    actions = random_actions(environment.action_space)
    environment.reset(seed=0)

    def step() -> int:
        _, _, terminated, truncated, _ = environment.step(next(actions))
        if terminated or truncated:
            environment.reset()
        return 1

    return step


def vector(name: str, count: int, **keywords: Any) -> Step:
    """Returns a function that steps `count` walkers of `gymnasium.make_vec`."""
    environments = gymnasium.make_vec(name, num_envs=count, **keywords)
    actions = random_actions(environments.unwrapped.single_action_space, count)
    environments.reset(seed=0)
    resets = 0  # in the next call

    def step() -> int:
        nonlocal resets
        outcome = environments.step(next(actions))
        steps = count - resets
        resets = int(np.count_nonzero(outcome[2] | outcome[3]))
        return steps

    return step


def run(arguments: Sequence[str]) -> int:
    parser = common.Parser("bench", DESCRIPTION, EPILOG)
    parser.add_argument(
        "--seconds",
        type=common.positive,
        default=10.0,
        metavar="S",
        help="total duration of all slices [s] (default: 10)",
    )
    parser.add_argument(
        "--num-envs",
        type=common.counts,
        default=[1, 16, 64],
        metavar="N,N,...",
        help="sizes of the vector environments (default: 1,16,64); over ROS, the first must be the "
        "server's",
    )
    common.add_walker_options(parser)
    options = parser.parse_intermixed_args(arguments)
    env_id, parameters = common.walker_of(options.walker)
    sides = _own_sides(options, env_id, parameters)
    missing = ""
    # Gymnasium's walker always reuses its world and has no such parameter.
    theirs = {name: value for name, value in parameters.items() if name != "reuse_world"}
    try:
        sides = {GYMNASIUM: single(env_id, **theirs), **sides}
    except Exception as error:  # Gymnasium's side is optional
        missing = f"{type(error).__name__}: {str(error).splitlines()[0]}"
    seconds = options.seconds / ROUNDS / len(sides)
    print("\n".join(_conditions(env_id, options.walker, seconds)) + "\n", flush=True)
    print("\n".join(table(take_turns(sides, seconds))))
    if missing:
        print(f"\n{GYMNASIUM}: not measured, {missing}")
    return 0


def _own_sides(
    options: argparse.Namespace, env_id: str, parameters: dict[str, Any]
) -> dict[str, Step]:
    name, threads = f"{NAMESPACE}/{env_id}", options.num_threads or 0
    try:
        sides = {"walker_sim, one": single(name, **parameters)}
        for count in options.num_envs:
            step = vector(name, count, num_threads=threads, **parameters)
            sides[f"walker_sim, {count} at once"] = step
        if options.transport == "ros":
            remote = {**parameters, "transport": "ros", "server": options.server}
            count = options.num_envs[0]
            step = single(name, **remote) if count == 1 else vector(name, count, **remote)
            sides[f"walker_sim over ROS, {count}"] = step
    except (ValueError, TypeError, RuntimeError, ImportError) as error:
        raise common.InputError(str(error)) from error
    return sides


def take_turns(sides: dict[str, Step], seconds: float) -> Speeds:
    """Measures all sides in turn, in reverse order every other round, after a warm-up of each."""
    speeds: Speeds = {name: [] for name in sides}
    for step in sides.values():
        measure(min(seconds, 0.1), step)
    for index in range(ROUNDS):
        for name in list(sides)[:: -1 if index % 2 else 1]:
            slice_ = measure(seconds, sides[name])
            speeds[name].append(slice_.steps / slice_.seconds)
    return speeds


def table(speeds: Speeds) -> list[str]:
    """Returns a line per side: median, spread, and the ratio to Gymnasium's own, if measured."""
    peer = speeds.get(GYMNASIUM)
    width = max(map(len, speeds))
    fastest = max(map(statistics.median, speeds.values()))
    head = f"  {'':<{width}}  {'steps/s':>9}  {'spread':>6}"
    lines = [head + (f"  {'ratio':>6}  (min to max)" if peer else "")]
    for name, rounds in speeds.items():
        median = statistics.median(rounds)
        spread = (max(rounds) - min(rounds)) / 2 / median
        line = f"  {name:<{width}}  {median:>9,.0f}  {f'±{spread:.0%}':>6}"
        if peer:
            ratios = [ours / theirs for ours, theirs in zip(rounds, peer)]
            span = "" if name == GYMNASIUM else f"({min(ratios):.2f} to {max(ratios):.2f})"
            line += f"  {f'x{statistics.median(ratios):.2f}':>6}  {span:<16}"
        lines.append(f"{line}  {'█' * round(BAR * median / fastest)}".rstrip())
    return lines


def _conditions(env_id: str, words: Sequence[str], seconds: float) -> list[str]:
    specification = _core.Pool(env_id, {}).specification
    cpuinfo = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*: (.*)", cpuinfo.read_text() if cpuinfo.exists() else "")
    engine = specification["engine"]
    versions = [
        f"Python {platform.python_version()}",
        f"NumPy {np.__version__}",
        f"walker_sim {walker_sim.__version__}",
        f"{engine} {specification['engine_version']}",
        f"Gymnasium {gymnasium.__version__}{_peer_engine(engine)}",
    ]
    return [
        f"{' '.join([env_id, *(word for word in words if '=' in word)])}: random actions, medians "
        f"of {ROUNDS} rounds, in which the sides took turns of {seconds:.2f} s",
        f"{model[1] if model else platform.machine()}, {os.cpu_count()} processors",
        ", ".join(versions),
    ]


def _peer_engine(engine: str) -> str:
    name = "mujoco" if engine == "MuJoCo" else engine  # name of the Python package
    try:
        return f" on {name} {importlib.import_module(name).__version__}"
    except (ImportError, AttributeError):
        return ""
