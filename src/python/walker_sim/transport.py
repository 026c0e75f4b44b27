"""What the environments here ask of a walker, wherever it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, NamedTuple, Protocol, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from walker_sim.errors import InvalidAction

if TYPE_CHECKING:
    from walker_sim.rendering import Pictures

TRANSPORTS = ("inprocess", "ros")

Specification = Dict[str, Any]
"""By the names of EnvironmentSpec.msg; ``parameters`` holds texts by name."""


class Walker(Protocol):
    """One walker. Results go into arrays of the caller's."""

    specification: Specification

    def reset(
        self,
        seed: int | None,
        random: np.random.Generator,
        observation: NDArray[Any],
        info: NDArray[np.float64],
    ) -> None:
        """Begins an episode, drawn from `random` in process, by `seed` over ROS."""

    def step(
        self,
        action: NDArray[np.float64],
        observation: NDArray[Any],
        info: NDArray[np.float64],
    ) -> tuple[float, bool, bool, str]:
        """Returns reward, terminated, truncated and the engine's error or an empty text."""

    def render(
        self,
        pictures: Pictures,
        rgb: NDArray[np.uint8] | None,
        depth: NDArray[np.float32] | None,
    ) -> None:
        """Draws what it shows now: `rgb`, shape (height, width, 3), and `depth`, shape (height,
        width) [m], are filled where they are wanted."""

    def close(self) -> None:
        """Lets go of what it holds."""


class Batch(NamedTuple):
    """What a step gives, a row per environment; new arrays, the caller's to keep."""

    observations: NDArray[Any]  # (n, observation size), float32 or float64
    rewards: NDArray[np.float64]  # (n,)
    terminated: NDArray[np.bool_]  # (n,)
    truncated: NDArray[np.bool_]  # (n,)
    info: NDArray[np.float64]  # (n, info names), NaN where absent


class Rows:
    """Makes the arrays that several walkers' results go into."""

    def __init__(self, specification: Specification) -> None:
        self._observation_size = len(specification["observation_low"])
        self._num_infos = len(specification["info_names"])
        self._dtype = np.dtype(specification["observation_dtype"])

    def of_reset(self, count: int) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Observations, shape (count, observation size), and info, shape (count, info names)."""
        return (
            np.empty((count, self._observation_size), self._dtype),
            np.empty((count, self._num_infos)),
        )

    def of_step(self, count: int) -> Batch:
        """A batch of `count`."""
        observations, info = self.of_reset(count)
        flags = np.empty((2, count), np.bool_)
        return Batch(observations, np.empty(count), flags[0], flags[1], info)


class Walkers(Protocol):
    """Several walkers, stepped together."""

    specification: Specification
    num_envs: int

    def reset(
        self, environments: list[int], seeds: Sequence[int | None]
    ) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Observations and info of all, after a reset of some.

        `environments` empty: of all. `seeds`: empty, or one for each of these.
        """

    def step(self, actions: NDArray[np.float64]) -> Batch:
        """Steps all, actions of shape (n, action size)."""

    def final_rows(self) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Observations and info of all; of meaning where an episode ended in a same_step step."""

    def error(self, environment: int) -> str:
        """Why the engine had to end the episode in the last step, or an empty text."""

    def reset_error(self, environment: int) -> str:
        """Why there is no episode: what the engine said at the last reset, or an empty text."""

    def render(
        self,
        environment: int,
        pictures: Pictures,
        rgb: NDArray[np.uint8] | None,
        depth: NDArray[np.float32] | None,
    ) -> None:
        """As `Walker.render`, of one of them."""

    def close(self) -> None:
        """Lets go of what it holds."""


def by_name(names: Sequence[str], info: Sequence[float]) -> dict[str, Any]:
    """A row of info, without what is absent, which is NaN."""
    return {name: value for name, value in zip(names, info) if value == value}


def to_actions(actions: ArrayLike, count: int, size: int) -> NDArray[np.float64]:
    """As walkers take them, shape (count, size)."""
    array = np.ascontiguousarray(actions, np.float64)
    if array.shape != (count, size):
        raise InvalidAction(f"actions have shape {array.shape}; must have ({count}, {size})")
    return array


def make_walkers(
    env_id: str,
    num_envs: int,
    transport: str,
    server: str,
    master_uri: str,
    timeout: float,
    num_threads: int,
    batch_size: int,
    autoreset_mode: str,
    parameters: dict[str, Any],
) -> Walkers:
    """The walkers, here or on a server; the server's are compared with what is asked for."""
    if transport == "inprocess":
        from walker_sim.in_process import InProcessWalkers

        return InProcessWalkers(
            env_id, parameters, num_envs, num_threads, autoreset_mode, batch_size
        )
    if transport == "ros":
        from walker_sim.over_ros import RemoteWalkers

        if num_threads:
            raise ValueError(
                f"num_threads = {num_threads}: over ROS it is the server's parameter; must be 0"
            )
        if batch_size:
            raise ValueError(
                f"batch_size = {batch_size}: over ROS all walkers step together; must be 0"
            )
        return RemoteWalkers(
            env_id, parameters, num_envs, autoreset_mode, server, master_uri, timeout
        )
    raise ValueError(f"transport = {transport!r}: must be one of {', '.join(TRANSPORTS)}")
