"""Statistics over seeds, on samples of known distributions."""

import numpy as np
import pytest
from walker_sim.commands.plots import write_plot
from walker_sim.commands.results import (
    bootstrap_interval,
    describe,
    histogram,
    summarise,
    summarise_worlds,
)
from walker_sim.episode_player import PlayedEpisode


def episodes_of(returns, ends=None):
    ends = ends or ["fell"] * len(returns)
    return [
        PlayedEpisode(i, i, value, 10 + i, True, False, ends[i]) for i, value in enumerate(returns)
    ]


def test_interval_of_a_normal_sample():
    values = np.random.default_rng(1).normal(100, 20, 2000)
    low, high = bootstrap_interval(values)
    error = values.std(ddof=1) / np.sqrt(len(values))
    # 4 standard errors of the 2.5 % quantile of 10,000 draws: 4 sqrt(0.025 0.975 / 1e4) / 0.058
    bound = 0.107 * error
    assert low == pytest.approx(values.mean() - 1.96 * error, abs=bound)
    assert high == pytest.approx(values.mean() + 1.96 * error, abs=bound)


def test_interval_covers_the_mean_in_95_percent():
    """The returns are bimodal, as of a walker that either falls or arrives."""
    random = np.random.default_rng(2)
    hits = 0
    for _ in range(200):
        arrives = random.random(100) < 0.3
        values = np.where(arrives, random.normal(300, 5, 100), random.normal(-80, 30, 100))
        low, high = bootstrap_interval(values)
        hits += low <= 0.3 * 300 + 0.7 * -80 <= high
    assert 0.91 <= hits / 200 <= 0.98


def test_interval_is_deterministic():
    values = np.random.default_rng(3).normal(0, 1, 150_000)  # resampled in several blocks
    assert bootstrap_interval(values[:50]) == bootstrap_interval(values[:50])
    low, high = bootstrap_interval(np.array([7.0, 7.0]))
    assert (low, high) == (7.0, 7.0)


def test_summary():
    returns = [1.0, 2.0, 3.0, 10.0]
    summary = summarise(episodes_of(returns, ["fell", "arrived", "fell", "fell"]), 3.0)
    assert (summary.mean, summary.median) == (4.0, 2.5)
    assert summary.standard_deviation == pytest.approx(np.sqrt(50 / 3))
    assert (summary.least, summary.most, summary.passes) == (1.0, 10.0, 0.5)
    assert list(summary.ends.items()) == [("fell", 0.75), ("arrived", 0.25)]
    assert (summary.length_mean, summary.length_least, summary.length_most) == (11.5, 10, 13)


def test_one_episode_has_no_spread():
    summary = summarise(episodes_of([5.0]), None)
    assert summary.interval is None
    assert summary.standard_deviation is None
    text = "\n".join(describe(summary, None))
    assert "none of one episode" in text
    assert "return >=" not in text
    assert histogram([5.0]) == []


def test_histogram_counts_every_return_once():
    lines = histogram([0.0] * 30 + [12.0] * 15)
    assert len(lines) == 12
    assert lines[0].split() == ["0.0", "to", "1.0", "30", "█" * 40]
    assert lines[-1].split() == ["11.0", "to", "12.0", "15", "█" * 20]
    assert sum(int(line.split()[3]) for line in lines) == 45


@pytest.mark.parametrize("spread", [1e-3, 1e-6, 2e-7])
def test_histogram_of_nearly_equal_returns_has_distinct_bins(spread):
    lines = histogram([-115.0, -115.0 - spread])
    edges = [line.split()[0] for line in lines]
    assert len(set(edges)) == len(edges) == 12
    assert sum(int(line.split()[3]) for line in lines) == 2


@pytest.mark.parametrize("returns", [[-115.0, np.nextafter(-115, 0)], [0.0, 1e-300]])
def test_histogram_of_returns_that_no_bins_divide_is_empty(returns, tmp_path):
    assert histogram(returns) == []
    pytest.importorskip("matplotlib")
    episodes = episodes_of(returns)
    found = summarise_worlds(None, episodes, None)
    write_plot(tmp_path / "plot.png", "nearly equal", "Hopper-v5", None, found, None)
    assert (tmp_path / "plot.png").stat().st_size
