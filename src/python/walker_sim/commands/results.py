"""Results of episodes in one world or in a grid of worlds: statistics, text, JSON, and commands
that repeat episodes."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import shlex
from collections import Counter
from pathlib import Path
from typing import Any, Callable, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands.grid import Cell, Grid
from walker_sim.episode_player import PlayedEpisode
from walker_sim.files import replace_file
from walker_sim.worlds import text_of

RESAMPLES = 10_000
BINS = 12
BAR = 40  # length of the longest bar [characters]
METHOD = f"percentile bootstrap over seeds, {RESAMPLES:,} resamples"
FALLS = ("fell", "terminated")
PLAIN = "plain"
NOTES = f"""\
plain is Gymnasium's world; difference: mean of a seed's return minus its return in plain
intervals: 95 % confidence for the mean ({METHOD})"""


class Summary(NamedTuple):
    """Statistics over episodes with distinct seeds."""

    episodes: int
    mean: float
    interval: tuple[float, float] | None  # 95 % for the mean; None for a single episode
    median: float
    standard_deviation: float | None  # of a sample (n - 1); None for a single episode
    least: float
    most: float
    passes: float | None  # fraction with a return of at least the threshold; None without one
    ends: dict[str, float]  # fraction by PlayedEpisode.end, the most frequent first
    length_mean: float  # [steps]
    length_median: float
    length_least: int
    length_most: int


class WorldResult(NamedTuple):
    """Outcomes of the episodes in one world, the only one or one of a grid."""

    cell: Cell | None  # None: the plain world, or the only one
    episodes: Sequence[PlayedEpisode]
    summary: Summary
    fell: float  # fraction of episodes that ended as fell or terminated
    difference: float  # of the mean return to that in the plain world
    difference_interval: tuple[float, float] | None  # 95 %, by pairs; None for a single seed


def bootstrap_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Returns the percentile bootstrap's 95 % confidence interval for the mean of n >= 2 values.

    The distribution of returns has several modes (falls, arrivals), so Student's t does not fit.
    The resamples are drawn from a fixed seed: the same values give the same interval.
    """
    random = np.random.Generator(np.random.PCG64(0))
    rows = max(1, min(RESAMPLES, 1_000_000 // len(values)))  # at once, to bound memory
    means: list[NDArray[np.float64]] = []
    for begin in range(0, RESAMPLES, rows):
        shape = (min(rows, RESAMPLES - begin), len(values))
        means.append(values[random.integers(0, len(values), shape)].mean(axis=1))
    low, high = np.quantile(np.concatenate(means), [0.025, 0.975])
    return float(low), float(high)


def summarise(episodes: Sequence[PlayedEpisode], threshold: float | None) -> Summary:
    returns = np.array([episode.episode_return for episode in episodes])
    lengths = np.array([episode.length for episode in episodes])
    several = len(episodes) > 1
    ends = Counter(episode.end for episode in episodes).most_common()
    return Summary(
        episodes=len(episodes),
        mean=float(returns.mean()),
        interval=bootstrap_interval(returns) if several else None,
        median=float(np.median(returns)),
        standard_deviation=float(returns.std(ddof=1)) if several else None,
        least=float(returns.min()),
        most=float(returns.max()),
        passes=None if threshold is None else float((returns >= threshold).mean()),
        ends={end: count / len(episodes) for end, count in ends},
        length_mean=float(lengths.mean()),
        length_median=float(np.median(lengths)),
        length_least=int(lengths.min()),
        length_most=int(lengths.max()),
    )


def summarise_worlds(
    grid: Grid | None, episodes: Sequence[PlayedEpisode], threshold: float | None
) -> list[WorldResult]:
    """Returns the result of the only world, or the plain world's and then those of the cells.
    `episodes`: all, in order."""
    cells = [None, *(grid.cells if grid else [])]
    count = len(episodes) // len(cells)
    plain = np.array([episode.episode_return for episode in episodes[:count]])
    found = []
    for index, cell in enumerate(cells):
        chosen = episodes[index * count : (index + 1) * count]
        differences = np.array([episode.episode_return for episode in chosen]) - plain
        summary = summarise(chosen, threshold)
        found.append(
            WorldResult(
                *(cell, chosen, summary, sum(summary.ends.get(end, 0) for end in FALLS)),
                float(differences.mean()),
                bootstrap_interval(differences) if count > 1 else None,
            )
        )
    return found


def report(
    env_id: str,
    grid: Grid | None,
    found: Sequence[WorldResult],
    threshold: float | None,
    asks_for_threshold: bool,
) -> str:
    """Returns the statistics and the histogram of one world, or a table with a line per world.

    Parameters
    ----------
    threshold
        Return whose share is reported, if it is not None; `asks_for_threshold`: in the table too.
    """
    if grid:
        lines = _tabulate(env_id, grid, found, threshold if asks_for_threshold else None)
    else:
        returns = [episode.episode_return for episode in found[0].episodes]
        lines = [*describe(found[0].summary, threshold), "", *histogram(returns)]
    return "\n".join(lines)


def rounded(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"


def describe(summary: Summary, threshold: float | None) -> list[str]:
    s = summary
    interval = "none of one episode"
    if s.interval:
        interval = f"{rounded(s.interval[0])} to {rounded(s.interval[1])}  ({METHOD})"
    lines = [
        f"  mean return          {rounded(s.mean)}",
        f"  95 % confidence      {interval}",
        f"  median               {rounded(s.median)}",
        f"  standard deviation   {rounded(s.standard_deviation)}",
        f"  least, most          {rounded(s.least)}, {rounded(s.most)}",
        f"  length [steps]       mean {rounded(s.length_mean)}, median "
        f"{rounded(s.length_median, 0)}, {s.length_least} to {s.length_most}",
    ]
    if s.passes is not None:
        lines.append(f"  return >= {threshold:<10g} {s.passes:.1%} of the episodes")
    shares = ", ".join(f"{end} {share:.1%}" for end, share in s.ends.items())
    return [*lines, f"  ends                 {shares}"]


def are_equal(returns: Sequence[float]) -> bool:
    """Returns whether all are equal to nine digits. NumPy raises ValueError for too narrow bins."""
    return math.isclose(min(returns), max(returns), rel_tol=1e-9, abs_tol=1e-9)


def histogram(returns: Sequence[float]) -> list[str]:
    """Returns a histogram of the returns, one bar per line; empty if all are nearly equal."""
    if are_equal(returns):
        return []
    counts, edges = np.histogram(returns, BINS)
    digits = max(1, math.ceil(-math.log10(edges[1] - edges[0])))  # with which the edges differ
    lines = []
    for count, low, high in zip(counts.tolist(), edges, edges[1:]):
        eighths = round(8 * BAR * count / counts.max())
        bar = "█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8].strip()
        lines.append(f"  {low:>9,.{digits}f} to {high:>9,.{digits}f} {count:>6}  {bar}".rstrip())
    return lines


def _tabulate(
    env_id: str, grid: Grid, found: Sequence[WorldResult], threshold: float | None
) -> list[str]:
    """Returns a table with a line per world. `threshold`: of a column with the fraction of returns
    of at least this; None: no such column."""
    has_rows = len(grid.rows) > 1
    names = ["world"] * has_rows + [with_unit(env_id, axis.name) for axis in grid.axes]
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
        left.append([cell.row] * has_rows + [*map(short, cell.values)])
    right = [[*columns, "95 % interval"], *map(list, zip(*columns.values(), differences))]
    table = zip(_aligned(left, str.ljust), _aligned(right, str.rjust))
    lines = [f"  {first}  {second}".rstrip() for first, second in table]
    least, mean = worst_and_mean(found)
    overall = (
        f"worst of the {len(grid.cells)} worlds: {rounded(least.summary.mean)} in "
        f"{grid.text_of(least.cell)}; mean of them: {rounded(mean)}"
    )
    return [*lines, "", overall, NOTES, *filter(None, [grid.note])]


def worst_and_mean(found: Sequence[WorldResult]) -> tuple[Any, float]:
    """Returns the result of the cell with the least mean return, and the mean of all cells."""
    means = [one.summary.mean for one in found[1:]]
    return found[1 + int(np.argmin(means))], float(np.mean(means))


def _aligned(rows: Sequence[Sequence[str]], align: Callable[[str, int], str]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  ".join(map(align, row, widths)) for row in rows]


def _interval(interval: tuple[float, float] | None) -> str:
    return "-" if interval is None else f"{rounded(interval[0])} to {rounded(interval[1])}"


def short(value: float) -> str:
    return f"{value:.12g}"


def with_unit(env_id: str, name: str) -> str:
    units = {one["name"]: one["unit"] for one in _core.world_parameters(env_id)}
    return f"{name} [{units[name]}]" if units[name] else name


def write_json(
    path: Path, head: dict[str, Any], grid: Grid | None, found: Sequence[WorldResult]
) -> None:
    """Writes `head`, the intervals' method, and the result of the only world; or the axes, the
    plain world's result and those of the cells."""
    first, *cells = [_fields(grid, one) for one in found]
    fields: dict[str, Any] = {**head, "interval_method": METHOD}
    if grid:
        axes = {axis.name: axis.values for axis in grid.axes}
        least, mean = worst_and_mean(found)
        least_fields = {"mean": least.summary.mean, "world": least.cell.world}
        fields.update(grid=axes, mean_of_cells=mean, worst_cell=least_fields)
        fields.update(plain=first, cells=cells)
    else:
        fields.update(first)
    replace_file(path, (json.dumps(fields, indent=1) + "\n").encode())


def _fields(grid: Grid | None, one: WorldResult) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    if grid and one.cell:
        if one.cell.row:
            fields["base"] = one.cell.row
        fields["values"] = {axis.name: value for axis, value in zip(grid.axes, one.cell.values)}
        fields["world"] = one.cell.world
        fields["difference"] = one.difference
        fields["difference_interval"] = one.difference_interval
    outcomes = [_outcome(episode) for episode in one.episodes]
    return {**fields, **one.summary._asdict(), "fell": one.fell, "outcomes": outcomes}


def _outcome(episode: PlayedEpisode) -> dict[str, Any]:
    # Not asdict, which would give what a RecordedEpisode has besides.
    outcome = {each.name: getattr(episode, each.name) for each in dataclasses.fields(PlayedEpisode)}
    for name in ("order", "observation_sums", "observation_squares"):
        del outcome[name]
    if not episode.world:
        del outcome["world"]
    outcome["return"] = outcome.pop("episode_return")
    return outcome


def worst(episodes: Sequence[PlayedEpisode], count: int, options: argparse.Namespace) -> str:
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
