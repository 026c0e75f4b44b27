"""Writes the recordings of NumPy and Gymnasium in this folder, for tests that need neither.

    PYTHONPATH=test:test/robots/bipedal_walker python test/recordings/record_bipedal_walker.py

Needs gymnasium[box2d] 1.4.0 with box2d 2.3.10 and NumPy 2. `bits` are the IEEE 754 bits in
hexadecimal. record_mujoco.py writes the recordings of the other robots.
"""

from __future__ import annotations

import functools

import numpy as np
import recording_file
from bipedal_walker_reference import (
    IDS,
    KINDS,
    OBSERVATION_SIZE,
    play,
    terrain,
    without_reward,
)
from gymnasium_reference import Plan, Session, hashes
from recording_file import LARGE_SEEDS, double_bits, float_bits, hash_lines, headline

write = functools.partial(
    recording_file.write,
    script="record_bipedal_walker.py",
    packages=("gymnasium", "box2d", "numpy"),
)

# Ranges of `integers`: the terrain's, ranges with frequent rejections (Lemire's method rejects 25 %
# and nearly 50 % of the draws), and extreme ranges.
RANGES = (
    *((3, 5), (1, 3), (4, 5), (5, 10), (1, 4)),
    *((0, 3 * 2**30), (-7, 2**31), (0, 2**31 + 1)),
    *((0, 2**32 - 1), (-1, 0), (-(2**62), -(2**62) + 17)),
)


def state_words(generator):
    """Returns PCG64's state high, low, increment high, low, has_uint32, uinteger."""
    state = generator.bit_generator.state
    words = [divmod(state["state"][name], 2**64) for name in ("state", "inc")]
    return [*words[0], *words[1], state["has_uint32"], state["uinteger"]]


def random_lines():
    for seed in (0, 1, 2, 42, *LARGE_SEEDS):
        yield f"seed {seed}"
        generator = np.random.default_rng(seed)
        yield " ".join(["state", *map(str, state_words(generator))])
        choice = np.random.default_rng(1000)  # draws the same sequence of kinds for each seed
        for _ in range(120):
            kind = choice.integers(4)
            if kind == 0:
                yield f"random {double_bits(generator.random())}"
            elif kind == 1:
                low, high = ((-1, 1), (-5, 5), (0, 200), (-3.7, 1e-3))[choice.integers(4)]
                yield f"uniform {low} {high} {double_bits(generator.uniform(low, high))}"
            else:
                low, high = RANGES[choice.integers(len(RANGES))]
                yield f"integers {low} {high} {generator.integers(low, high)}"
        yield " ".join(["state", *map(str, state_words(generator))])


def terrain_lines():
    for hardcore in (False, True):
        for seed in (*range(1000), *LARGE_SEEDS):
            yield f"{int(hardcore)} {seed} {hashes(terrain(hardcore, seed)[np.newaxis])[0]:016x}"


def sessions():
    """Yields all kinds of actions in new environments, then several resets with a reused world."""
    for environment_id in IDS:
        for kind in KINDS:
            for seed in range(15):
                yield Session(environment_id, {}, [Plan(kind, seed, seed)])
        for first in range(6):
            seed = 100 + first
            plans = [Plan("heuristic", seed, 0)]
            plans += [Plan(kind, None, seed + i) for i, kind in enumerate(KINDS)]
            plans += [Plan("heuristic", seed, 0)]  # repeats the first plan in a used world
            yield Session(environment_id, {"reuse_world": True}, plans)
        plans = [Plan("noisy", 7, 7), Plan("heuristic", None, 0), Plan("random", None, 8)]
        yield Session(environment_id, {}, plans)


def episode_lines():
    for session in sessions():
        yield f"session {session.environment_id} {int('reuse_world' in session.parameters)}"
        for plan, episode in zip(session.plans, play(session)):
            rows = without_reward(episode.rows) if plan.kind == "double" else episode.rows
            yield headline(plan, episode)
            yield from hash_lines(rows)


def full_episode_lines():
    for environment_id, kind, seed in (
        (IDS[0], "heuristic", 0),
        (IDS[0], "heuristic", 3),
        (IDS[0], "zero", 0),
        (IDS[0], "outside", 1),
        (IDS[1], "heuristic", 4),
        (IDS[1], "random", 1),
    ):
        plan = Plan(kind, seed, seed)
        (episode,) = play(Session(environment_id, {}, [plan]))
        yield f"session {environment_id} 0"
        yield headline(plan, episode)
        for action, row in zip([np.zeros(4), *episode.actions], episode.rows):
            numbers = [*action, *row[: OBSERVATION_SIZE + 1]]
            flags = [str(int(flag)) for flag in row[OBSERVATION_SIZE + 1 :]]
            yield " ".join([*map(float_bits, numbers), *flags])


if __name__ == "__main__":
    write(
        "random.txt",
        "Draws of numpy.random.default_rng: the draw, its arguments, its value"
        " (bits; integers in decimal).",
        random_lines(),
    )
    write(
        "terrains.txt",
        "hardcore, seed, hash of bipedal_walker_reference.terrain: all doubles that a reset draws.",
        terrain_lines(),
    )
    write(
        "episodes.txt",
        "session ID REUSE_WORLD; episode KIND SEED ACTION_SEED STEPS, then for the reset and each"
        " step the hash of\n# observation, reward (0 for the kind double), terminated, truncated:"
        " gymnasium_reference.hashes, low 32 bits.",
        episode_lines(),
    )
    write(
        "full_episodes.txt",
        "As episodes.txt, but for the reset and each step: action (4 bits), observation (24 bits),"
        " reward (bits),\n# terminated, truncated. Single precision holds them all.",
        full_episode_lines(),
    )
