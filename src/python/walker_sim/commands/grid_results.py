"""Results of a grid of worlds: table, JSON file, heat map, and commands that repeat episodes."""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path
from typing import Any, Callable, NamedTuple, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.commands import results
from walker_sim.commands.episodes import Episode
from walker_sim.commands.grid import Cell, Grid
from walker_sim.commands.results import Summary, rounded
from walker_sim.files import replace_figure, replace_file
from walker_sim.worlds import text_of

FALLS = ("fell", "terminated")
PLAIN = "plain"
COLORS = "viridis"
NOTES = f"""\
plain is Gymnasium's world; difference: mean of a seed's return minus its return in plain
intervals: 95 % confidence for the mean ({results.METHOD})"""


class CellResult(NamedTuple):
    """Outcomes of the episodes in one world."""

    cell: Cell | None  # None: the plain world
    episodes: Sequence[Episode]
    summary: Summary
    fell: float  # fraction of episodes that ended as fell or terminated
    difference: float  # of the mean return to that in the plain world
    difference_interval: tuple[float, float] | None  # 95 %, by pairs; None for a single seed


def summarise(grid: Grid, episodes: Sequence[Episode], threshold: float | None) -> list[CellResult]:
    """Returns the plain world's result, then those of the cells. `episodes`: all, in order."""
    cells = [None, *grid.cells]
    count = len(episodes) // len(cells)
    plain = np.array([episode.episode_return for episode in episodes[:count]])
    found = []
    for index, cell in enumerate(cells):
        chosen = episodes[index * count : (index + 1) * count]
        differences = np.array([episode.episode_return for episode in chosen]) - plain
        summary = results.summarise(chosen, threshold)
        found.append(
            CellResult(
                *(cell, chosen, summary, sum(summary.ends.get(end, 0) for end in FALLS)),
                float(differences.mean()),
                results.bootstrap_interval(differences) if count > 1 else None,
            )
        )
    return found


def report(env_id: str, grid: Grid, found: Sequence[CellResult], threshold: float | None) -> str:
    """Returns a table with a line per world. `threshold`: of a column with the fraction of returns
    of at least this; None: no such column."""
    has_rows = len(grid.rows) > 1
    names = ["world"] * has_rows + [_with_unit(env_id, axis.name) for axis in grid.axes]
    columns = {
        "mean": [rounded(one.summary.mean) for one in found],
        "95 % interval": [_interval(one.summary.interval) for one in found],
        "fell": [f"{one.fell:.1%}" for one in found],
    }
    if any("failed" in one.summary.ends for one in found):
        columns["failed"] = [f"{one.summary.ends.get('failed', 0):.1%}" for one in found]
    if threshold is not None:
        columns[f">= {threshold:g}"] = [f"{one.summary.passes:.1%}" for one in found]
    columns["difference"] = [f"{one.difference:+,.1f}" if one.cell else "" for one in found]
    differences = [_interval(one.difference_interval) if one.cell else "" for one in found]

    left = [names, [PLAIN] + [""] * (len(names) - 1)]
    for cell in grid.cells:
        left.append([cell.row] * has_rows + [*map(_short, cell.values)])
    right = [[*columns, "95 % interval"], *map(list, zip(*columns.values(), differences))]
    table = zip(_aligned(left, str.ljust), _aligned(right, str.rjust))
    lines = [f"  {first}  {second}".rstrip() for first, second in table]
    return "\n".join([*lines, "", NOTES, *filter(None, [grid.note])])


