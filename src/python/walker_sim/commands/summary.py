"""Statistics over episodes."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim.commands.episodes import Episode

RESAMPLES = 10_000
BINS = 12
BAR = 40  # length of the longest bar [characters]
METHOD = f"percentile bootstrap over seeds, {RESAMPLES:,} resamples"


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


def _rounded(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"


def report(summary: Summary, threshold: float | None) -> list[str]:
    s = summary
    interval = "none of one episode"
    if s.interval:
        interval = f"{_rounded(s.interval[0])} to {_rounded(s.interval[1])}  ({METHOD})"
    lines = [
        f"  mean return          {_rounded(s.mean)}",
        f"  95 % confidence      {interval}",
        f"  median               {_rounded(s.median)}",
        f"  standard deviation   {_rounded(s.standard_deviation)}",
        f"  least, most          {_rounded(s.least)}, {_rounded(s.most)}",
        f"  length [steps]       mean {_rounded(s.length_mean)}, median "
        f"{_rounded(s.length_median, 0)}, {s.length_least} to {s.length_most}",
    ]
    if s.passes is not None:
        lines.append(f"  return >= {threshold:<10g} {s.passes:.1%} of the episodes")
    shares = ", ".join(f"{end} {share:.1%}" for end, share in s.ends.items())
    return [*lines, f"  ends                 {shares}"]


def histogram(returns: Sequence[float]) -> list[str]:
    """Returns a histogram of the returns, one bar per line; empty if all are equal."""
    if min(returns) == max(returns):
        return []
    counts, edges = np.histogram(returns, BINS)
    lines = []
    for count, low, high in zip(counts.tolist(), edges, edges[1:]):
        eighths = round(8 * BAR * count / counts.max())
        bar = "█" * (eighths // 8) + " ▏▎▍▌▋▊▉"[eighths % 8].strip()
        lines.append(f"  {low:>9,.1f} to {high:>9,.1f} {count:>6}  {bar}".rstrip())
    return lines


def as_json(summary: Summary) -> dict[str, Any]:
    """Returns all fields and the method of the interval, for a JSON file."""
    return {**summary._asdict(), "interval_method": METHOD}
