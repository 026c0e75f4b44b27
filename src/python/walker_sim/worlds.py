"""Worlds: levels, physics, disturbances, delays and noise beyond Gymnasium's environments."""

from __future__ import annotations

import math
import numbers
import os
from typing import Any, Dict, Mapping, Sequence, Tuple, Union

from walker_sim import _core
from walker_sim.registration import without_namespace

Range = Union[Tuple[float, float], Dict[str, Tuple[float, float]]]
"""(low, high), equal for a number; or ``{"log": (low, high)}``, drawn by the logarithm."""

World = Dict[str, Range]
"""Range by parameter name. Empty: Gymnasium's world."""

DrawnWorld = Dict[str, Union[float, Range]]
"""What an episode has drawn from its world: numbers, and the ranges of what changes within it."""

AnyRange = Union[float, Sequence[float], Mapping[str, Sequence[float]]]

AnyWorld = Union[None, str, "os.PathLike[str]", Mapping[str, AnyRange]]
"""What users write for a world: None (Gymnasium's), a preset's name, a YAML file's path, a text as
``"{gravity: -5, push_interval: [1, 3]}"``, or a mapping of names to numbers, pairs (low, high), or
``{"log": (low, high)}``, whose logarithm is drawn uniformly.
"""

AnyWorlds = Union[AnyWorld, Sequence[AnyWorld]]
"""One world for several walkers, or a sequence with one for each."""


def world_presets() -> list[str]:
    """Returns the names of the presets."""
    return _core.world_presets()


def world_parameters(env_id: str) -> list[dict[str, Any]]:
    """Returns the parameters that a world can set in an environment, with or without the prefix
    ``walker_sim/``: dictionaries with ``name``, ``unit`` (empty: unitless), ``description``,
    ``default`` (Gymnasium's; NaN: Gymnasium has nothing of the kind), ``minimum``, ``maximum``,
    ``is_whole`` (whether it takes whole numbers only) and ``can_change`` (whether it can change
    within an episode, with ``change_interval``)."""
    return _core.world_parameters(without_namespace(env_id))


def read_world(given: AnyWorld) -> World:
    """Converts a world of any environment. ValueError if a text cannot be read, TypeError if the
    world or one of its parameters is of another type."""
    if given is None:
        return {}
    if isinstance(given, Mapping):
        return {name: _to_range(name, value) for name, value in given.items()}
    if isinstance(given, (str, os.PathLike)):
        return _core.load_world(_to_bytes(given))
    raise TypeError(
        f"world = {_core.shown(given)}: must be None, a preset's name, a YAML file's path, or a "
        "mapping of names to numbers, pairs (low, high) or {'log': (low, high)}"
    )


def to_world(env_id: str, given: AnyWorld) -> World:
    """As `read_world`. ValueError names the parameter, its value and what is allowed if the
    environment cannot apply the world."""
    world = read_world(given)
    _core.check_world(env_id, world)
    return world


def to_worlds(env_id: str, given: AnyWorlds, count: int) -> list[World]:
    """Converts one world, or a sequence with one for each of `count` walkers, with the errors of
    `to_world`, which then name the walker's place in the sequence."""
    is_one = given is None or isinstance(given, (str, os.PathLike, Mapping))
    if is_one or not isinstance(given, Sequence):
        return [to_world(env_id, given)]  # type: ignore[arg-type]
    if len(given) != count:
        raise ValueError(f"{len(given)} worlds; must be one, or {count}, one for each walker")
    worlds: list[World] = []
    for index, one in enumerate(given):
        try:
            worlds.append(to_world(env_id, one))
        except (TypeError, ValueError) as error:
            kind = ValueError if isinstance(error, ValueError) else TypeError
            raise kind(f"world {index}: {error}") from error
    return worlds


def range_text(world: World) -> str:
    """Returns a world as a text for `to_world`, with all digits."""
    return _core.world_text(world)


def text_of(drawn: DrawnWorld) -> str:
    """Returns what an episode has drawn as `range_text` does."""
    return range_text(read_world(drawn))


def _to_bytes(text: str | os.PathLike[str]) -> bytes:
    try:
        return os.fsencode(text)
    except UnicodeEncodeError:
        raise ValueError(
            f"world = {_core.shown(text)}: must be a text that UTF-8 can encode; no surrogates"
        ) from None


def ends_of(given: Range) -> tuple[float, float]:
    """Returns the lowest and the highest value."""
    return given["log"] if isinstance(given, dict) else given


def _to_range(name: Any, given: Any) -> Range:
    """Returns the range of a number, or of a sequence of two, e.g. NumPy's or OmegaConf's."""
    is_log_uniform = isinstance(given, Mapping) and [*given] == ["log"]
    values = given["log"] if is_log_uniform else given
    values = values.tolist() if hasattr(values, "tolist") else values
    is_pair = isinstance(values, Sequence) and not isinstance(values, (str, bytes))
    pair = values if is_pair else (values, values)
    is_wrong = is_log_uniform and not is_pair
    if is_wrong or len(pair) != 2 or not all(map(_is_number, pair)):
        shown_name = _core.shown(name).strip("'")
        raise TypeError(
            f"world parameter {shown_name} = {_core.shown(given)}: must be a number, a pair "
            "(low, high), or {'log': (low, high)}"
        )
    ends = _to_float(pair[0]), _to_float(pair[1])
    return {"log": ends} if is_log_uniform and ends[0] != ends[1] else ends


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _to_float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:  # an int beyond 1.8e308, which the core refuses as infinite
        return math.inf if value > 0 else -math.inf
