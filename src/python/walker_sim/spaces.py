"""Gymnasium's spaces of a specification."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from walker_sim.transport import Specification


def observation_space_of(specification: Specification) -> Box:
    """Shape (observation size,), float32 or float64."""
    dtype = np.dtype(specification["observation_dtype"])
    low = np.array(specification["observation_low"], dtype)
    high = np.array(specification["observation_high"], dtype)
    return Box(low, high, dtype=dtype.type)


def action_space_of(specification: Specification) -> Box:
    """Shape (action size,), float32."""
    low = np.array(specification["action_low"], np.float32)
    high = np.array(specification["action_high"], np.float32)
    return Box(low, high, dtype=np.float32)
