"""Actions of the caller's, as the core reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.errors import InvalidAction

_READ_IN_PLACE = (np.dtype(np.float32), np.dtype(np.float64))


def to_action(given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """The numbers of one action, shape (action size,); see `to_numbers`."""
    action = to_numbers("action", given, shape)
    if action.shape != shape:
        raise InvalidAction(f"action has shape {action.shape}; must have {shape}, one per joint")
    return action


def to_actions(given: Any, count: int, size: int) -> NDArray[Any]:
    """Those of several actions, shape (count, action size); see `to_numbers`."""
    shape = (count, size)
    actions = to_numbers("actions", given, shape)
    if actions.shape != shape:
        raise InvalidAction(f"actions have shape {actions.shape}; must have {shape}, one per joint")
    return actions


def to_numbers(name: str, given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """An array, a list, a tensor, or what else has ``__array__`` or ``__dlpack__``.

    Where float32 or float64 values lie one after the other in this machine's memory, the array is
    that memory itself; all else is copied. The core reads values that are not aligned, too.

    Raises
    ------
    walker_sim.InvalidAction
        For what is not made of numbers. Another shape is the caller's matter: Gymnasium's walkers
        would take some for an action.
    """
    try:
        array = np.asarray(given)
        if array.dtype.kind == "O" and hasattr(given, "__dlpack__"):
            array = np.from_dlpack(given)
    except Exception as error:  # of the library that the object is from
        reason = f" ({error})" if hasattr(given, "__dlpack__") else ""
        raise InvalidAction(
            f"{name} = {_core.shown(given)}: must be an array of shape {shape}{reason}"
        ) from error
    if array.dtype.kind not in "fiub":
        raise InvalidAction(f"{name} = {_core.shown(given)}: must hold numbers, not {array.dtype}")
    dtype = array.dtype if array.dtype in _READ_IN_PLACE else np.float64
    return array if array.ndim == 0 else np.ascontiguousarray(array, dtype)
