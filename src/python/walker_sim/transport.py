"""What the environments here ask of a walker, wherever it is."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Dict, NamedTuple, Optional, Protocol, Sequence, Tuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

if TYPE_CHECKING:
    from walker_sim import _core
    from walker_sim.in_process import InProcessWalkers
    from walker_sim.rendering import Draw, Pictures

TRANSPORTS = ("inprocess", "ros")

Specification = Dict[str, Any]
"""By the names of EnvironmentSpec.msg; ``parameters`` holds texts by name."""

State = Tuple[NDArray[Any], NDArray[np.float64]]
"""Observation, shape (observation size,), float32 or float64, and info, shape (info names,), NaN
where absent; of several walkers a row each."""

Colors = Optional[NDArray[np.uint8]]
"""To be filled, shape (height, width, 3), where they are wanted."""

Depths = Optional[NDArray[np.float32]]
"""To be filled, shape (height, width) [m], where they are wanted."""


def release_of(engine_version: str) -> str:
    """An engine's release and origin."""
    return engine_version.partition(", stepped by ")[0].partition(", libm: ")[0]


def libm_of(engine_version: str) -> str:
    """The variant of the C library that the engine's bits depend on; empty if none is named."""
    return engine_version.partition(", stepped by ")[0].partition(", libm: ")[2]


def spaces_of(specification: Specification) -> tuple[Box, Box]:
    """Of observations, shape (observation size,), float32 or float64, and of actions, shape
    (action size,), float32."""
    return (
        _box(specification, "observation", np.dtype(specification["observation_dtype"])),
        _box(specification, "action", np.dtype(np.float32)),
    )


def _box(specification: Specification, what: str, dtype: np.dtype[Any]) -> Box:
    low, high = (np.array(specification[f"{what}_{end}"], dtype) for end in ("low", "high"))
    return Box(low, high, dtype=dtype.type)


class Place(NamedTuple):
    """Where walkers are; all but the first for those over ROS."""

    transport: str = "inprocess"
    server: str = "/walker_sim"
    master_uri: str = ""
    timeout: float = 10.0  # of each call [s of wall time]


class Walker(Protocol):
    """One walker. Results go into arrays of the caller's."""

    specification: Specification

    def reset(self, seed: int | None, random: np.random.Generator, state: State) -> None:
        """Begins an episode, drawn from `random` in process, by `seed` over ROS."""

    def step(self, action: NDArray[Any], state: State) -> tuple[float, bool, bool, str]:
        """Takes float32 or float64, shape (action size,). Returns reward, terminated, truncated
        and the engine's error or an empty text."""

    def render(self, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        """Draws what it shows now."""

    def get_state(self, random: np.random.Generator | None) -> bytes:
        """All that decides about what follows, `random` in place of its own generator."""

    def set_state(self, state: bytes) -> np.random.Generator | None:
        """Goes on from there. Returns the generator; None: none yet, or the server has it."""

    def set_coordinates(self, qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> None:
        """Goes on from these; shape (n,) each [m, rad, m/s, rad/s]."""

    @property
    def is_healthy(self) -> bool:
        """Whether it is within its healthy ranges."""
        ...

    def close(self) -> None:
        """Lets go of what it holds."""


class Batch(NamedTuple):
    """What a step gives, a row per environment; new arrays, the caller's to keep."""

    observations: NDArray[Any]  # (n, observation size), float32 or float64
    rewards: NDArray[np.float64]  # (n,)
    terminated: NDArray[np.bool_]  # (n,)
    truncated: NDArray[np.bool_]  # (n,)
    info: NDArray[np.float64]  # (n, info names), NaN where absent


class Walkers(ABC):
    """Several walkers, stepped together."""

    def __init__(self, specification: Specification, num_envs: int) -> None:
        self.specification, self.num_envs = specification, num_envs
        self._size = len(specification["observation_low"])
        self._num_infos = len(specification["info_names"])
        self._dtype = np.dtype(specification["observation_dtype"])

    @property
    @abstractmethod
    def _driver(self) -> _core.Pool | _core.Client:
        """What makes the calls."""

    @abstractmethod
    def reset(self, environments: list[int], seeds: Sequence[int | None]) -> State:
        """Observations and info of all, after a reset of some.

        `environments` empty: of all. `seeds`: empty, or one for each of these.
        """

    def pool(self, name: str) -> InProcessWalkers:
        """These, for what only walkers of this process have: `name`, for the AttributeError."""
        raise AttributeError(f'{name}: not over ROS; only with transport="inprocess"')

    def step(self, actions: NDArray[Any]) -> Batch:
        """Steps all, actions of shape (n, action size), float32 or float64."""
        batch = self._new_batch(self.num_envs)
        self._driver.step_batch(actions, batch)
        return batch

    def final_rows(self, count: int) -> State:
        """Observations and info of the last batch, which had `count` rows; of meaning where an
        episode ended in a same_step step."""
        rows = self._new_rows(count)
        self._driver.final_rows(*rows)
        return rows

    def error(self, environment: int) -> str:
        """Why the engine had to end the episode in the last step, or an empty text."""
        return self._driver.error(environment)

    def reset_error(self, environment: int) -> str:
        """Why there is no episode: what the engine said at the last reset, or an empty text."""
        return self._driver.reset_error(environment)

    @abstractmethod
    def render(self, environment: int, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        """As `Walker.render`, of one of them."""

    def drawer(self, environment: int) -> Draw:
        """What draws one of them."""
        return functools.partial(self.render, environment)

    @abstractmethod
    def close(self) -> None:
        """Lets go of what it holds."""

    def _new_rows(self, count: int) -> State:
        return np.empty((count, self._size), self._dtype), np.empty((count, self._num_infos))

    def _new_batch(self, count: int) -> Batch:
        observations, info = self._new_rows(count)
        flags = np.empty((2, count), np.bool_)
        return Batch(observations, np.empty(count), flags[0], flags[1], info)


def by_name(names: Sequence[str], info: Sequence[float]) -> dict[str, Any]:
    """A row of info, without what is absent, which is NaN."""
    return {name: value for name, value in zip(names, info) if not math.isnan(value)}


def make_walkers(
    env_id: str,
    num_envs: int,
    autoreset_mode: str,
    parameters: dict[str, Any],
    place: Place,
    num_threads: int = 0,
    batch_size: int = 0,
) -> Walkers:
    """The walkers, here or on a server; the server's are compared with what is asked for."""
    if place.transport == "inprocess":
        from walker_sim.in_process import InProcessWalkers

        return InProcessWalkers(
            env_id, parameters, num_envs, num_threads, autoreset_mode, batch_size
        )
    if place.transport == "ros":
        from walker_sim.over_ros import RemoteWalkers

        if num_threads:
            raise ValueError(
                f"num_threads = {num_threads}: over ROS it is the server's parameter; must be 0"
            )
        if batch_size:
            raise ValueError(
                f"batch_size = {batch_size}: over ROS all walkers step together; must be 0"
            )
        return RemoteWalkers(env_id, parameters, num_envs, autoreset_mode, place)
    from walker_sim import _core
    from walker_sim.in_process import InProcessWalkers

    raise ValueError(
        f"transport = {_core.shown(place.transport)}: must be one of {', '.join(TRANSPORTS)}"
    )
