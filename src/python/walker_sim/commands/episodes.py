"""Plays one episode per seed, several at once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Iterator, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.transport import Batch, Walkers, by_name

Policy = Callable[[NDArray[Any]], NDArray[Any]]
"""Maps an observation, shape (observation size,), to an action, shape (action size,)."""


class Steps(NamedTuple):
    """Record of an episode of n steps. The first of n + 1 elements is the reset's."""

    observations: list[NDArray[Any]]  # n + 1 x (observation size,)
    actions: list[NDArray[Any]]  # n x (action size,)
    rewards: list[float]  # n
    terminated: list[bool]  # n
    truncated: list[bool]  # n
    infos: list[NDArray[np.float64]]  # n + 1 x (info names,), NaN where absent


@dataclass(order=True)
class Episode:
    """Outcome of an episode, or of its steps so far."""

    order: int  # index of its seed
    seed: int
    episode_return: float = 0.0
    length: int = 0  # [steps]
    terminated: bool = False
    truncated: bool = False
    end: str = ""  # arrived, fell, terminated, time limit or failed
    info: dict[str, float] = field(default_factory=dict)  # of the last step
    error: str = ""  # the engine's error, if it ended the episode
    steps: Steps = field(default_factory=lambda: Steps([], [], [], [], [], []))


def play(
    walkers: Walkers,
    seeds: Sequence[int],
    policy_of: Callable[[int], Policy],
    keeps_steps: bool = False,
) -> Iterator[Episode]:
    """Plays every episode to its end. The episodes do not depend on `walkers.num_envs`.

    Parameters
    ----------
    walkers
        Walkers with autoreset mode next_step, in any state.
    seeds
        Seed of each episode's reset.
    policy_of
        Returns a policy, without state of other episodes, for a seed.
    keeps_steps
        Whether to fill `Episode.steps`.

    Yields
    ------
    Episode
        Episodes in the order in which they end.
    """
    player = _Player(walkers, seeds, policy_of, keeps_steps)
    if walkers.num_envs > len(seeds):
        walkers.reset([], [])  # walkers without a seed are stepped, too, so they need an episode
    yield from player.begin(list(range(walkers.num_envs)))
    while player.running:
        yield from player.step()


def end_of(walkers: Walkers, batch: Batch, environment: int) -> str:
    """Returns how an episode ended with this step: arrived, fell, terminated, time limit or failed;
    empty if it continues."""
    terminated, reward = bool(batch.terminated[environment]), batch.rewards[environment]
    if not terminated:
        return "time limit" if batch.truncated[environment] else ""
    if walkers.error(environment):
        return "failed"
    failure_reward = _core.registration_of(walkers.specification["id"])["failure_reward"]
    if failure_reward is None:
        return "terminated"
    return "fell" if reward == failure_reward else "arrived"


class _Player:
    def __init__(
        self,
        walkers: Walkers,
        seeds: Sequence[int],
        policy_of: Callable[[int], Policy],
        keeps_steps: bool,
    ) -> None:
        self.running: dict[int, tuple[Episode, Policy]] = {}  # by environment
        self._walkers, self._policy_of, self._keeps_steps = walkers, policy_of, keeps_steps
        self._waiting = iter(enumerate(seeds))
        specification = walkers.specification
        self._info_names: list[str] = specification["info_names"]
        self._actions = np.zeros((walkers.num_envs, len(specification["action_low"])))

    def begin(self, environments: list[int]) -> list[Episode]:
        """Resets environments with the next seeds; those without a seed keep stepping with zero
        actions. Returns the episodes whose reset failed in the engine."""
        for environment in environments:
            self._actions[environment] = 0
        refused = []
        while environments:
            begun = dict(zip(environments, self._waiting))
            if not begun:
                break
            observations, info = self._walkers.reset(
                list(begun), [seed for _, seed in begun.values()]
            )
            self._observations = observations
            environments = []
            for environment, (order, seed) in begun.items():
                episode = Episode(order, seed)
                if self._keeps_steps:
                    episode.steps.observations.append(observations[environment].copy())
                    episode.steps.infos.append(info[environment].copy())
                episode.error = self._walkers.reset_error(environment)
                if episode.error:
                    episode.terminated, episode.end = True, "failed"
                    refused.append(episode)
                    environments.append(environment)
                else:
                    self.running[environment] = episode, self._policy_of(seed)
        return refused

    def step(self) -> list[Episode]:
        """Steps all environments; begins new episodes where one ended. Returns the ended ones."""
        for environment, (_, policy) in self.running.items():
            self._actions[environment] = policy(self._observations[environment])
        batch = self._walkers.step(self._actions)
        self._observations = batch.observations
        rewards = batch.rewards.tolist()
        for environment, (episode, _) in self.running.items():
            episode.episode_return += rewards[environment]
            episode.length += 1
            if self._keeps_steps:
                self._keep(episode.steps, batch, environment)
        flags = (batch.terminated | batch.truncated).tolist()
        ended = [environment for environment in self.running if flags[environment]]
        episodes = [self._conclude(self.running.pop(e)[0], batch, e) for e in ended]
        return episodes + self.begin(ended)

    def _keep(self, steps: Steps, batch: Batch, environment: int) -> None:
        steps.observations.append(batch.observations[environment].copy())
        steps.actions.append(self._actions[environment].astype(np.float32))
        steps.rewards.append(float(batch.rewards[environment]))
        steps.terminated.append(bool(batch.terminated[environment]))
        steps.truncated.append(bool(batch.truncated[environment]))
        steps.infos.append(batch.info[environment].copy())

    def _conclude(self, episode: Episode, batch: Batch, environment: int) -> Episode:
        episode.terminated = bool(batch.terminated[environment])
        episode.truncated = bool(batch.truncated[environment])
        episode.end = end_of(self._walkers, batch, environment)
        episode.info = by_name(self._info_names, batch.info[environment].tolist())
        episode.error = self._walkers.error(environment)
        return episode
