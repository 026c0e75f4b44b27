"""What Gymnasium does in an episode, as rows of doubles to be compared with ours, and their hashes.

Used by the live comparisons and by the scripts in test/recordings. An episode's actions follow from
its kind and seed (and, for some kinds, from the observations), so that C++ repeats an episode
without its actions being recorded. What one walker needs beyond this stands in its own folder:
test/NAME/NAME_reference.py, with test/NAME/player.h as its twin in C++.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Plan(NamedTuple):
    """One episode before it is played."""

    kind: str  # of the actions
    seed: int | None  # of the reset; None continues the generator
    action_seed: int


class Session(NamedTuple):
    """Episodes played one after the other in one environment."""

    environment_id: str
    parameters: dict  # by our names
    plans: list


class Episode(NamedTuple):
    """What was played: actions, shape (n, action size), and rows as rollout_tool gives them.

    Row 0, of n + 1, holds the reset's observation, reward 0, flags 0 and info.
    """

    actions: np.ndarray
    rows: np.ndarray


def rounded(values):
    """The nearest single precision numbers, in double precision."""
    return values.astype(np.float32).astype(np.float64)


def row_of(observation, reward, terminated, truncated, info, info_names):
    """One row: observation, reward, terminated, truncated, info; NaN where info is absent."""
    infos = [info.get(name, np.nan) for name in info_names]
    return [*observation, reward, terminated, truncated, *infos]


def play_episode(environment, plan, actions, info_names=()):
    """Resets a Gymnasium environment and plays to the episode's end. Returns an Episode.

    Actions are float32 but for the kind `double`; `actions.draw(observation)` gives their values.
    """
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
    """FNV-1a, 64 bits, of each row of doubles. Shape (n, m) -> (n,)."""
    raw = np.ascontiguousarray(rows, np.float64).view(np.uint8)
    result = np.full(len(raw), 0xCBF29CE484222325, np.uint64)
    for column in raw.T:
        result = (result ^ column) * np.uint64(0x100000001B3)
    return result


def equal_bits(ours, theirs):
    """Whether two arrays of doubles have the same shape and bits (0 and -0 differ)."""
    ours = np.ascontiguousarray(ours, np.float64)
    theirs = np.ascontiguousarray(theirs, np.float64)
    return ours.shape == theirs.shape and (ours.view(np.uint64) == theirs.view(np.uint64)).all()


def first_difference(ours, theirs):
    """The first step at which rows differ, for a failure's message."""
    if ours.shape != theirs.shape:
        return f"{len(ours) - 1} steps instead of {len(theirs) - 1}"
    differing = np.ascontiguousarray(ours).view(np.uint64) != theirs.view(np.uint64)
    step = np.argmax(differing.any(axis=1))
    return f"step {step}: {ours[step]} instead of {theirs[step]}"
