"""Results of episodes: statistics, histogram, CSV file and plot."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import importlib
import io
import json
import math
from collections import Counter
from pathlib import Path
from typing import Any, Callable, Iterable, NamedTuple, Sequence, TextIO

import numpy as np
from numpy.typing import NDArray

from walker_sim.commands.episodes import Episode
from walker_sim.commands.options import InputError
from walker_sim.files import (
    NOT_REPLACEABLE,
    beside,
    descriptor_of,
    naming,
    replace_figure,
    replace_file,
)

RESAMPLES = 10_000
BINS = 12
BAR = 40  # length of the longest bar [characters]
METHOD = f"percentile bootstrap over seeds, {RESAMPLES:,} resamples"
FIELDS = ("seed", "return", "length", "terminated", "truncated", "end")
# Colours of Okabe and Ito's palette for colour blindness; the marks distinguish them in grey.
ENDS = {
    "arrived": ("#009E73", "o"),
    "time limit": ("#0072B2", "s"),
    "fell": ("#D55E00", "v"),
    "terminated": ("#D55E00", "v"),
    "failed": ("#000000", "x"),
}
MEAN = "#444444"


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
    ends: dict[str, float]  # fraction by Episode.end, the most frequent first
    length_mean: float  # [steps]
    length_median: float
    length_least: int
    length_most: int


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


def summarise(episodes: Sequence[Episode], threshold: float | None) -> Summary:
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


def rounded(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"


def report(summary: Summary, threshold: float | None) -> list[str]:
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


def write_json(
    path: Path, head: dict[str, Any], summary: Summary, episodes: Sequence[Episode]
) -> None:
    """Writes `head`, the summary, the interval's method, and the episodes under ``outcomes``."""
    outcomes = outcomes_of(episodes)
    fields = {**head, **summary._asdict(), "interval_method": METHOD, "outcomes": outcomes}
    replace_file(path, (json.dumps(fields, indent=1) + "\n").encode())


def outcomes_of(episodes: Iterable[Episode]) -> list[dict[str, Any]]:
    """Returns the fields of episodes that the JSON has."""
    outcomes = []
    for episode in episodes:
        outcome = dataclasses.asdict(episode)
        del outcome["order"], outcome["steps"]
        if not episode.world:
            del outcome["world"]
        outcome["return"] = outcome.pop("episode_return")
        outcomes.append(outcome)
    return outcomes


class Table:
    """CSV file that has only whole lines at any time, in the order in which episodes end.

    Parameters
    ----------
    path
        The file. If it exists already, the lines go to the file `written` beside it until `finish`,
        unless its folder is not writable. If it is a pipe or a file descriptor, `finish` writes all
        lines (`is_stream`).
    info_names, world_names
        Columns besides those of every walker: of infos, and of the parameters of the world.
    world_of
        Returns an episode's text for a first column ``world``; None: there is no such column.
    """

    def __init__(
        self,
        path: Path,
        info_names: Sequence[str],
        world_names: Sequence[str] = (),
        world_of: Callable[[Episode], str] | None = None,
    ) -> None:
        self._info_names, self._world_names = info_names, world_names
        self._world_of = world_of
        self._path = self.written = path
        number = descriptor_of(path)
        if number is None and path.is_file():
            path.open("a").close()  # must be writable, which `finish` would find out after hours
            self.written = beside(path)
            try:
                self.written.touch()
            except OSError as error:
                if error.errno not in NOT_REPLACEABLE:
                    raise
                self.written = path
        # Flushes after each line.
        file = self.written if number is None else number
        self._file = open(file, "w", 1, "utf-8", newline="", closefd=number is None)
        self.is_stream = number is not None or not self._file.seekable()
        if self.is_stream:
            return
        try:
            self._write(self._file, [self._head()])
        except OSError:
            if self.written.is_file():
                with contextlib.suppress(OSError):
                    self.written.unlink()
            raise

    def add(self, episode: Episode) -> None:
        if not self.is_stream:
            self._write(self._file, [self._row_of(episode)])

    def finish(self, episodes: Iterable[Episode]) -> None:
        """Replaces the file by one that has the same episodes in this order."""
        rows: list[Sequence[object]] = [self._head(), *map(self._row_of, episodes)]
        if self.is_stream:
            self._write(self._file, rows)
            self._file.close()
            return
        self._file.close()
        text = io.StringIO(newline="")
        self._write(text, rows)
        replace_file(self._path, text.getvalue().encode())
        if self.written != self._path:
            self.written.unlink()

    def _write(self, file: TextIO, rows: Iterable[Sequence[object]]) -> None:
        with naming(self.written):
            csv.writer(file, lineterminator="\n").writerows(rows)

    def _head(self) -> list[str]:
        first = ["world"] if self._world_of else []
        return [*first, *FIELDS, *self._info_names, *self._world_names, "error"]

    def _row_of(self, episode: Episode) -> list[object]:
        """Returns a row; absent info is empty."""
        info = [episode.info.get(name, "") for name in self._info_names]
        world = [episode.world.get(name, "") for name in self._world_names]
        outcome = (episode.terminated, episode.truncated, episode.end)
        row = (episode.seed, episode.episode_return, episode.length, *outcome)
        first = [self._world_of(episode)] if self._world_of else []
        return [*first, *row, *info, *world, episode.error]


def make_figure(**keywords: Any) -> Any:
    """Makes a matplotlib figure without pyplot, i.e. without global state or a display."""
    try:
        return importlib.import_module("matplotlib.figure").Figure(**keywords)
    except ImportError as error:
        raise InputError(f"--plot needs matplotlib: pip install matplotlib ({error})") from error


def check_format(path: Path) -> None:
    """Raises InputError if matplotlib cannot write this file format."""
    formats = sorted(make_figure().canvas.get_supported_filetypes())
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
    replace_figure(path, figure, dpi=150)


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
