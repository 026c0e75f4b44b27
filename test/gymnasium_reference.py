"""What Gymnasium does: terrains, episodes and their hashes, to be compared with ours.

Used by the live comparisons and by test/recordings/record.py. An episode's actions follow from its
kind and seed (and, for the heuristic kinds, from the observations), so that C++ repeats an episode
without its actions being recorded: test/bipedal_walker/player.h does the same.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

import gymnasium
import numpy as np
from gymnasium.envs.box2d import bipedal_walker
from rollout_tool import OBSERVATION_SIZE, ROW_SIZE

IDS = ("BipedalWalker-v3", "BipedalWalkerHardcore-v3")
KINDS = ("random", "heuristic", "noisy", "zero", "saturated", "outside", "double")


class Plan(NamedTuple):
    """One episode before it is played."""

    kind: str  # one of KINDS
    seed: int | None  # of the reset; None continues the generator
    action_seed: int


class Session(NamedTuple):
    """Episodes played one after the other in one environment."""

    environment_id: str
    reuse_world: bool
    plans: list


class Episode(NamedTuple):
    """What was played: actions, shape (n, 4), and rows as rollout_tool gives them.

    Row 0, of n + 1, holds the reset's observation, reward 0 and flags 0.
    """

    actions: np.ndarray
    rows: np.ndarray


class Actions:
    """The actions of one episode: float32 values in float64, but for the kind `double`."""

    def __init__(self, kind, seed):
        self._kind = kind
        self._random = np.random.default_rng(seed)
        self._heuristic = bipedal_walker.BipedalWalkerHeuristics()

    def draw(self, observation):
        if self._kind == "zero":
            return np.zeros(4)
        if self._kind == "saturated":
            return self._random.integers(-1, 2, 4).astype(np.float64)
        if self._kind == "random":
            return _rounded(self._random.uniform(-1, 1, 4))
        if self._kind == "outside":
            return _rounded(self._random.uniform(-3, 3, 4))
        if self._kind == "double":
            return self._random.uniform(-1, 1, 4)
        action = self._heuristic.step_heuristic(observation).copy()  # it writes into it later
        if self._kind == "noisy":
            return _rounded(action + self._random.uniform(-0.5, 0.5, 4))
        assert self._kind == "heuristic"
        assert (_rounded(action) == action).all()
        return action


def _rounded(values):
    return values.astype(np.float32).astype(np.float64)


def play(session):
    """Plays a session in Gymnasium. Without `reuse_world` each episode gets a new environment
    that takes over the generator of the one before. Returns a list of Episode."""
    environment = None
    episodes = []
    for plan in session.plans:
        if environment is None or not session.reuse_world:
            generator = environment and environment.unwrapped.np_random
            environment = gymnasium.make(session.environment_id, disable_env_checker=True)
            if generator is not None:
                environment.unwrapped.np_random = generator
        episodes.append(_play_episode(environment, plan))
    return episodes


def _play_episode(environment, plan):
    actions = Actions(plan.kind, plan.action_seed)
    action_type = np.float64 if plan.kind == "double" else np.float32
    observation, _ = environment.reset(seed=plan.seed)
    assert observation.dtype == np.float32
    taken, rows = [], [[*observation, 0, 0, 0]]
    ended = False
    while not ended:
        taken.append(actions.draw(observation))
        observation, reward, terminated, truncated, _ = environment.step(
            taken[-1].astype(action_type)
        )
        rows.append([*observation, reward, terminated, truncated])
        ended = terminated or truncated
    return Episode(np.array(taken), np.array(rows, np.float64))


def without_reward(rows):
    """Rows with rewards 0: under float64 actions Gymnasium's rewards round elsewhere."""
    rows = rows.copy()
    rows[:, OBSERVATION_SIZE] = 0
    assert rows.shape[1] == ROW_SIZE
    return rows


def terrain(hardcore, seed):
    """The doubles that a new environment draws at its reset: 200 ground points, the number of
    obstacles, 4 points of each, 10 clouds of 5 points, the push on the hull.

    Gymnasium's own functions draw them; its world is replaced by a listener, for the engine would
    round the obstacles to single precision.
    """
    environment = bipedal_walker.BipedalWalker(hardcore=hardcore)
    environment.np_random = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))
    obstacles = []

    def create_static_body(fixtures):
        if fixtures is environment.fd_polygon:
            obstacles.append(fixtures.shape.vertices)
        return SimpleNamespace()

    environment.world = SimpleNamespace(CreateStaticBody=create_static_body)
    environment.fd_polygon = SimpleNamespace(shape=SimpleNamespace())
    environment.fd_edge = SimpleNamespace(shape=SimpleNamespace())
    environment._generate_terrain(hardcore)
    environment._generate_clouds()
    push = environment.np_random.uniform(
        -bipedal_walker.INITIAL_RANDOM, bipedal_walker.INITIAL_RANDOM
    )
    ground = np.column_stack([environment.terrain_x, environment.terrain_y])
    clouds = np.array([polygon for polygon, _, _ in environment.cloud_poly])
    return np.concatenate(
        [ground.ravel(), [len(obstacles)], np.ravel(obstacles), clouds.ravel(), [push]]
    )


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
