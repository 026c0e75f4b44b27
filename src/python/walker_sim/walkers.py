"""Walkers, in process or over ROS: their interface, specification and results."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Dict, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.worlds import DrawnWorld, World

if TYPE_CHECKING:
    from walker_sim.in_process import InProcessWalkers
    from walker_sim.rendering import Draw, Pictures

TRANSPORTS = ("inprocess", "ros")
LIDAR_RAYS = 10

Specification = Dict[str, Any]
"""Fields of EnvironmentSpec.msg by name; ``parameters`` maps names to texts."""

State = Tuple[NDArray[Any], NDArray[np.float64]]
"""Observation, shape (observation size,), float32 or float64, and info, shape (info names,), NaN
where absent. For several walkers, one row each."""

Colors = Optional[NDArray[np.uint8]]
"""Output array, shape (height, width, 3); None: not wanted."""

Depths = Optional[NDArray[np.float32]]
"""Output array, shape (height, width) [m]; None: not wanted."""


def release_of(engine_version: str) -> str:
    """Returns an engine's release and origin."""
    return engine_version.partition(", stepped by ")[0].partition(", libm: ")[0]


def variant_of(engine_version: str, key: str) -> str:
    """Returns the variant of what the engine's bits depend on; empty if the version lacks it.

    Keys: ``libm``, the C library's variant; ``levels``, what levels are made of.
    """
    text = engine_version.partition(", stepped by ")[0]
    return text.partition(f", {key}: ")[2].partition(", ")[0]


def spaces_of(specification: Specification) -> tuple[Box, Box]:
    """Returns the spaces of observations, shape (observation size,), float32 or float64, and of
    actions, shape (action size,), float32."""

    def box(what: str, dtype: str) -> Box:
        low, high = (np.array(specification[f"{what}_{end}"], dtype) for end in ("low", "high"))
        return Box(low, high, dtype=low.dtype.type)

    return box("observation", specification["observation_dtype"]), box("action", "float32")


def has_lidar(parameters: Mapping[str, Any]) -> bool:
    """Whether an environment with these parameters, values or texts, observes an optional lidar."""
    return str(parameters.get("include_lidar_in_observation")).lower() == "true"


def attributes_of(specification: Specification) -> dict[str, Any]:
    """Returns the constant attributes: ``hardcore`` of BipedalWalker, ``observation_structure`` of
    Walker2d-v5 and Hopper-v5."""
    parameters = specification["parameters"]
    attributes: dict[str, Any] = {}
    if "hardcore" in parameters:
        attributes["hardcore"] = parameters["hardcore"] == "true"
    if "frame_skip" in parameters:  # v5
        skipped = int(parameters["exclude_current_positions_from_observation"] == "true")
        lidar = LIDAR_RAYS if has_lidar(parameters) else 0
        size = (len(specification["observation_low"]) - lidar + skipped) // 2  # nq = nv
        attributes["observation_structure"] = {
            "skipped_qpos": skipped,
            "qpos": size - skipped,
            "qvel": size,
            **({"lidar": lidar} if lidar else {}),
        }
    return attributes


class ServerAddress(NamedTuple):
    """Address of walkers. All fields but `transport` are for walkers over ROS."""

    transport: str = "inprocess"
    server: str = "/walker_sim"
    master_uri: str = ""
    timeout: float = 10.0  # per call [s of wall time]
    spin_us: int | None = None  # longest time to poll for an answer [us]; None: measured

    def is_remote(self) -> bool:
        """Returns whether the walkers are on a server; ValueError if the transport is unknown."""
        if self.transport not in TRANSPORTS:
            raise ValueError(
                f"transport = {_core.shown(self.transport)}: must be one of {', '.join(TRANSPORTS)}"
            )
        return self.transport == "ros"


class Batch(NamedTuple):
    """Result of a step, one row per environment, in new arrays that the caller owns."""

    observations: NDArray[Any]  # (n, observation size), float32 or float64
    rewards: NDArray[np.float64]  # (n,)
    terminated: NDArray[np.bool_]  # (n,)
    truncated: NDArray[np.bool_]  # (n,)
    info: NDArray[np.float64]  # (n, info names), NaN where absent


