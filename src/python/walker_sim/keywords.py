"""Checks of keywords, counts and environment indices."""

from __future__ import annotations

import difflib
import inspect
import operator
from typing import Any, Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from walker_sim import _core
from walker_sim.errors import UnknownKeyword
from walker_sim.rendering import camera_keywords_of


def refuse_unknown(
    constructor: Callable[..., None], env_id: str, parameters: Mapping[str, Any]
) -> None:
    """Raises UnknownKeyword for the first of the constructor's ``**parameters`` that is unknown."""
    if not parameters:
        return
    own = [known["name"] for known in _core.parameters_of(env_id)]
    unknown = [name for name in parameters if name not in own]
    if not unknown:
        return
    kinds = (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    signature = inspect.signature(constructor).parameters.values()
    named = [
        one.name for one in signature if one.kind in kinds and one.name not in ("self", "env_id")
    ]
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


def to_count(name: str, given: int, lowest: int) -> int:
    """Returns an integer, e.g. NumPy's, in [lowest, 2^63) as int. The core checks upper bounds."""
    try:
        count = operator.index(given)
    except TypeError:
        raise TypeError(f"{name} = {_core.shown(given)}: must be an integer") from None
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
