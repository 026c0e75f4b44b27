"""Makes walkers, in process or over ROS, as their address says."""

from __future__ import annotations

from typing import Any

import gymnasium

from walker_sim.in_process import InProcessWalkers
from walker_sim.over_ros import ANY, RemoteWalkers, limit_of_make
from walker_sim.walkers import ServerAddress, Walkers


def make_walkers(
    env_id: str,
    num_envs: int,
    autoreset_mode: str,
    parameters: dict[str, Any],
    address: ServerAddress,
    num_threads: int = 0,
    batch_size: int = 0,
) -> Walkers:
    """Makes walkers in process, or connects to a server and compares it with the arguments."""
    if not address.is_remote():
        return InProcessWalkers(
            env_id, parameters, num_envs, num_threads, autoreset_mode, batch_size
        )
    for name, value, reason in (
        ("num_threads", num_threads, "it is the server's parameter"),
        ("batch_size", batch_size, "all walkers step together"),
    ):
        if value:
            raise ValueError(f"{name} = {value}: over ROS {reason}; must be 0")
    return RemoteWalkers(env_id, parameters, address, num_envs, autoreset_mode=autoreset_mode)


def make_single(
    environment: type[gymnasium.Env],
    env_id: str,
    address: ServerAddress,
    max_episode_steps: int | None,
    parameters: dict[str, Any],
) -> Walkers:
    """Makes the walker of an `environment` that `gymnasium.make` may be making, or connects to a
    server that has one and compares it with the arguments."""
    if not address.is_remote():
        limit = 0 if max_episode_steps in (None, -1) else max_episode_steps
        return InProcessWalkers(env_id, {**parameters, "max_episode_steps": limit})
    takes_any_limit = False
    if max_episode_steps is None:
        max_episode_steps = limit_of_make(environment)
        takes_any_limit = max_episode_steps == ANY
    if max_episode_steps is not None and not takes_any_limit:
        limit = 0 if max_episode_steps == -1 else max_episode_steps
        parameters = {**parameters, "max_episode_steps": limit}
    return RemoteWalkers(env_id, parameters, address, takes_any_limit=takes_any_limit)
