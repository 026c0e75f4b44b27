"""Plays whole episodes of many networks, in many worlds, in C++."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, NamedTuple, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core, arguments
from walker_sim.registration import without_namespace
from walker_sim.walkers import by_name
from walker_sim.worlds import AnyWorld, DrawnWorld, World, to_world

AnyPolicy = Union[str, "os.PathLike[str]", bytes, "_core.Policy"]
"""A policy's file, or its content."""


@dataclass(order=True)
class PlayedEpisode:
    """Outcome of an episode, or of its steps so far."""

    order: int  # index of its job; of its seed, after the episodes of earlier worlds
    seed: int
    episode_return: float = 0.0
    length: int = 0  # [steps]
    terminated: bool = False
    truncated: bool = False
    end: str = ""  # arrived, fell, terminated, time limit or failed
    info: dict[str, float] = field(default_factory=dict)  # of the last step
    error: str = ""  # the engine's message if it failed
    world: DrawnWorld = field(default_factory=dict)  # drawn at the reset
    # Over the observations that the policy got; empty: not asked for.
    observation_sums: Sequence[float] = ()
    observation_squares: Sequence[float] = ()


class Outcomes(NamedTuple):
    """Outcomes of episodes: arrays of shape (policies, worlds, seeds)."""

    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]  # [steps]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    ends: NDArray[np.str_]  # arrived, fell, terminated, time limit or failed


def play_out(
    env_id: str,
    policies: AnyPolicy | Sequence[AnyPolicy],
    seeds: Sequence[int],
    *,
    worlds: Sequence[AnyWorld] = (None,),
    num_threads: int = 0,
    **parameters: Any,
) -> Outcomes:
    """Plays one episode for each policy, world and seed, with all processors.

    Parameters
    ----------
    env_id
        Id of the environment, with or without the prefix ``walker_sim/``.
    policies
        One policy or several, as files or their content.
    seeds
        Seed of each episode's reset, from 0 to 2^64 - 1.
    worlds
        See `walker_sim.worlds`. The default is Gymnasium's world alone.
    num_threads
        Number of threads; 0: one per processor. Results do not depend on it.
    parameters
        The environment's parameters.

    Raises
    ------
    ValueError, TypeError
        If a policy cannot be read or does not fit, or for a wrong seed, world or parameter.
    """
    env_id = without_namespace(env_id)
    arguments.refuse_unknown(play_out, env_id, parameters)
    if isinstance(policies, (str, os.PathLike, bytes, _core.Policy)):
        policies = [policies]
    networks = [_to_network(policy) for policy in policies]
    ranges = [to_world(env_id, world) for world in worlds]
    shape = len(networks), len(ranges), len(seeds)
    numbers = [_to_seed(seed) for seed in seeds]
    jobs = [(policy, numbers[seed], world) for policy, world, seed in np.ndindex(shape)]
    player = make_player(env_id, parameters, arguments.to_count("num_threads", num_threads, 0))
    episodes = play_jobs(player, networks, ranges, jobs)
    return Outcomes(
        np.array([one.episode_return for one in episodes], np.float64).reshape(shape),
        np.array([one.length for one in episodes], np.int64).reshape(shape),
        np.array([one.terminated for one in episodes], np.bool_).reshape(shape),
        np.array([one.truncated for one in episodes], np.bool_).reshape(shape),
        np.array([one.end for one in episodes], np.str_).reshape(shape),
    )


def make_player(
    env_id: str,
    parameters: Mapping[str, Any],
    num_threads: int = 0,
    num_envs: int | None = None,
    sums_observations: bool = False,
) -> _core.EpisodePlayer:
    """Makes a player of `num_envs` environments, default 64 per thread; `num_threads`: 0 for one
    per processor."""
    return _core.EpisodePlayer(
        env_id, dict(parameters), num_threads, num_envs or 0, sums_observations
    )


def play_jobs(
    player: _core.EpisodePlayer,
    policies: Sequence[_core.Policy],
    worlds: Sequence[World],
    jobs: Sequence[tuple[int, int, int]],
    receive: Callable[[PlayedEpisode], None] = lambda episode: None,
) -> list[PlayedEpisode]:
    """Plays jobs, each the index of a policy, a seed and the index of a world (0 for Gymnasium's if
    `worlds` is empty). Returns the outcomes in their order; calls `receive` with each as soon as
    its episode has ended."""
    specification = player.specification
    episodes: list[PlayedEpisode] = [None] * len(jobs)  # type: ignore[list-item]

    def keep(job: int, *fields: Any) -> None:
        episode_return, length, terminated, truncated, reward, error, info, world, *sums = fields
        episodes[job] = PlayedEpisode(
            *(job, jobs[job][1], episode_return, length, terminated, truncated),
            end_of(specification["id"], terminated, reward, error),
            by_name(specification["info_names"], info),
            *(error, world, *sums),
        )
        receive(episodes[job])

    player.play(policies, worlds, jobs, keep)
    return episodes


def end_of(env_id: str, terminated: bool, reward: float, error: str) -> str:
    """Returns how an episode ended, given the reward of its last step: arrived, fell, terminated,
    time limit or failed."""
    if error:
        return "failed"
    if not terminated:
        return "time limit"
    failure_reward = _failure_reward(env_id)
    if failure_reward is None:
        return "terminated"
    return "fell" if reward == failure_reward else "arrived"


@functools.lru_cache(maxsize=None)
def _failure_reward(env_id: str) -> float | None:
    failure_reward: float | None = _core.registration_of(env_id)["failure_reward"]
    return failure_reward


def _to_network(policy: AnyPolicy) -> _core.Policy:
    if isinstance(policy, _core.Policy):
        return policy
    if isinstance(policy, bytes):
        return _core.Policy.from_bytes("content", policy)
    return _core.Policy(os.fsencode(policy))


def _to_seed(seed: int) -> int:
    number = arguments.to_whole("seed", seed)
    if not 0 <= number < 1 << 64:
        raise ValueError(f"seed = {_core.shown(seed)}: must be from 0 to 2^64 - 1")
    return number
