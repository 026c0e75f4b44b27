"""Evaluation of policies during training, on seeds that the training never uses, and the learning
curve: one point per evaluation, as CSV and as a plot."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.episode_player import make_player, play_jobs

FIRST_CHOICE_SEED = 2_000_000
"""First seed of the episodes that decide which policy is kept. Those of the model cards in
docs/policies begin at 1000000."""


class Evaluation:
    """Plays episodes of policies, many at once."""

    def __init__(self, env_id: str, parameters: Mapping[str, Any], num_threads: int) -> None:
        # With reuse_world an episode would depend on the ones before it.
        own = {name: value for name, value in parameters.items() if name != "reuse_world"}
        self._player = make_player(env_id, own, num_threads)

    def returns(
        self,
        network: _core.Policy,
        world: Mapping[str, tuple[float, float]],
        first_seed: int,
        episodes: int,
    ) -> NDArray[np.float64]:
        """Returns the return of each episode."""
        jobs = [(0, first_seed + index, 0) for index in range(episodes)]
        played = play_jobs(self._player, [network], [dict(world)], jobs)
        return np.array([episode.episode_return for episode in played])


class Point(NamedTuple):
    """One evaluation, after `steps` steps."""

    steps: int
    seconds: float  # wall time without evaluations [s]
    training_return: float  # mean of the last 100 training episodes, with exploration noise
    evaluation_return: float  # mean over the evaluation's episodes
    deviation: float  # standard deviation of these
    least: float  # minimum of these
    world: str  # in which the policy learns at this time


def write_curve(points: Sequence[Point], path: Path) -> None:
    """Writes the points as CSV, by a temporary file that replaces `path`."""
    unfinished = path.with_name(path.name + ".new")
    with unfinished.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Point._fields)
        for point in points:
            numbers = [f"{value:.6g}" for value in point[1:-1]]
            writer.writerow([point.steps, *numbers, point.world])
    unfinished.replace(path)


def read_curve(path: Path) -> list[Point]:
    with path.open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    points = []
    for steps, *numbers, world in rows:
        seconds, training, mean, deviation, least = map(float, numbers)
        points.append(Point(int(steps), seconds, training, mean, deviation, least, world))
    return points


def draw_curve(points: Sequence[Point], title: str, path: Path) -> None:
    """Plots returns over steps, with the standard deviation over the evaluation's episodes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), dpi=100, layout="constrained")
    axes = figure.subplots()
    steps = [point.steps / 1e6 for point in points]
    means = [point.evaluation_return for point in points]
    low = [point.evaluation_return - point.deviation for point in points]
    high = [point.evaluation_return + point.deviation for point in points]
    axes.fill_between(steps, low, high, alpha=0.2, linewidth=0)
    axes.plot(steps, means, label="evaluation (mean, deviation of episodes)")
    noisy = [point.training_return for point in points]
    axes.plot(steps, noisy, linestyle="--", linewidth=1, label="training, with exploration")
    axes.set(xlabel="steps [million]", ylabel="return", title=title)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(path)
