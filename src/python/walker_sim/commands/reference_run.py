"""Reference run, in which every bit is fixed, and its hash."""

from __future__ import annotations

import hashlib
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.transport import Walkers

RUN = 1  # increment if a change below changes a hash
NUM_WALKERS = 16


class SimulationFailed(Exception):
    """The engine failed, which it does at no step of a correct reference run."""


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
        self.number = number
        self.action = np.zeros(num_actions)
        self._env_id, self._episode = env_id, -1
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
            self._policy = _core.Agent(name, self._env_id, {}, seed)
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
    SimulationFailed
        If the engine fails. Names the walker and the engine's error.
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
        raise SimulationFailed(f"walker {walker.number}, step {step}: {error}")
