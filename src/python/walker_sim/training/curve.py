"""The learning curve: one point per evaluation, as CSV and as a plot."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import NamedTuple, Sequence

from walker_sim.files import replace_figure, replace_file


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
    """Writes the points as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Point._fields)
    for point in points:
        numbers = [f"{value:.6g}" for value in point[1:-1]]
        writer.writerow([point.steps, *numbers, point.world])
    replace_file(path, text.getvalue().encode())


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
    replace_figure(path, figure)
