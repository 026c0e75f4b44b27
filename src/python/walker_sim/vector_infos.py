"""The infos of vector environments, as Gymnasium's own put them together."""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core

Infos = Dict[str, Any]
"""By name an array with an element for each row, by ``_name`` the mask of the rows that have it."""


def to_infos(
    names: Sequence[str], info: NDArray[np.float64], rows: NDArray[np.bool_] | None = None
) -> Infos:
    """What is in the array, without what is in no row.

    Parameters
    ----------
    names
        Of the columns.
    info
        Shape (n, number of names); NaN where absent.
    rows
        Shape (n,), those that count; None: all.
    """
    if not names:
        return {}
    if rows is not None:
        info = np.where(rows[:, np.newaxis], info, np.nan)
    columns = np.empty(info.shape[::-1])
    masks = np.empty(info.shape[::-1], np.bool_)
    has_any = _core.info_columns(info, len(names), columns, masks)
    infos: Infos = {}
    for name, column, mask, is_anywhere in zip(names, columns, masks, has_any):
        if is_anywhere:
            infos[name] = column
            infos[f"_{name}"] = mask
    return infos


def add_errors(infos: Infos, rows: NDArray[np.bool_], error_of: Callable[[int], str]) -> None:
    """Adds ``error``, where the simulation had to end an episode, in a step or at its reset.

    Parameters
    ----------
    infos
        Of as many rows as `rows`.
    rows
        Shape (n,), those that may have an error.
    error_of
        By row; empty without an error.
    """
    texts = {row: error_of(row) for row in rows.nonzero()[0].tolist()}
    texts = {row: text for row, text in texts.items() if text}
    if texts:
        infos["error"], infos["_error"] = objects(len(rows), texts.keys(), texts.values())


def add_finals(
    infos: Infos, ended: NDArray[np.bool_], observations: NDArray[Any], final_info: Infos
) -> None:
    """Adds ``final_obs`` and ``final_info``, of the episodes that were followed by another at once.

    Parameters
    ----------
    infos
        Of as many rows as the other arrays.
    ended
        Shape (n,), those that count in the others.
    observations
        Shape (n, observation size); the infos keep its rows.
    final_info
        Of the same rows.
    """
    rows = ended.nonzero()[0]
    infos["final_obs"], infos["_final_obs"] = objects(len(ended), rows, observations[rows])
    infos["final_info"], infos["_final_info"] = final_info, ended.copy()


def objects(
    count: int, rows: Iterable[int], values: Iterable[Any]
) -> tuple[NDArray[np.object_], NDArray[np.bool_]]:
    """An array of objects, None but in some rows, and the mask of these; shape (count,)."""
    array = np.full(count, None, dtype=object)
    mask = np.zeros(count, np.bool_)
    for row, value in zip(rows, values):
        array[row] = value
        mask[row] = True
    return array, mask
