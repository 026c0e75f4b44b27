"""How good a policy is while it is trained, on seeds that the training never sees."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np
from numpy.typing import NDArray

from walker_sim.training.policy_file import PolicyFile
from walker_sim.transport import Place, make_walkers

FIRST_CHOICE_SEED = 2_000_000
"""Of the episodes that choose which policy is kept. The cards' own seeds begin at 1000000."""


class Evaluation:
    """Plays the same episodes again for each policy, all at once."""

    def __init__(
        self, env_id: str, parameters: Mapping[str, Any], episodes: int, num_threads: int
    ) -> None:
        self._walkers = make_walkers(
            env_id, episodes, "next_step", dict(parameters), Place(), num_threads
        )
        self._seeds = list(range(FIRST_CHOICE_SEED, FIRST_CHOICE_SEED + episodes))

    def returns(self, policy: PolicyFile) -> NDArray[np.float64]:
        """Of each episode."""
        observations, _ = self._walkers.reset([], self._seeds)
        returns = np.zeros(len(self._seeds))
        running = np.ones(len(self._seeds), np.bool_)
        while running.any():
            batch = self._walkers.step(policy.act(observations).astype(np.float64))
            returns[running] += batch.rewards[running]
            running &= ~(batch.terminated | batch.truncated)
            observations = batch.observations
        return returns

    def close(self) -> None:
        """Lets go of the walkers."""
        self._walkers.close()
