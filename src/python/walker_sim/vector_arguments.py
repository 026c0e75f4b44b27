"""Checks of the arguments of vector environments."""

from __future__ import annotations

import operator
from typing import Any, Optional, Sequence, Union

import gymnasium
import numpy as np
from numpy.typing import NDArray

from walker_sim import _core

try:
    from gymnasium.vector import AutoresetMode as AutoresetMode
except ImportError as error:
    raise ImportError(
        f"WalkerVectorEnv needs Gymnasium 1.1 or later; this is {gymnasium.__version__}"
    ) from error

Seeds = Union[None, int, Sequence[Optional[int]]]
"""None, the first walker's seed, or one per walker."""


def to_mode(given: str | AutoresetMode) -> AutoresetMode:
    """Converts an `AutoresetMode`, its value (NextStep) or its name (next_step)."""
    for mode in AutoresetMode:
        if given in (mode, mode.value, mode.name.lower()):
            return mode
    raise ValueError(
        f"autoreset_mode = {_core.shown(given)}: must be next_step, same_step or disabled"
    )


def to_seeds(seed: Seeds, num_envs: int) -> list[int | None]:
    """Returns one seed per walker, or an empty list for None."""
    if seed is None:
        return []
    seeds: list[int | None]
    try:
        if isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + i for i in range(num_envs)]
        else:
            seeds = [None if one is None else operator.index(one) for one in seed]
    except TypeError:
        raise TypeError(
            f"seed = {_core.shown(seed)}: must be None, an integer, or a sequence of these"
        ) from None
    if len(seeds) != num_envs:
        raise ValueError(f"{len(seeds)} seeds; must be {num_envs}, one for each walker")
    for one in seeds:
        if one is not None and one < 0:  # Gymnasium's error and text
            shown = _core.shown(one)
            raise gymnasium.error.Error(
                f"Seed must be greater or equal to zero, actual value: {shown}"
            )
    return seeds


def to_mask(mask: Any, num_envs: int) -> NDArray[np.bool_]:
    """Returns ``reset_mask``; refuses the same masks as Gymnasium's vector environments."""
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        what = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
        raise TypeError(f"options['reset_mask'] is of {what}; must be a NumPy array of bool")
    if mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask'] has shape {mask.shape}; must have ({num_envs},)")
    if not mask.any():
        raise ValueError("options['reset_mask'] is False everywhere; must be True somewhere")
    return mask