class Walkers(ABC):
    """One walker, or several that are stepped together.

    For one walker there are also `reset_single`, `step_single`, `get_state`, `set_state`,
    `set_coordinates` and `is_healthy`; it is not reset at the end of its episode.
    """

    def __init__(self, specification: Specification, num_envs: int) -> None:
        self.specification, self.num_envs = specification, num_envs
        self._size = len(specification["observation_low"])
        self._num_infos = len(specification["info_names"])
        self._dtype = np.dtype(specification["observation_dtype"])

    @property
    @abstractmethod
    def _driver(self) -> _core.Pool | _core.Client:
        """The core's object that executes the calls."""

    @abstractmethod
    def reset(
        self, environments: list[int], seeds: Sequence[int | None], worlds: Sequence[World] = ()
    ) -> State:
        """Resets some walkers and returns observations and info of all.

        Empty `environments` stands for all. `seeds` is empty or has one element for each of these.
        `worlds` of these and the following episodes: as for `set_world`, or empty for the present.
        """

    def set_world(self, environments: list[int], worlds: Sequence[World]) -> None:
        """Sets the worlds of environments' resets to come: one for all of them, or one each.

        Empty `environments` stands for all. On an error, no world has changed.
        """
        self._driver.set_world(environments, worlds)

    @abstractmethod
    def worlds(self) -> tuple[World, ...]:
        """Returns the worlds of the environments' resets to come."""

    def episode_worlds(self, environments: list[int]) -> list[DrawnWorld]:
        """Returns what the present episodes of these environments have drawn from their worlds."""
        return self._driver.episode_worlds(environments)

    def drawn_worlds(self, environments: Sequence[int]) -> dict[int, DrawnWorld]:
        """Returns what was drawn by the episodes that the last step has begun in a world, by row.
        `environments` has the environment of each row."""
        return self._driver.drawn_worlds(environments)

    def pool(self, name: str) -> InProcessWalkers:
        """Returns this object, if it is in process; else raises an AttributeError with `name`."""
        raise AttributeError(f'{name}: not over ROS; only with transport="inprocess"')

    @abstractmethod
    def reset_single(
        self, seed: int | None, random: np.random.Generator, state: State, world: World | None
    ) -> None:
        """Begins the walker's episode, and writes its first observation and info into `state`.

        In process it continues `random`, over ROS the server's own generator. `world` is that of
        this and the following episodes; None: the present one.
        """

    def step_single(self, action: NDArray[Any], state: State) -> tuple[float, bool, bool, str]:
        """Steps the walker by an action, float32 or float64, shape (action size,). Returns reward,
        terminated, truncated and the engine's error or an empty text."""
        return self._driver.step_single(action, *state)

    @abstractmethod
    def get_state(self, random: np.random.Generator | None) -> bytes:
        """Returns the walker's state: in process the whole one, over ROS the episode's record."""

    @abstractmethod
    def set_state(self, state: bytes) -> np.random.Generator | None:
        """Restores a state. Returns its generator; None if it has none, or a server has it."""

    def set_coordinates(self, qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> None:
        """Sets the walker's generalized positions and velocities, shape (n,) each
        [m, rad, m/s, rad/s]."""
        self._driver.set_coordinates(0, qpos, qvel)

    @property
    @abstractmethod
    def is_healthy(self) -> bool:
        """Whether the walker is healthy; AttributeError if its robot does not define this."""

    def step(self, actions: NDArray[Any]) -> Batch:
        """Steps all walkers; `actions` is float32 or float64, shape (n, action size)."""
        batch = self._new_batch(self.num_envs)
        self._driver.step_batch(actions, batch)
        return batch

    def final_rows(self, count: int) -> State:
        """Returns the last observations and info of the episodes that ended in the last batch.

        Only for same_step. There are `count` rows, as in that batch; rows of other walkers are
        unspecified.
        """
        rows = self._new_rows(count)
        self._driver.final_rows(*rows)
        return rows

    def error(self, environment: int) -> str:
        """Returns why the engine had to end the episode in the last step, or an empty text."""
        return self._driver.error(environment)

    def reset_error(self, environment: int) -> str:
        """Returns the engine's error if the last reset failed, or an empty text."""
        return self._driver.reset_error(environment)

    @abstractmethod
    def render(self, environment: int, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        """Draws a walker's present state."""

    def drawer(self, environment: int) -> Draw:
        """Returns `render` of one walker."""
        return functools.partial(self.render, environment)

    @abstractmethod
    def close(self) -> None:
        """Releases the walkers' resources."""

    def _new_rows(self, count: int) -> State:
        return np.empty((count, self._size), self._dtype), np.empty((count, self._num_infos))

    def _new_batch(self, count: int) -> Batch:
        observations, info = self._new_rows(count)
        flags = np.empty((2, count), np.bool_)
        return Batch(observations, np.empty(count), flags[0], flags[1], info)


def by_name(names: Sequence[str], info: Sequence[float]) -> dict[str, Any]:
    """Returns a row of info as a dictionary, without absent values, which are NaN."""
    return {name: value for name, value in zip(names, info) if not math.isnan(value)}
