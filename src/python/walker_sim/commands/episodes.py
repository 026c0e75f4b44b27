"""Plays one episode per seed, several at once, with a progress bar."""

from __future__ import annotations

import contextlib
import importlib
import sys
from dataclasses import dataclass, field
from typing import Any, Callable, Iterator, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import episode_player
from walker_sim.episode_player import PlayedEpisode
from walker_sim.walkers import Batch, Walkers, by_name

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

    def begin(self, observation: NDArray[Any], info: NDArray[np.float64]) -> None:
        self.observations.append(observation.copy())
        self.infos.append(info.copy())

    def add(self, action: NDArray[Any], batch: Batch, environment: int) -> None:
        self.begin(batch.observations[environment], batch.info[environment])
        self.actions.append(action.astype(np.float32))
        self.rewards.append(float(batch.rewards[environment]))
        self.terminated.append(bool(batch.terminated[environment]))
        self.truncated.append(bool(batch.truncated[environment]))


@dataclass(order=True)
class RecordedEpisode(PlayedEpisode):
    """A played episode, its steps and its pushes by hand: the index of the step and the force along
    x and z [N] of each."""

    steps: Steps = field(default_factory=lambda: Steps([], [], [], [], [], []))
    pushes: list[tuple[int, tuple[float, float]]] = field(default_factory=list)


def play(
    walkers: Walkers,
    seeds: Sequence[int],
    policy_of: Callable[[int], Policy],
    keeps_steps: bool = False,
) -> Iterator[RecordedEpisode]:
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
        Whether to fill `RecordedEpisode.steps`.

    Yields
    ------
    RecordedEpisode
        Episodes in the order in which they end.
    """
    waiting = iter(enumerate(seeds))
    running: dict[int, tuple[RecordedEpisode, Policy]] = {}  # by environment
    free = list(range(walkers.num_envs))
    actions = np.zeros((walkers.num_envs, len(walkers.specification["action_low"])))
    if walkers.num_envs > len(seeds):
        walkers.reset([], [])  # environments without a seed are stepped, too: with zero actions
    while True:
        actions[free] = 0
        begun = dict(zip(free, waiting))
        free = []
        if begun:
            observations, info = walkers.reset([*begun], [seed for _, seed in begun.values()])
        drawn = walkers.episode_worlds([*begun])
        for (environment, (order, seed)), world in zip(begun.items(), drawn):
            error = walkers.reset_error(environment)
            episode = RecordedEpisode(order, seed, error=error, world=world)
            if keeps_steps:
                episode.steps.begin(observations[environment], info[environment])
            if episode.error:
                episode.terminated, episode.end = True, "failed"
                free.append(environment)
                yield episode
            else:
                running[environment] = episode, policy_of(seed)
        if free:
            continue
        if not running:
            return
        for environment, (_, policy) in running.items():
            actions[environment] = policy(observations[environment])
        batch = walkers.step(actions)
        observations = batch.observations
        rewards = batch.rewards.tolist()
        for environment, (episode, _) in running.items():
            episode.episode_return += rewards[environment]
            episode.length += 1
            if keeps_steps:
                episode.steps.add(actions[environment], batch, environment)
        has_ended = (batch.terminated | batch.truncated).tolist()
        free = [environment for environment in running if has_ended[environment]]
        for environment in free:
            episode, _ = running.pop(environment)
            episode.terminated = bool(batch.terminated[environment])
            episode.truncated = bool(batch.truncated[environment])
            episode.end = end_of(walkers, batch, environment)
            names = walkers.specification["info_names"]
            episode.info = by_name(names, batch.info[environment].tolist())
            episode.error = walkers.error(environment)
            yield episode


def end_of(walkers: Walkers, batch: Batch, environment: int) -> str:
    """Returns how an episode ended with this step: arrived, fell, terminated, time limit or failed;
    empty if it continues."""
    terminated, reward = bool(batch.terminated[environment]), batch.rewards[environment]
    if not terminated and not batch.truncated[environment]:
        return ""
    error = walkers.error(environment)
    return episode_player.end_of(walkers.specification["id"], terminated, float(reward), error)


@contextlib.contextmanager
def progress(total: int) -> Iterator[Callable[[PlayedEpisode], None]]:
    """Gives a function to call with each episode that has ended. With tqdm, it moves a bar on
    standard error if that is a terminal."""
    try:
        tqdm: Any = importlib.import_module("tqdm").tqdm
    except ImportError:
        if sys.stderr.isatty():
            print("no progress bar without tqdm: pip install tqdm", file=sys.stderr)
        yield lambda episode: None
        return
    returns = 0.0
    # disable=None: no bar if standard error is not a terminal.
    with tqdm(total=total, unit=" episodes", disable=None, leave=False) as bar:

        def move(episode: PlayedEpisode) -> None:
            nonlocal returns
            returns += episode.episode_return
            bar.set_postfix_str(f"mean return {returns / (bar.n + 1):.1f}", refresh=False)
            bar.update()

        yield move
