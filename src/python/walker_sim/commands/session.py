"""Episodes of one walker that a person watches, pushes and changes."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import Any, Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands.episodes import Policy, RecordedEpisode, end_of
from walker_sim.commands.policies import Policies
from walker_sim.walkers import Walkers
from walker_sim.window import Pace
from walker_sim.worlds import World, text_of

END_SHOWN = 1.5  # duration of an episode's last picture [s of wall time]
MIN_SPEED, MAX_SPEED = 1 / 64, 64.0  # simulation time per wall time
POLL_INTERVAL = 0.01  # between looks at what a person has asked for [s of wall time]


class Session:
    """Endless sequence of episodes of one walker.

    `count` is the number of episodes so far, `episode` the present one with all of its steps and
    pushes. Its `end` is the result of `end_of`, empty while it continues. `policies` are those of
    the episodes to come.
    """

    def __init__(self, walkers: Walkers, policies: Policies, seeds: Sequence[int]) -> None:
        self.walkers, self.policies, self._seeds = walkers, policies, seeds
        self._actions = np.zeros((1, len(walkers.specification["action_low"])))
        specification = walkers.specification
        self._push_force = push_force(specification["id"], specification["dt"])
        self.count = 0
        self.episode = RecordedEpisode(0, seeds[0])
        self.begin_next()

    def begin_next(self) -> None:
        """Begins an episode with the next seed."""
        self.begin(self._seeds[self.count % len(self._seeds)])

    def begin(self, seed: int | None = None) -> None:
        """Begins the episode of a seed; None: the present one, again. RuntimeError if the
        simulation fails."""
        if seed is None:
            seed = self.episode.seed
        else:
            self.count += 1
        self._policy: Policy = self.policies(seed)
        observations, info = self.walkers.reset([0], [seed])
        self._force = np.zeros(2)
        error = self.walkers.reset_error(0)
        if error:
            self.episode = RecordedEpisode(self.count, seed, error=error, end="failed")
            raise RuntimeError(f"seed {seed}: the simulation failed at its reset: {error}")
        world = self.walkers.episode_worlds([0])[0]
        self.episode = RecordedEpisode(self.count, seed, world=world)
        self.episode.steps.begin(observations[0], info[0])
        self._observation: NDArray[Any] = observations[0]

    def set_world(self, world: World) -> None:
        """Sets the world of the episodes to come."""
        self.walkers.set_world([], [world])

    def push(self, way: Sequence[float] | NDArray[np.float64]) -> None:
        """Adds a push on the trunk to the next step. `way` is along the world's x and z, 1 for the
        default of a world's push_impulse. AttributeError if the walker is not in this process."""
        pool = self.walkers.pool("pushes by hand")
        if self.episode.end:
            return
        force = self._force + np.multiply(self._push_force, way)
        pool.push_trunk(0, *force)  # refuses what is too large
        self._force = force

    def step(self) -> None:
        """Steps the walker by the policy's action."""
        episode = self.episode
        self._actions[0] = self._policy(self._observation)
        batch = self.walkers.step(self._actions)
        if self._force.any():
            episode.pushes.append((episode.length, (self._force[0], self._force[1])))
            self._force = np.zeros(2)
        self._observation = batch.observations[0]
        episode.steps.add(self._actions[0], batch, 0)
        episode.length += 1
        episode.episode_return += float(batch.rewards[0])
        episode.end = end_of(self.walkers, batch, 0)


class Playback(ABC):
    """Steps a session in real time, as a window or a page shows it. `now` is a clock [s]."""

    def __init__(
        self, session: Session, pace: Pace, now: Callable[[], float] = time.monotonic
    ) -> None:
        self.session, self.pace, self._now = session, pace, now
        self.is_paused = False
        self._ended_at = 0.0

    def advance(self) -> None:
        """Steps if a step is due; begins the next episode END_SHOWN after the end of one."""
        if self.is_paused:
            return
        if not self.session.episode.end:
            if self.pace.time_left() == 0:
                self._step()
        elif self._now() >= self._ended_at + END_SHOWN:
            self.begin_next()

    def sleep(self) -> None:
        """Sleeps until a step may be due or a person may have asked for something."""
        is_running = not self.is_paused and not self.session.episode.end
        time.sleep(min(POLL_INTERVAL, self.pace.time_left()) if is_running else POLL_INTERVAL)

    def pause(self) -> None:
        """Pauses or continues."""
        self.is_paused = not self.is_paused
        self.pace.begin()

    def step_once(self) -> None:
        self.is_paused = True
        if not self.session.episode.end:
            self._step()
            self._show()

    def repeat(self) -> None:
        self._begin(self.session.begin)

    def begin_next(self) -> None:
        self._begin(self.session.begin_next)

    def set_speed(self, speed: float) -> None:
        """Sets the simulation time per wall time; ValueError outside MIN_SPEED to MAX_SPEED."""
        if not MIN_SPEED <= speed <= MAX_SPEED:
            raise ValueError(f"speed = {speed:g}: must be between {MIN_SPEED:g} and {MAX_SPEED:g}")
        self.pace.speed = speed
        self.pace.begin()

    def _begin(self, begin: Callable[[], None]) -> None:
        begin()
        self.pace.begin()
        self._show()

    def _step(self) -> None:
        self.session.step()
        is_due = self.pace.is_picture_due()
        episode = self.session.episode
        if episode.end:
            self._ended_at = self._now()
            print(text_of_end(episode), flush=True)
        if is_due or episode.end:
            self._show()

    @abstractmethod
    def _show(self) -> None:
        """Shows the present state."""


def push_force(env_id: str, dt: float) -> float:
    """Returns the force [N] that has the default of a world's push_impulse in a step of dt [s]."""
    parameters = _core.world_parameters(env_id)
    (impulse,) = (each["default"] for each in parameters if each["name"] == "push_impulse")
    return float(impulse / dt)


def text_of_end(episode: RecordedEpisode) -> str:
    """Returns a line about an episode that has ended."""
    world = f", world {text_of(episode.world)}" if episode.world else ""
    pushes = f", pushes by hand: {len(episode.pushes)}" if episode.pushes else ""
    return (
        f"episode {episode.order}, seed {episode.seed}: return {episode.episode_return:.1f}, "
        f"{episode.length} steps, {episode.end}{world}{pushes}"
    )
