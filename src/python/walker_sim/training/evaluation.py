"""Evaluation of policies during training, on seeds that the training never uses."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.transport import ServerAddress, make_walkers

FIRST_CHOICE_SEED = 2_000_000
"""First seed of the episodes that decide which policy is kept. Those of the model cards in
docs/policies begin at 1000000."""


_AT_ONCE = 100


class Evaluation:
    """Plays the same episodes for each policy, many at once."""

    def __init__(
        self, env_id: str, parameters: Mapping[str, Any], episodes: int, num_threads: int
    ) -> None:
        # With reuse_world an episode would depend on the ones before it.
        own = {name: value for name, value in parameters.items() if name != "reuse_world"}
        self._walkers = make_walkers(
            *(env_id, min(episodes, _AT_ONCE), "next_step", own, ServerAddress()), num_threads
        )
        self._seeds = list(range(FIRST_CHOICE_SEED, FIRST_CHOICE_SEED + episodes))

    def returns(self, policy: _core.Policy) -> NDArray[np.float64]:
        """Returns the return of each episode."""
        size = self._walkers.num_envs
        returns = np.zeros(len(self._seeds))
        episodes = np.arange(size)  # index of each walker's episode; idle beyond the last
        begun = size
        actions = np.zeros((size, policy.action_size))
        observations, _ = self._walkers.reset([], self._seeds[:size])
        while (episodes < len(returns)).any():
            policy.act(observations, actions)
            batch = self._walkers.step(actions)
            observations = batch.observations
            playing = episodes < len(returns)
            returns[episodes[playing]] += batch.rewards[playing]
            ended = np.flatnonzero(playing & (batch.terminated | batch.truncated))
            episodes[ended] = np.arange(begun, begun + len(ended))
            begun += len(ended)
            further = ended[episodes[ended] < len(returns)]
            if further.size:
                seeds = [self._seeds[episode] for episode in episodes[further]]
                observations, _ = self._walkers.reset(further.tolist(), seeds)
        return returns

    def close(self) -> None:
        self._walkers.close()
