"""A mixture of worlds: each with its share of a training."""

from __future__ import annotations

from typing import NamedTuple, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.worlds import World


class Part(NamedTuple):
    """One world of a mixture."""

    name: str  # in evaluations: given, a preset's, or the world's text
    world: World
    weight: int  # share of the training, relative to the other worlds'; 0: evaluations only


def in_turn(mixture: Sequence[Part]) -> list[World]:
    """Returns a weighted round-robin: each world in proportion to its weight, evenly spread."""
    divisor = int(np.gcd.reduce([part.weight for part in mixture]))
    weights = [part.weight // divisor for part in mixture]
    total = sum(weights)
    lags, worlds = [0] * len(mixture), []
    for _ in range(total):
        lags = [lag + weight for lag, weight in zip(lags, weights)]
        turn = lags.index(max(lags))
        lags[turn] -= total
        worlds.append(mixture[turn].world)
    return worlds


def text_of(mixture: Sequence[Part]) -> str:
    """Returns the worlds and their weights as a text; of a single world, the world's own."""
    texts = [_core.world_text(part.world) for part in mixture]
    if len(mixture) == 1:
        return texts[0]
    return ", ".join(
        f"{part.weight} {text if part.name == text else f'{part.name} {text}'}"
        for part, text in zip(mixture, texts)
    )
