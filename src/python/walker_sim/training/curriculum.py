"""Automatic domain randomisation: a world's ranges grow as far as the policy copes with them."""

from __future__ import annotations

import math
from typing import Any, Mapping

import numpy as np

from walker_sim import _core
from walker_sim.worlds import Range, World, ends_of, range_text, world_parameters

ABSENT = {"push_impulse": 0.0}
"""What means Gymnasium's world, where that is not a parameter's default."""


class Curriculum:
    """Ranges that begin at Gymnasium's values and grow towards those of a world.

    The algorithm is that of OpenAI et al. (2019), "Solving Rubik's Cube with a Robot Hand", section
    5: in turn, one end of one range is tried, with this parameter at the end and all others drawn.
    The end moves outwards if the mean return there reaches a threshold, and back if it is below a
    lower one.

    Parameters
    ----------
    env_id, parameters
        Environment and its parameters.
    world
        What the ranges grow to. Numbers apply from the beginning.
    growth
        ``thresholds``: mean returns below which an end moves back, and from which on it moves
        outwards; ``moves``: from Gymnasium's number to the end of the world's range; ``episodes``
        of a trial.

    Raises
    ------
    ValueError
        If the world has no range that could grow.
    """

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        world: Mapping[str, Range],
        growth: Mapping[str, Any],
    ) -> None:
        for name, given in world.items():
            if isinstance(given, dict) or name == "change_interval":
                raise ValueError(
                    f"curriculum: world = {range_text({name: given})}: must have neither log nor "
                    "change_interval; a stage without curriculum can"
                )
        ranges = {name: ends_of(given) for name, given in world.items()}
        walker = _core.Pool(env_id, dict(parameters))

        def is_allowed(name: str, value: float) -> bool:
            try:
                walker.set_world([], [{**world, name: (value, value)}])
            except ValueError:  # for example of a delay of less than half a step
                return False
            return True

        self.episodes: int = growth["episodes"]
        self._lower, self._upper = growth["thresholds"]
        known = {each["name"]: each for each in world_parameters(env_id)}
        self._begin = {
            name: _closest(ABSENT.get(name, known[name]["default"]), low, high)
            for name, (low, high) in ranges.items()
        }
        walker.set_world([], [{name: (begin, begin) for name, begin in self._begin.items()}])
        self._ends: list[tuple[str, int]] = []
        self._values: list[list[float]] = []  # of each end, on its way
        for name, range_ in ranges.items():
            for side in (0, 1):
                begin, end = self._begin[name], range_[side]
                if begin == end:
                    continue
                way = np.linspace(begin, end, growth["moves"] + 1)[1:-1]
                rounded = [*(float(f"{value:.6g}") for value in way), end]
                self._ends.append((name, side))
                self._values.append([begin, *(each for each in rounded if is_allowed(name, each))])
        if not self._ends:
            raise ValueError(
                f"curriculum: world = {range_text(dict(world))} has no range that grows; "
                "must have one, such as friction_scale: [0.5, 1.5]; a stage without one needs "
                "curriculum: null"
            )
        self.moves = [0] * len(self._ends)
        """How often each end has moved outwards, less the moves back."""

    @property
    def world(self) -> World:
        """The present ranges."""
        ranges = {name: [begin, begin] for name, begin in self._begin.items()}
        for (name, side), values, moves in zip(self._ends, self._values, self.moves):
            ranges[name][side] = values[moves]
        return {name: (low, high) for name, (low, high) in ranges.items()}

    @property
    def training_worlds(self) -> list[World]:
        """The worlds of training episodes, in turn: the present ranges, and each range's ends."""
        trials = [self.trial(turn) for turn in range(len(self._ends))]
        return [world for trial in trials for world in (self.world, trial)]

    @property
    def progress(self) -> float:
        """Part of all ways that the ends have gone, from 0 to 1."""
        return sum(self.moves) / sum(len(values) - 1 for values in self._values)

    def trial(self, turn: int) -> World:
        """Returns the present ranges with one parameter at its end."""
        world = self.world
        name, side = self._ends[turn % len(self._ends)]
        end = ends_of(world[name])[side]
        world[name] = (end, end)
        return world

    def take(self, turn: int, mean_return: float) -> None:
        """Moves an end, given the mean return of its trial."""
        index = turn % len(self._ends)
        if mean_return >= self._upper:
            self.moves[index] = min(self.moves[index] + 1, len(self._values[index]) - 1)
        elif mean_return < self._lower:
            self.moves[index] = max(self.moves[index] - 1, 0)


def _closest(default: float, low: float, high: float) -> float:
    """Returns the range's number closest to Gymnasium's, or to zero where Gymnasium has none."""
    return min(max(0.0 if math.isnan(default) else default, low), high)
