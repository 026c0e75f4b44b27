"""Gymnasium's spaces of a specification."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box

from walker_sim.transport import Specification


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
