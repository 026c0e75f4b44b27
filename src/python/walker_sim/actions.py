"""Converts the caller's actions to arrays that the core reads."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.errors import InvalidAction

_READ_IN_PLACE = (np.dtype(np.float32), np.dtype(np.float64))


def to_action(given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Returns one action, shape (action size,), as by `to_numbers`; InvalidAction otherwise."""
    action = to_numbers("action", given, shape)
    if action.shape != shape:
        raise InvalidAction(f"action has shape {action.shape}; must have {shape}, one per joint")
    return action


def to_actions(given: Any, count: int, size: int) -> NDArray[Any]:
    """Returns several actions, shape (count, action size), as by `to_numbers`."""
    shape = (count, size)
    actions = to_numbers("actions", given, shape)
    if actions.shape != shape:
        raise InvalidAction(f"actions have shape {actions.shape}; must have {shape}, one per joint")
    return actions


def to_numbers(name: str, given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Converts an array, a list, a tensor, or any object with ``__array__`` or ``__dlpack__``.

    Contiguous float32 and float64 values in host memory are not copied; all else is. The core reads
    unaligned values, too. Raises InvalidAction if `given` does not consist of numbers. `shape` is
    for its message only: the callers check it, more strictly than Gymnasium's walkers.
    """
    try:
        array = np.asarray(given)
        if array.dtype.kind == "O" and hasattr(given, "__dlpack__"):
            array = np.from_dlpack(given)
    except Exception as error:  # any error of the object's own library
        reason = f" ({error})" if hasattr(given, "__dlpack__") else ""
        raise InvalidAction(
            f"{name} = {_core.shown(given)}: must be an array of shape {shape}{reason}"
        ) from error
    if array.dtype.kind not in "fiub":
        raise InvalidAction(f"{name} = {_core.shown(given)}: must hold numbers, not {array.dtype}")
    dtype = array.dtype if array.dtype in _READ_IN_PLACE else np.float64
    return array if array.ndim == 0 else np.ascontiguousarray(array, dtype)
