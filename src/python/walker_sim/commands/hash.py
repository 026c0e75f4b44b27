"""``hash``: a hash of all bits of a fixed run, for comparison between machines."""

from __future__ import annotations

import hashlib
from contextlib import closing
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

import walker_sim
from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.walkers import Walkers, variant_of

RUN = 1  # increment if a change below changes a hash
NUM_WALKERS = 16
STEPS = 10_000

DESCRIPTION = f"""\
Plays a run in which every bit is fixed and prints the SHA-256 of all observations, rewards, flags
and infos: {NUM_WALKERS} walkers of each environment with the seeds 0 to {NUM_WALKERS - 1}. Walkers
with even seeds act by the heuristic, those with odd seeds at random. Threads, environments at once,
processor, compiler and transport do not change the hash; docs/reliability.md lists the expected
hashes. Those of Walker2d and Hopper depend on the C library's sin, cos and pow, whose variant is
printed as "libm".
"""

EPILOG = f"""\
{common.ID_HELP} (default: all of them).

The variable WALKER_SIM_KERNEL (off, sse2, avx2, avx512) selects the vector instructions.

examples:
  python3 -m walker_sim hash
  python3 -m walker_sim hash Walker2d-v5 --steps 1000 --num-envs 3 --num-threads 1
  python3 -m walker_sim hash BipedalWalker-v3 --transport ros
"""


def run(arguments: Sequence[str]) -> int:
    """Prints a hash for each environment. Returns the exit status."""
    parser = common.Parser("hash", DESCRIPTION, EPILOG)
    parser.add_argument(
        "--steps",
        type=common.count,
        default=STEPS,
        metavar="N",
        help=f"steps of each walker (default: {STEPS:,}); each number has its own hash",
    )
    common.add_walker_options(parser, "ID")
    common.add_num_envs(parser)
    options = parser.parse_intermixed_args(arguments)
    for word in options.walker:
        if "=" in word:
            raise common.InputError(f"{word}: parameters cannot be set; the run has the defaults")
    ids = [common.walker_of([word])[0] for word in options.walker] or _core.ids()
    size = f"{NUM_WALKERS} x {options.steps:,} steps"
    print(f"walker_sim {walker_sim.__version__}, run {RUN}: {size}")
    for env_id in ids:
        walkers = common.make_walkers(options, env_id, {}, options.num_envs, NUM_WALKERS)
        with closing(walkers):
            found = reference_hash(walkers, options.steps)
        version = walkers.specification["engine_version"]
        engine = f"{walkers.specification['engine']} {version.partition(' (')[0]}"
        libm = variant_of(version, "libm")
        print(f"{found}  {env_id}, {engine}{libm and f', libm: {libm}'}", flush=True)
    return 0


class ReferenceWalker:
    """One walker of the run: its actions, and the hash of its states.

    Its first reset has its number as the seed; later resets continue its generator. Walkers with
    even numbers act by the environment's heuristic, the others at random. Each episode has a new
    policy with the seed ``number + NUM_WALKERS * episode``, with episodes counted from 0.

    The hash is over all states in order, including resets: the observation's bytes, the reward
    (float64), terminated and truncated (one byte each), and info (float64, with one fixed NaN for
    absent values). At a reset the reward is 0 and the flags are false. The hash of a run is that of
    its walkers' hashes in the order of their numbers.
    """

    def __init__(self, env_id: str, number: int, num_actions: int) -> None:
        self.env_id, self.number = env_id, number
        self.action = np.zeros(num_actions)
        self._episode = -1
        self._ends = True  # the next state is a reset's
        self.hash = hashlib.sha256()

    def add(
        self,
        observation: NDArray[Any],
        info: NDArray[np.float64],
        reward: float = 0.0,
        terminated: bool = False,
        truncated: bool = False,
    ) -> None:
        """Hashes the state after a reset or after `action`, and chooses the next action."""
        if self._ends:
            self._episode += 1
            seed = self.number + NUM_WALKERS * self._episode
            name = "random" if self.number % 2 else "heuristic"
            self._policy = _core.Agent(name, self.env_id, {}, seed)
            reward, terminated, truncated = 0.0, False, False
        known = np.where(np.isnan(info), np.nan, info)
        numbers = np.float64(reward).tobytes() + bytes([bool(terminated), bool(truncated)])
        self.hash.update(observation.tobytes() + numbers + known.tobytes())
        self._ends = bool(terminated or truncated)
        self._policy.act(np.ascontiguousarray(observation, np.float64), self.action)


def reference_hash(walkers: Walkers, steps: int) -> str:
    """Plays the run and returns its hash, which does not depend on `walkers.num_envs`.

    Parameters
    ----------
    walkers
        Walkers with autoreset mode next_step and default parameters.
    steps
        Number of steps of each walker, including autoresets.

    Raises
    ------
    InputError
        If the engine fails, which it does at no step of a correct run. Names the walker and the
        engine's error.
    """
    num_actions = len(walkers.specification["action_low"])
    run = [
        ReferenceWalker(walkers.specification["id"], number, num_actions)
        for number in range(NUM_WALKERS)
    ]
    for first in range(0, NUM_WALKERS, walkers.num_envs):
        _play(walkers, run[first : first + walkers.num_envs], steps)
    return hashlib.sha256(b"".join(walker.hash.digest() for walker in run)).hexdigest()


def _play(walkers: Walkers, group: Sequence[ReferenceWalker], steps: int) -> None:
    """Plays a group. Environments beyond the group are stepped with zero actions."""
    idle = [0] * (walkers.num_envs - len(group))
    observations, info = walkers.reset([], [walker.number for walker in group] + idle)
    for row, walker in enumerate(group):
        _check(walker, 0, walkers.reset_error(row))
        walker.add(observations[row], info[row])
    actions = np.zeros((walkers.num_envs, len(group[0].action)))
    for step in range(1, steps + 1):
        for row, walker in enumerate(group):
            actions[row] = walker.action
        batch = walkers.step(actions)
        for row, walker in enumerate(group):
            _check(walker, step, walkers.error(row) or walkers.reset_error(row))
            walker.add(
                *(batch.observations[row], batch.info[row], batch.rewards[row]),
                *(batch.terminated[row], batch.truncated[row]),
            )


def _check(walker: ReferenceWalker, step: int, error: str) -> None:
    if error:
        raise common.InputError(f"{walker.env_id}: walker {walker.number}, step {step}: {error}")
