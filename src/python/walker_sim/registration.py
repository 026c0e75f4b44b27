"""The ids under which Gymnasium finds the walkers."""

from __future__ import annotations

import math

import gymnasium

from walker_sim import _core

NAMESPACE = "walker_sim"


def ids() -> list[str]:
    """What `gymnasium.make` takes, e.g. ``walker_sim/BipedalWalker-v3``."""
    return [f"{NAMESPACE}/{env_id}" for env_id in _core.ids()]


def register_all() -> None:
    """Registers all ids with Gymnasium, single and vectorised; again is no error."""
    for env_id in _core.ids():
        name = f"{NAMESPACE}/{env_id}"
        if name in gymnasium.registry:
            continue
        specification = _core.Environment(env_id, {}).specification
        threshold = specification["reward_threshold"]
        gymnasium.register(
            id=name,
            entry_point="walker_sim.environment:WalkerEnv",
            vector_entry_point="walker_sim.vector_environment:WalkerVectorEnv",
            reward_threshold=None if math.isnan(threshold) else threshold,
            max_episode_steps=specification["max_episode_steps"],
            kwargs={"env_id": env_id},
        )
