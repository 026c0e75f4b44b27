"""Checks and conversions of the arguments of environments."""

from __future__ import annotations

import difflib
import inspect
import operator
from typing import Any, Callable, Mapping, Optional, Sequence, Union

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from walker_sim import _core
from walker_sim.errors import InvalidAction, UnknownKeyword
from walker_sim.rendering import camera_keywords_of

Seeds = Union[None, int, Sequence[Optional[int]]]
"""None, the first walker's seed, or one per walker."""

_READ_IN_PLACE = (np.dtype(np.float32), np.dtype(np.float64))


def to_action(given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Converts one action, shape (action size,)."""
    return _to_numbers("action", "has", given, shape)


def to_actions(given: Any, count: int, size: int) -> NDArray[Any]:
    """Converts several actions, shape (count, action size)."""
    return _to_numbers("actions", "have", given, (count, size))


def _to_numbers(name: str, verb: str, given: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Converts an array, a list, a tensor, or any object with ``__array__`` or ``__dlpack__``.

    Contiguous float32 and float64 values in host memory are not copied; all else is. The core reads
    unaligned values, too. Raises InvalidAction if `given` does not consist of numbers or has
    another shape, more strictly than Gymnasium's walkers.
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
    if array.shape != shape:
        raise InvalidAction(f"{name} {verb} shape {array.shape}; must have {shape}, one per joint")
    dtype = array.dtype if array.dtype in _READ_IN_PLACE else np.float64
    return np.ascontiguousarray(array, dtype)


def to_coordinates(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Returns generalized positions or velocities as float64; ValueError if not shape (n,)."""
    coordinates = np.ascontiguousarray(values, np.float64)
    if np.ndim(values) != 1:
        raise ValueError(f"{name} has the shape {np.shape(values)}; must be one-dimensional")
    return coordinates


def refuse_unknown(
    constructor: Callable[..., object], env_id: str, parameters: Mapping[str, Any]
) -> None:
    """Raises UnknownKeyword for the first of the constructor's ``**parameters`` that is unknown."""
    own = [known["name"] for known in _core.parameters_of(env_id)]
    unknown = [name for name in parameters if name not in own]
    if not unknown:
        return
    named = [*inspect.signature(constructor).parameters][2:-1]  # not self, env_id and parameters
    known = list(dict.fromkeys([*named, *own, *sorted(camera_keywords_of(env_id))]))
    name = unknown[0]
    nearest = difflib.get_close_matches(name, known, 1)
    shown_name = _core.shown(name).strip("'")
    hint = f"; did you mean {nearest[0]}?" if nearest else "."
    raise UnknownKeyword(
        f"parameter {shown_name} = {_core.shown(parameters[name])}: unknown{hint} "
        f"Known: {' '.join(known)}; "
        # Python's wording, which TorchRL searches for.
        f"{constructor.__qualname__}() got an unexpected keyword argument '{shown_name}'"
    )


def to_whole(name: str, given: int) -> int:
    """Returns an integer, e.g. NumPy's, as int."""
    try:
        return operator.index(given)
    except TypeError:
        raise TypeError(f"{name} = {_core.shown(given)}: must be an integer") from None


def to_count(name: str, given: int, lowest: int) -> int:
    """Returns an integer, e.g. NumPy's, in [lowest, 2^63) as int. The core checks upper bounds."""
    count = to_whole(name, given)
    if count < lowest:
        raise ValueError(f"{name} = {_core.shown(count)}: must be at least {lowest}")
    if count >= 1 << 63:
        raise ValueError(f"{name} = {_core.shown(count)}: must be below 2^63")
    return count


def to_indices(name: str, env_ids: ArrayLike | None, num_envs: int) -> list[int]:
    """Returns environment indices in [0, num_envs) as a list, duplicates included; None: all."""
    if env_ids is None:
        return list(range(num_envs))
    try:
        indices = np.asarray(env_ids)
    except ValueError:  # a ragged nested list
        indices = np.empty((0, 0))
    if indices.ndim != 1 or (indices.size > 0 and indices.dtype.kind not in "iu"):
        raise TypeError(f"{name} = {_core.shown(env_ids)}: must be a sequence of integers")
    for index in indices.tolist():
        if not 0 <= index < num_envs:
            raise ValueError(f"environment {index}: must be in [0, {num_envs - 1}]")
    return indices.tolist()  # type: ignore[no-any-return]


def to_mode(given: str | gymnasium.vector.AutoresetMode) -> gymnasium.vector.AutoresetMode:
    """Converts an `AutoresetMode`, its value (NextStep) or its name (next_step)."""
    for mode in gymnasium.vector.AutoresetMode:
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
