"""Plays Gymnasium's episodes and returns them as rows of doubles and their hashes.

The live comparisons and the scripts in test/recordings use this. The actions are a function of kind
and seed (and, for some kinds, of the observations), so that C++ replays an episode without recorded
actions. Code for one robot is in test/robots/NAME/NAME_reference.py, and in player.h for C++.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Plan(NamedTuple):
    kind: str  # of the actions
    seed: int | None  # of the reset; None continues the generator
    action_seed: int


class Session(NamedTuple):
    """Consecutive episodes in one environment."""

    environment_id: str
    parameters: dict  # with this package's names
    plans: list


class Episode(NamedTuple):
    """A played episode: actions, shape (n, action size), and n + 1 rows as from row_of.

    Row 0 holds the reset's observation, reward 0, flags 0 and info.
    """

    actions: np.ndarray
    rows: np.ndarray


def rounded(values):
    """Rounds to single precision."""
    return values.astype(np.float32).astype(np.float64)


# Actions that do not depend on observations, by their kind.
OPEN_LOOP = {
    "zero": lambda random, size: np.zeros(size),
    "saturated": lambda random, size: random.integers(-1, 2, size).astype(np.float64),
    "random": lambda random, size: rounded(random.uniform(-1, 1, size)),
    "outside": lambda random, size: rounded(random.uniform(-3, 3, size)),
    "double": lambda random, size: random.uniform(-1, 1, size),
}


def row_of(observation, reward, terminated, truncated, info, info_names):
    """Returns observation, reward, terminated, truncated, info as a row; absent infos are NaN."""
    infos = [info.get(name, np.nan) for name in info_names]
    return [*observation, reward, terminated, truncated, *infos]


def play_episode(environment, plan, actions, info_names=()):
    """Plays an episode of a Gymnasium environment. `actions.draw(observation)` returns the actions,
    which are cast to float32 except for the kind `double`."""
    action_type = np.float64 if plan.kind == "double" else np.float32
    observation, info = environment.reset(seed=plan.seed)
    taken, rows = [], [row_of(observation, 0, 0, 0, info, info_names)]
    ended = False
    while not ended:
        taken.append(actions.draw(observation))
        observation, *outcome, info = environment.step(taken[-1].astype(action_type))
        rows.append(row_of(observation, *outcome, info, info_names))
        ended = outcome[1] or outcome[2]
    return Episode(np.array(taken), np.array(rows, np.float64))


def hashes(rows):
    """Returns the 64-bit FNV-1a hash of each row of doubles. Shape (n, m) -> (n,)."""
    raw = np.ascontiguousarray(rows, np.float64).view(np.uint8)
    result = np.full(len(raw), 0xCBF29CE484222325, np.uint64)
    for column in raw.T:
        result = (result ^ column) * np.uint64(0x100000001B3)
    return result


def equal_bits(ours, theirs):
    """Returns whether two arrays of doubles have the same shape and bits (0 and -0 differ)."""
    ours = np.ascontiguousarray(ours, np.float64)
    theirs = np.ascontiguousarray(theirs, np.float64)
    return ours.shape == theirs.shape and (ours.view(np.uint64) == theirs.view(np.uint64)).all()


def first_difference(ours, theirs):
    if ours.shape != theirs.shape:
        return f"{len(ours) - 1} steps instead of {len(theirs) - 1}"
    differing = np.ascontiguousarray(ours).view(np.uint64) != theirs.view(np.uint64)
    step = np.argmax(differing.any(axis=1))
    return f"step {step}: {ours[step]} instead of {theirs[step]}"
