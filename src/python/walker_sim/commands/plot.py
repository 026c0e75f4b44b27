"""Plots the returns of episodes."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from walker_sim.commands.episodes import Episode
from walker_sim.commands.options import InputError
from walker_sim.commands.summary import Summary

# Colours of Okabe and Ito's palette for colour blindness; the marks distinguish them in grey.
ENDS = {
    "arrived": ("#009E73", "o"),
    "time limit": ("#0072B2", "s"),
    "fell": ("#D55E00", "v"),
    "terminated": ("#D55E00", "v"),
    "failed": ("#000000", "x"),
}
MEAN = "#444444"


def _figure(**keywords: Any) -> Any:
    """Makes a matplotlib figure without pyplot, i.e. without global state or a display."""
    try:
        return importlib.import_module("matplotlib.figure").Figure(**keywords)
    except ImportError as error:
        raise InputError(f"--plot needs matplotlib: pip install matplotlib ({error})") from error


def check_format(path: Path) -> None:
    """Raises InputError if matplotlib cannot write this file format."""
    formats = sorted(_figure().canvas.get_supported_filetypes())
    if path.suffix[1:] not in formats:
        raise InputError(f"--plot {path}: must end in .{', .'.join(formats)}")


def write_plot(
    path: Path,
    title: str,
    episodes: Sequence[Episode],
    summary: Summary,
    threshold: float | None,
) -> None:
    """Plots returns in the order of the seeds, and beside it their histogram."""
    figure = _figure(figsize=(10, 4.5), layout="constrained")
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
    by_seed.xaxis.set_major_formatter(lambda position, _: _seed_at(episodes, position))
    by_seed.xaxis.get_major_locator().set_params(integer=True)

    bins = np.histogram_bin_edges(returns, min(40, max(20, len(returns) // 4)))
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
    figure.savefig(path, dpi=150)


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


def _seed_at(episodes: Sequence[Episode], position: float) -> str:
    index = round(position)
    return str(episodes[index].seed) if 0 <= index < len(episodes) else ""