def _aligned(rows: Sequence[Sequence[str]], align: Callable[[str, int], str]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  ".join(map(align, row, widths)) for row in rows]


def _interval(interval: tuple[float, float] | None) -> str:
    return "-" if interval is None else f"{rounded(interval[0])} to {rounded(interval[1])}"


def _short(value: float) -> str:
    return f"{value:.12g}"


def _with_unit(env_id: str, name: str) -> str:
    units = {one["name"]: one["unit"] for one in _core.world_parameters(env_id)}
    return f"{name} [{units[name]}]" if units[name] else name


def write_json(path: Path, head: dict[str, Any], grid: Grid, found: Sequence[CellResult]) -> None:
    """Writes `head`, the axes, the plain world's result and those of the cells."""
    plain, *cells = [_fields(grid, one) for one in found]
    axes = {axis.name: axis.values for axis in grid.axes}
    method = {"interval_method": results.METHOD}
    fields = {**head, **method, "grid": axes, "plain": plain, "cells": cells}
    replace_file(path, (json.dumps(fields, indent=1) + "\n").encode())


def _fields(grid: Grid, one: CellResult) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    if one.cell:
        if one.cell.row:
            fields["base"] = one.cell.row
        fields["values"] = {axis.name: value for axis, value in zip(grid.axes, one.cell.values)}
        fields["world"] = one.cell.world
        fields["difference"] = one.difference
        fields["difference_interval"] = one.difference_interval
    outcomes = results.outcomes_of(one.episodes)
    return {**fields, **one.summary._asdict(), "fell": one.fell, "outcomes": outcomes}


def worst(episodes: Sequence[Episode], count: int, options: argparse.Namespace) -> str:
    """Returns commands that show the episodes with the least returns, in the worlds that these have
    drawn."""
    lines = []
    for episode in sorted(episodes, key=lambda one: (one.episode_return, one.order))[:count]:
        words = ["play", *options.walker, "--policy", options.policy]
        if options.normalization:
            words += ["--normalization", str(options.normalization)]
        words += ["--seeds", str(episode.seed)]
        if episode.world:
            words += ["--world", text_of(episode.world)]
        lines += [
            f"  return {rounded(episode.episode_return)}, {episode.length} steps, {episode.end}:",
            f"    {shlex.join(['python3', '-m', 'walker_sim', *words])}",
        ]
    return "\n".join(["worst episodes:", *lines])


def write_plot(
    path: Path, title: str, env_id: str, grid: Grid, found: Sequence[CellResult]
) -> None:
    """Draws mean returns: by one axis or by world with their intervals, otherwise as a heat map."""
    draw = _draw_intervals
    if len(grid.axes) == 2 or (grid.axes and len(grid.rows) > 1):
        draw = _draw_heat_maps
    replace_figure(path, draw(title, env_id, grid, found), dpi=150)


def _draw_intervals(title: str, env_id: str, grid: Grid, found: Sequence[CellResult]) -> Any:
    figure = results.make_figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    plain, *cells = [one.summary for one in found]
    low, high = plain.interval or (plain.mean, plain.mean)
    axes.axhspan(low, high, color=results.MEAN, alpha=0.18, linewidth=0)
    axes.axhline(plain.mean, color=results.MEAN, linewidth=1.2, label=f"plain {plain.mean:,.1f}")
    places: Sequence[float] = range(len(cells))
    if grid.axes:
        order = np.argsort(grid.axes[0].values)
        places, cells = sorted(grid.axes[0].values), [cells[index] for index in order]
        axes.set(xlabel=_with_unit(env_id, grid.axes[0].name))
    else:
        axes.set_xticks(places, grid.rows, rotation=30, ha="right")
    means = np.array([one.mean for one in cells])
    intervals = np.array([one.interval or (one.mean, one.mean) for one in cells])
    errors = np.abs(intervals.T - means)
    axes.errorbar(places, means, errors, fmt="o-" if grid.axes else "o", capsize=3)
    axes.set(ylabel="mean return, 95 % confidence")
    axes.set_title(title, fontsize="medium")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_heat_maps(title: str, env_id: str, grid: Grid, found: Sequence[CellResult]) -> Any:
    """Draws the first axis upwards, or the worlds downwards if there is one axis only."""
    across = grid.axes[-1]
    plain, *cells = found
    count = len(grid.rows) if len(grid.axes) == 2 else 1  # heat maps
    height = len(cells) // len(across.values) // count
    shape = (count, height, len(across.values))
    means = np.array([one.summary.mean for one in cells]).reshape(shape)
    fell = np.array([one.fell for one in cells]).reshape(shape)
    size = (1.6 + count * (0.9 + 0.85 * shape[2]), 1.6 + 0.55 * height)
    figure = results.make_figure(figsize=size, layout="constrained")
    panels = figure.subplots(1, count, squeeze=False, sharey=True)[0]
    limits = min(means.min(), plain.summary.mean), max(means.max(), plain.summary.mean)
    colors = {"cmap": COLORS, "vmin": limits[0], "vmax": limits[1]}
    origin = "lower" if len(grid.axes) == 2 else "upper"
    for index, axes in enumerate(panels):
        image = axes.imshow(means[index], origin=origin, aspect="auto", **colors)
        for row, column in np.ndindex(shape[1:]):
            mean = means[index, row, column]
            axes.text(
                *(column, row, f"{mean:,.0f}\n{fell[index, row, column]:.0%}"),
                color="white" if mean < (limits[0] + limits[1]) / 2 else "black",
                ha="center",
                va="center",
                fontsize="x-small",
            )
        axes.set_xticks(range(shape[2]), [*map(_short, across.values)])
        axes.set(xlabel=_with_unit(env_id, across.name))
        if count > 1:
            axes.set_title(grid.rows[index], fontsize="small")
    if len(grid.axes) == 2:
        up = grid.axes[0]
        panels[0].set_yticks(range(height), [*map(_short, up.values)])
        panels[0].set(ylabel=_with_unit(env_id, up.name))
    else:
        panels[0].set_yticks(range(height), grid.rows)
    figure.suptitle(
        f"{title}\nmean return, share that fell; plain {plain.summary.mean:,.0f}, {plain.fell:.0%}",
        fontsize="small",
    )
    figure.colorbar(image, ax=list(panels), label="mean return")
    figure.get_layout_engine().set(w_pad=0.1)  # [inches]
    return figure
