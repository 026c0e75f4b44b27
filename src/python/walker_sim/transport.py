"""What the environments here ask of a walker, wherever it is."""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Protocol, Sequence

import numpy as np
from numpy.typing import NDArray

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

    def close(self) -> None:
        """Lets go of what it holds."""


class Batch(NamedTuple):
    """What a step gives, a row per environment; new arrays, the caller's to keep."""

    observations: NDArray[Any]  # (n, observation size), float32 or float64
    rewards: NDArray[np.float64]  # (n,)
    terminated: NDArray[np.bool_]  # (n,)
    truncated: NDArray[np.bool_]  # (n,)
    info: NDArray[np.float64]  # (n, info names), NaN where absent


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

    def close(self) -> None:
        """Lets go of what it holds."""
