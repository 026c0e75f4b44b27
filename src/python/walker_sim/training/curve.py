"""The learning curve: one point per evaluation, as CSV and as a plot."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Mapping, NamedTuple, Sequence

from walker_sim.files import replace_figure, replace_file


class Point(NamedTuple):
    """One evaluation, after `steps` steps."""

    steps: int
    seconds: float  # wall time without evaluations [s]
    training_return: float  # mean of the last 100 training episodes, with exploration noise
    evaluation_return: float  # mean over the evaluation's episodes, as many in each world
    deviation: float  # standard deviation of these
    least: float  # minimum of these
    world: str  # in which the policy learns at this time
    means: Mapping[str, float]  # mean return in each of several worlds by name; of one: empty


COLUMNS = Point._fields[:-1]


def write_curve(points: Sequence[Point], path: Path) -> None:
    """Writes the points as CSV. The columns of the worlds' means are the last ones."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    names = list(points[-1].means) if points else []
    writer.writerow([*COLUMNS, *names])
    for point in points:
        steps, *numbers, world, means = point
        own = [means.get(name, math.nan) for name in names]  # absent: of other settings
        writer.writerow([steps, *map(_short, numbers), world, *map(_short, own)])
    replace_file(path, text.getvalue().encode())


def read_curve(path: Path) -> list[Point]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    names, points = header[len(COLUMNS) :], []
    for row in rows:
        steps, (*numbers, world), means = row[0], row[1 : len(COLUMNS)], row[len(COLUMNS) :]
        seconds, training, mean, deviation, least = map(float, numbers)
        by_name = dict(zip(names, map(float, means)))
        points.append(Point(int(steps), seconds, training, mean, deviation, least, world, by_name))
    return points


def _short(value: float) -> str:
    return f"{value:.6g}"


def draw_curve(points: Sequence[Point], title: str, path: Path) -> None:
    """Plots returns over steps, with the standard deviation over the evaluation's episodes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), dpi=100, layout="constrained")
    axes = figure.subplots()
    steps = [point.steps / 1e6 for point in points]
    returns = [point.evaluation_return for point in points]
    low = [point.evaluation_return - point.deviation for point in points]
    high = [point.evaluation_return + point.deviation for point in points]
    axes.fill_between(steps, low, high, alpha=0.2, linewidth=0)
    axes.plot(steps, returns, label="evaluation (mean, deviation of episodes)")
    noisy = [point.training_return for point in points]
    axes.plot(steps, noisy, linestyle="--", linewidth=1, label="training, with exploration")
    for name in points[-1].means if points else ():
        means = [point.means.get(name, math.nan) for point in points]
        axes.plot(steps, means, linewidth=1, label=name[:40])
    axes.set(xlabel="steps [million]", ylabel="return", title=title)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", fontsize="small")
    replace_figure(path, figure)
