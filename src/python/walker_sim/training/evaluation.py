"""Evaluation of policies during training, on seeds that the training never uses."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands.episodes import play
from walker_sim.commands.policies import acting
from walker_sim.transport import ServerAddress, make_walkers

FIRST_CHOICE_SEED = 2_000_000
"""First seed of the episodes that decide which policy is kept. Those of the model cards in
docs/policies begin at 1000000."""

MAX_ENVS = 100


class Evaluation:
    """Plays the same episodes for each policy, many at once."""

    def __init__(
        self, env_id: str, parameters: Mapping[str, Any], episodes: int, num_threads: int
    ) -> None:
        # With reuse_world an episode would depend on the ones before it.
        own = {name: value for name, value in parameters.items() if name != "reuse_world"}
        self._walkers = make_walkers(
            *(env_id, min(episodes, MAX_ENVS), "next_step", own, ServerAddress()), num_threads
        )
        self._seeds = range(FIRST_CHOICE_SEED, FIRST_CHOICE_SEED + episodes)

    def returns(self, network: _core.Policy) -> NDArray[np.float64]:
        """Returns the return of each episode."""
        policy = acting(network, network.action_size)
        episodes = sorted(play(self._walkers, self._seeds, lambda seed: policy))
        return np.array([episode.episode_return for episode in episodes])

    def close(self) -> None:
        self._walkers.close()
