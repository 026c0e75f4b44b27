"""Terrains and episodes of Gymnasium's BipedalWalker. player.h has the same actions in C++."""

from __future__ import annotations

from types import SimpleNamespace

import gymnasium
import numpy as np
from gymnasium.envs.box2d import bipedal_walker
from gymnasium_reference import OPEN_LOOP, play_episode, rounded

IDS = ("BipedalWalker-v3", "BipedalWalkerHardcore-v3")
KINDS = ("random", "heuristic", "noisy", "zero", "saturated", "outside", "double")
OBSERVATION_SIZE = 24


class Actions:
    """Actions of one episode: float32 values in float64, except for the kind `double`."""

    def __init__(self, kind, seed):
        self._kind = kind
        self._random = np.random.default_rng(seed)
        self._heuristic = bipedal_walker.BipedalWalkerHeuristics()

    def draw(self, observation):
        assert observation.dtype == np.float32
        if self._kind in OPEN_LOOP:
            return OPEN_LOOP[self._kind](self._random, 4)
        action = self._heuristic.step_heuristic(observation).copy()  # it reuses its array
        if self._kind == "noisy":
            return rounded(action + self._random.uniform(-0.5, 0.5, 4))
        assert self._kind == "heuristic"
        assert (rounded(action) == action).all()
        return action


def play(session):
    """Plays a session in Gymnasium and returns a list of Episode. Without `reuse_world`, each
    episode gets a new environment, which continues the previous one's random generator."""
    environment = None
    episodes = []
    for plan in session.plans:
        if environment is None or not session.parameters.get("reuse_world"):
            generator = environment and environment.unwrapped.np_random
            environment = gymnasium.make(session.environment_id, disable_env_checker=True)
            if generator is not None:
                environment.unwrapped.np_random = generator
        episodes.append(play_episode(environment, plan, Actions(plan.kind, plan.action_seed)))
    return episodes


def draw_episode(environment_id, kind, seed):
    """Plays an episode in Gymnasium and renders every state, because the lidar ray that `render`
    draws depends on the number of its calls.

    Yields for the reset and each step: the preceding action (None for the reset) and the image,
    shape (400, 600, 3).
    """
    environment = gymnasium.make(environment_id, render_mode="rgb_array", disable_env_checker=True)
    actions = Actions(kind, seed)
    observation, _ = environment.reset(seed=seed)
    action, ended = None, False
    while True:
        yield action, environment.render()
        if ended:
            break
        action = actions.draw(observation)
        observation, _, terminated, truncated, _ = environment.step(action.astype(np.float32))
        ended = terminated or truncated
    environment.close()


def without_reward(rows):
    """Sets the rewards to 0: with float64 actions, Gymnasium rounds rewards differently."""
    rows = rows.copy()
    rows[:, OBSERVATION_SIZE] = 0
    assert rows.shape[1] == OBSERVATION_SIZE + 3
    return rows


def terrain(hardcore, seed):
    """Returns the doubles that a new environment draws in a reset: 200 ground points, the number
    of obstacles, 4 points of each, 10 clouds of 5 points, the push on the hull.

    Gymnasium's functions draw them. A stub that records the obstacles replaces the Box2D world,
    which would round them to single precision.
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
