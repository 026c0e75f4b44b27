"""Registers the walkers with Gymnasium."""

from __future__ import annotations

import gymnasium

NAMESPACE = "walker_sim"


# max_episode_steps and reward_threshold. Duplicates the core's registrations, so that importing
# walker_sim, e.g. for its messages, loads no engine and needs no extension module for this Python.
_REGISTRATIONS: dict[str, tuple[int, float | None]] = {
    "BipedalWalker-v3": (1600, 300.0),
    "BipedalWalkerHardcore-v3": (2000, 300.0),
    "Walker2d-v4": (1000, None),
    "Walker2d-v5": (1000, None),
    "Hopper-v4": (1000, 3800.0),
    "Hopper-v5": (1000, 3800.0),
}


def ids() -> list[str]:
    """Returns the ids for `gymnasium.make`, e.g. ``walker_sim/BipedalWalker-v3``."""
    return [f"{NAMESPACE}/{env_id}" for env_id in _REGISTRATIONS]


def without_namespace(env_id: str) -> str:
    """Returns the id of Gymnasium's own environment, e.g. ``BipedalWalker-v3``."""
    if not isinstance(env_id, str) or not env_id.isprintable():
        from walker_sim import _core

        raise TypeError(f"environment {_core.shown(env_id)}: must be a printable text")
    prefix = f"{NAMESPACE}/"
    return env_id[len(prefix) :] if env_id.startswith(prefix) else env_id


def register_all() -> None:
    """Registers all ids with Gymnasium, single and vectorised. Idempotent."""
    for env_id, (max_episode_steps, reward_threshold) in _REGISTRATIONS.items():
        name = f"{NAMESPACE}/{env_id}"
        if name in gymnasium.registry:
            continue
        gymnasium.register(
            id=name,
            entry_point="walker_sim.environment:WalkerEnv",
            vector_entry_point="walker_sim.vector_environment:WalkerVectorEnv",
            reward_threshold=reward_threshold,
            max_episode_steps=max_episode_steps,
            kwargs={"env_id": env_id},
        )
