"""Infos of vector environments, in the layout of Gymnasium's."""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.worlds import DrawnWorld

Infos = Dict[str, Any]
"""``name``: array with one element per row; ``_name``: mask of the rows that have a value."""


def to_infos(
    names: Sequence[str], info: NDArray[np.float64], rows: NDArray[np.bool_] | None = None
) -> Infos:
    """Converts an array of info, shape (n, number of names), NaN where absent, without the columns
    that are absent in every row. `rows` is a mask of the rows to include, shape (n,); None: all."""
    if not names:
        return {}
    if rows is not None:
        info = np.where(rows[:, np.newaxis], info, np.nan)
    columns = np.zeros(info.shape[::-1])
    masks = np.zeros(info.shape[::-1], np.bool_)
    has_any = _core.info_columns(info, len(names), columns, masks)
    infos: Infos = {}
    for name, column, mask, is_anywhere in zip(names, columns, masks, has_any):
        if is_anywhere:
            infos[name] = column
            infos[f"_{name}"] = mask
    return infos


def add_worlds(infos: Infos, count: int, drawn: Mapping[int, DrawnWorld]) -> None:
    """Adds ``world``, a dictionary in the same layout, if any of the `count` rows has `drawn`. An
    array that has ranges is one of objects."""
    if not drawn:
        return
    worlds: Infos = {}
    masks = infos["_world"] = np.zeros(count, np.bool_)
    for row, values in drawn.items():
        masks[row] = True
        for name, value in values.items():
            if name not in worlds:
                has_ranges = any(
                    not isinstance(each.get(name, 0.0), float) for each in drawn.values()
                )
                worlds[name] = np.full(count, None) if has_ranges else np.zeros(count)
                worlds[f"_{name}"] = np.zeros(count, np.bool_)
            worlds[name][row], worlds[f"_{name}"][row] = value, True
    infos["world"] = worlds


def add_errors(
    infos: Infos,
    rows: NDArray[np.bool_],
    environments: Sequence[int],
    error_of: Callable[[int], str],
) -> None:
    """Adds ``error`` for rows whose engine failed in a step or a reset.

    `rows` is a mask of those that may have an error, shape (n,); `environments` has the environment
    of each row, and `error_of` returns an environment's error, or an empty text.
    """
    texts = {row: error_of(environments[row]) for row in rows.nonzero()[0].tolist()}
    texts = {row: text for row, text in texts.items() if text}
    if texts:
        infos["error"], infos["_error"] = objects(len(rows), texts.keys(), texts.values())


def add_finals(
    infos: Infos, ended: NDArray[np.bool_], observations: NDArray[Any], final_info: Infos
) -> None:
    """Adds ``final_obs`` and ``final_info`` of the episodes that ended in a same_step step: copies
    the rows of `observations`, shape (n, observation size), in the mask `ended`, shape (n,)."""
    rows = ended.nonzero()[0]
    infos["final_obs"], infos["_final_obs"] = objects(len(ended), rows, observations[rows])
    infos["final_info"], infos["_final_info"] = final_info, ended.copy()


def objects(
    count: int, rows: Iterable[int], values: Iterable[Any]
) -> tuple[NDArray[np.object_], NDArray[np.bool_]]:
    """Returns an array of objects with `values` in `rows`, else None, and the mask of `rows`."""
    array = np.full(count, None, dtype=object)
    mask = np.zeros(count, np.bool_)
    for row, value in zip(rows, values):
        array[row] = value
        mask[row] = True
    return array, mask
