"""Grids of worlds: the values of --grid in each --world."""

from __future__ import annotations

import argparse
import itertools
import math
import re
from collections import Counter
from decimal import ROUND_FLOOR, Decimal
from typing import Any, NamedTuple, Sequence

from walker_sim.commands.options import MAX_SEEDS, InputError
from walker_sim.worlds import World, ends_of, read_world, to_world

MAX_AXES = 3
MAX_VALUES = 1000
NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
# The names of check_steps in src/episode/checked_world.cpp.
ROUNDED = ("action_delay", "observation_delay", "push_interval", "change_interval")
SYNTAX = "must be NAME=FIRST:END:STEP or NAME=VALUE,VALUE,..., e.g. push_impulse=0:40:10"


class Axis(NamedTuple):
    """Values of a world's parameter."""

    name: str
    values: tuple[float, ...]


class Cell(NamedTuple):
    """One world of a grid."""

    row: str  # text of its --world; empty: Gymnasium's
    values: tuple[float, ...]  # one per axis
    world: World


class Grid(NamedTuple):
    """Worlds to compare with Gymnasium's, the plain one."""

    rows: tuple[str, ...]  # texts of --world; without one, an empty text
    axes: tuple[Axis, ...]
    cells: list[Cell]  # by row, then by the first axis's values
    note: str  # about a parameter that was added; or empty

    def worlds(self) -> list[World]:
        """Returns the plain world, then those of the cells."""
        return [{}, *(cell.world for cell in self.cells)]

    def text_of(self, cell: Cell) -> str:
        """Returns the text of a cell's --world and values."""
        given = [f"{axis.name}={value:.12g}" for axis, value in zip(self.axes, cell.values)]
        return ", ".join([*filter(None, [cell.row]), *given])


def axis(text: str) -> Axis:
    """Parses NAME=FIRST:END:STEP, whose END is included, or NAME=VALUE,VALUE,..., for argparse."""
    name, _, given = text.partition("=")
    if re.fullmatch(f"{NUMBER}:{NUMBER}:{NUMBER}", given):
        values = _steps(text, *map(float, given.split(":")))
    elif re.fullmatch(f"{NUMBER}(?:,{NUMBER})*", given):
        values = [float(part) for part in given.split(",")]
    else:
        raise argparse.ArgumentTypeError(f"{text}: {SYNTAX}")
    if len(values) > MAX_VALUES:
        raise argparse.ArgumentTypeError(f"{text}: must be at most {MAX_VALUES} values")
    value, number_of = Counter(values).most_common(1)[0]
    if number_of > 1:
        raise argparse.ArgumentTypeError(f"{text}: must have the value {value:g} once")
    return Axis(name, tuple(values))


def _steps(text: str, *numbers: float) -> list[float]:
    """Returns the values from FIRST to END, computed in decimal so that 0:0.06:0.02 has 0.06
    itself; at most one value more than allowed."""
    if not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"{text}: must have numbers below 1.8e+308")
    first, end, step = (Decimal(repr(one)) for one in numbers)
    if step <= 0 or end < first:
        raise argparse.ArgumentTypeError(
            f"{text}: must ascend from FIRST to END, with STEP above 0"
        )
    steps = min((end - first) / step, Decimal(MAX_VALUES))
    below = steps.to_integral_value(ROUND_FLOOR)
    if below < steps:
        nearest = " or ".join(repr(float(first + (below + one) * step)) for one in (0, 1))
        raise argparse.ArgumentTypeError(
            f"{text}: must have whole steps from FIRST to END; END may be {nearest}"
        )
    return [float(first + index * step) for index in range(int(below) + 1)]


def make_grid(
    env_id: str, rows: Sequence[str], axes: Sequence[Axis], number_of_seeds: int
) -> Grid | None:
    """Makes the grid of --world and --grid; None if they name at most one world. An InputError
    names the option or the world's parameter, its value and what is allowed."""
    if not axes and len(rows) < 2:
        return None
    names = [one.name for one in axes]
    if len(axes) > MAX_AXES:
        raise InputError(f"--grid {names[MAX_AXES]}: must be given at most {MAX_AXES} times")
    if len(set(names)) < len(names):
        raise InputError(f"--grid {names[0]}: given twice")
    if len(set(rows)) < len(rows):
        raise InputError(f"--world {Counter(rows).most_common(1)[0][0]}: given twice")
    try:
        bases = {row: read_world(row) for row in rows} or {"": {}}
    except (ValueError, TypeError) as error:
        raise InputError(str(error)) from error
    num_worlds = 1 + len(bases) * math.prod(len(one.values) for one in axes)
    if number_of_seeds * num_worlds > MAX_SEEDS:
        raise InputError(
            f"{number_of_seeds * num_worlds:,} episodes, {number_of_seeds:,} in each world and in "
            f"Gymnasium's: must be at most {MAX_SEEDS:,}"
        )
    note = _add_pushes(bases, names)
    try:
        cells = [
            Cell(row, values, to_world(env_id, {**base, **dict(zip(names, values))}))
            for row, base in bases.items()
            for values in itertools.product(*(one.values for one in axes))
        ]
    except (ValueError, TypeError) as error:
        raise InputError(str(error)) from error
    return Grid(tuple(bases), tuple(axes), cells, note)


def refuse_equal(grid: Grid, dt: float) -> None:
    """InputError if two worlds are the same after their times are rounded to steps of `dt`."""

    def rounded(name: str, world: World) -> tuple[float, float]:
        low, high = ends_of(world[name])
        if name not in ROUNDED or low < high:  # a drawn time is rounded after the draw
            return low, high
        steps = math.floor(low / dt + 0.5)
        return steps, steps

    seen: dict[frozenset[Any], str] = {}
    for cell in grid.cells:
        text = grid.text_of(cell)
        key = frozenset(
            (name, rounded(name, cell.world), isinstance(given, dict))
            for name, given in cell.world.items()
        )
        if seen.setdefault(key, text) != text:
            raise InputError(
                f"{text}: must be another world than {seen[key]}; delays and intervals are rounded "
                f"to steps of {dt:.12g} s"
            )


def _add_pushes(bases: dict[str, World], names: Sequence[str]) -> str:
    """Adds the interval of the preset `pushed` to worlds in which the axis push_impulse would have
    no effect. Returns a note that says so."""
    missing = [row for row in bases if "push_interval" not in bases[row]]
    if "push_impulse" not in names or "push_interval" in names or not missing:
        return ""
    interval = read_world("pushed")["push_interval"]
    low, high = ends_of(interval)
    for row in missing:
        bases[row] = {**bases[row], "push_interval": interval}
    where = f" ({', '.join(missing)})" if len(missing) < len(bases) else ""
    return f"push_interval is [{low:g}, {high:g}] s, as in pushed{where}"
