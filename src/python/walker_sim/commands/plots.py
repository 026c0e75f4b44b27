"""Plots of episodes' returns: by seed, by world, or as heat maps."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from walker_sim.commands.grid import Grid
from walker_sim.commands.options import InputError
from walker_sim.commands.results import Summary, WorldResult, are_equal, short, with_unit
from walker_sim.files import replace_figure

COLORS = "viridis"
# Colours of Okabe and Ito's palette for colour blindness; the marks distinguish them in grey.
ENDS = {
    "arrived": ("#009E73", "o"),
    "time limit": ("#0072B2", "s"),
    "fell": ("#D55E00", "v"),
    "terminated": ("#D55E00", "v"),
    "failed": ("#000000", "x"),
}
MEAN = "#444444"


def make_figure(**keywords: Any) -> Any:
    """Makes a matplotlib figure without pyplot, i.e. without global state or a display."""
    try:
        return importlib.import_module("matplotlib.figure").Figure(**keywords)
    except ImportError as error:
        raise InputError(f"--plot needs matplotlib: pip install matplotlib ({error})") from error


def check(path: Path, number_of_axes: int) -> None:
    """Raises InputError if matplotlib cannot write this file format, or draw so many axes."""
    if number_of_axes > 2:
        raise InputError(f"--plot {path}: must have at most two --grid, not {number_of_axes}")
    formats = sorted(make_figure().canvas.get_supported_filetypes())
    if path.suffix[1:] not in formats:
        raise InputError(f"--plot {path}: must end in .{', .'.join(formats)}")


def write_plot(
    path: Path,
    title: str,
    env_id: str,
    grid: Grid | None,
    found: Sequence[WorldResult],
    threshold: float | None,
) -> None:
    """Draws returns by seed, or of a grid mean returns: by one axis or by world with their
    intervals, otherwise as a heat map."""
    if grid is None:
        figure = _draw_seeds(title, found[0], threshold)
    elif len(grid.axes) == 2 or (grid.axes and len(grid.rows) > 1):
        figure = _draw_heat_maps(title, env_id, grid, found)
    else:
        figure = _draw_intervals(title, env_id, grid, found)
    replace_figure(path, figure, dpi=150)


def _draw_seeds(title: str, found: WorldResult, threshold: float | None) -> Any:
    """Draws returns in the order of the seeds, and beside it their histogram."""
    episodes, summary = found.episodes, found.summary
    figure = make_figure(figsize=(10, 4.5), layout="constrained")
    by_seed, spread = figure.subplots(1, 2, sharey=True, width_ratios=[2, 1])
    figure.suptitle(title, fontsize="medium")
    returns = np.array([episode.episode_return for episode in episodes])
    kinds = [end for end in ENDS if end in summary.ends]
    order = np.arange(len(episodes))
    chosen = {end: np.array([episode.end == end for episode in episodes]) for end in kinds}

    for end in kinds:
        color, mark = ENDS[end]
        label = f"{end} {summary.ends[end]:.1%}"
        at = order[chosen[end]], returns[chosen[end]]
        by_seed.scatter(*at, s=18, color=color, marker=mark, label=label, alpha=0.85)
    margin = 0.5 + len(episodes) / 100
    by_seed.set(xlabel="seed", ylabel="return", xlim=(-margin, len(episodes) - 1 + margin))
    seeds = {index: str(episode.seed) for index, episode in enumerate(episodes)}
    by_seed.xaxis.set_major_formatter(lambda position, _: seeds.get(round(position), ""))
    by_seed.xaxis.get_major_locator().set_params(integer=True)

    spanned = returns[:1] if are_equal(returns.tolist()) else returns
    bins = np.histogram_bin_edges(spanned, min(40, max(20, len(returns) // 4)))
    spread.hist(
        [returns[chosen[end]] for end in kinds],
        bins,
        stacked=True,
        edgecolor="white",
        linewidth=0.5,
        orientation="horizontal",
        color=[ENDS[end][0] for end in kinds],
        alpha=0.85,
    )
    spread.set(xlabel="episodes")
    spread.xaxis.get_major_locator().set_params(integer=True)
    for axes in (by_seed, spread):
        _draw_mean(axes, summary, threshold)
    figure.legend(
        *by_seed.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(kinds) + 3,
        fontsize="small",
        frameon=False,
    )
    return figure


def _draw_mean(axes: Any, summary: Summary, threshold: float | None) -> None:
    label = f"mean {summary.mean:,.1f}"
    if summary.interval:
        low, high = summary.interval
        axes.axhspan(low, high, color=MEAN, alpha=0.18, linewidth=0, zorder=0)
        label += f", 95 % {low:,.1f} to {high:,.1f}"
    axes.axhline(summary.mean, color=MEAN, linewidth=1.2, label=label)
    label = f"median {summary.median:,.1f}"
    axes.axhline(summary.median, color=MEAN, linewidth=1.0, linestyle=":", label=label)
    if threshold is not None and threshold <= 1.2 * summary.most:
        label = f"threshold {threshold:g}"
        axes.axhline(threshold, color="#999999", linewidth=1.0, linestyle="--", label=label)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_intervals(title: str, env_id: str, grid: Grid, found: Sequence[WorldResult]) -> Any:
    figure = make_figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    plain, *cells = [one.summary for one in found]
    low, high = plain.interval or (plain.mean, plain.mean)
    axes.axhspan(low, high, color=MEAN, alpha=0.18, linewidth=0)
    axes.axhline(plain.mean, color=MEAN, linewidth=1.2, label=f"plain {plain.mean:,.1f}")
    places: Sequence[float] = range(len(cells))
    if grid.axes:
        order = np.argsort(grid.axes[0].values)
        places, cells = sorted(grid.axes[0].values), [cells[index] for index in order]
        axes.set(xlabel=with_unit(env_id, grid.axes[0].name))
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


def _draw_heat_maps(title: str, env_id: str, grid: Grid, found: Sequence[WorldResult]) -> Any:
    """Draws the first axis upwards, or the worlds downwards if there is one axis only."""
    across = grid.axes[-1]
    plain, *cells = found
    count = len(grid.rows) if len(grid.axes) == 2 else 1  # heat maps
    height = len(cells) // len(across.values) // count
    shape = (count, height, len(across.values))
    means = np.array([one.summary.mean for one in cells]).reshape(shape)
    fell = np.array([one.fell for one in cells]).reshape(shape)
    size = (1.6 + count * (0.9 + 0.85 * shape[2]), 1.6 + 0.55 * height)
    figure = make_figure(figsize=size, layout="constrained")
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
        axes.set_xticks(range(shape[2]), [*map(short, across.values)])
        axes.set(xlabel=with_unit(env_id, across.name))
        if count > 1:
            axes.set_title(grid.rows[index], fontsize="small")
    if len(grid.axes) == 2:
        up = grid.axes[0]
        panels[0].set_yticks(range(height), [*map(short, up.values)])
        panels[0].set(ylabel=with_unit(env_id, up.name))
    else:
        panels[0].set_yticks(range(height), grid.rows)
    figure.suptitle(
        f"{title}\nmean return, share that fell; plain {plain.summary.mean:,.0f}, {plain.fell:.0%}",
        fontsize="small",
    )
    figure.colorbar(image, ax=list(panels), label="mean return")
    figure.get_layout_engine().set(w_pad=0.1)  # [inches]
    return figure
