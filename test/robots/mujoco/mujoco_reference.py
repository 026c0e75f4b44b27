"""Gymnasium's Walker2d and Hopper: their episodes. player.h repeats the actions in C++."""

from __future__ import annotations

import os
import pathlib

# Gymnasium draws where there is no screen; its own choice may end the process there.
os.environ.setdefault("MUJOCO_GL", "egl")

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.mujoco import mujoco_env
from gymnasium_reference import play_episode, rounded

IDS = ("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5")
KINDS = ("random", "saturated", "zero", "outside", "smooth", "balance", "double")
REWARD_TERMS = ("reward_forward", "reward_ctrl", "reward_survive")
V4_INFO_NAMES = ("x_position", "x_velocity")
V5_INFO_NAMES = ("x_position", "z_distance_from_origin", "x_velocity", *REWARD_TERMS)
INFO_NAMES = {
    environment_id: V5_INFO_NAMES if environment_id.endswith("v5") else V4_INFO_NAMES
    for environment_id in IDS
}
# Sets of parameters away from their defaults.
OTHER_PARAMETERS = (
    {"forward_reward_weight": 2.5, "ctrl_cost_weight": 0.3, "healthy_reward": 1.5},
    {"healthy_z_range": (1.2, 1.26), "healthy_angle_range": (-0.1, 0.1)},
    {"healthy_z_range": (1.2, 1.26), "terminate_when_unhealthy": False},
    {"reset_noise_scale": 0.05},
    {"exclude_current_positions_from_observation": False},
)
# Gymnasium's own models, by the environment that they belong to.
MODELS = {
    environment_id: pathlib.Path(mujoco_env.__file__).parent / "assets" / name
    for environment_id, name in zip(
        IDS, ("walker2d.xml", "walker2d_v5.xml", "hopper.xml", "hopper.xml")
    )
}


# How many of 100 episodes must agree closely: Hopper stands on the ground from the first step on,
# where the solver's tolerance shows (episodes_gymnasium_test.py).
NEARLY_ALL = {"Walker2d": 0.98, "Hopper": 0.93}


def robot_of(environment_id):
    """Its id without the version: Walker2d or Hopper."""
    return environment_id.partition("-")[0]


def own_model(environment_id):
    """The name of our built-in model."""
    return environment_id.lower().replace("-", "_") + ".xml"


def action_size(environment_id):
    return {"Walker2d": 6, "Hopper": 3}[robot_of(environment_id)]


class Actions:
    """The actions of one episode: float32 values in float64, but for the kind `double`.

    `smooth` wanders slowly; `balance` holds the legs straight and the feet level, and so keeps
    the walker up for hundreds of steps. Only sums and products: C++ gets the same bits.
    """

    def __init__(self, kind, seed, size):
        assert kind in KINDS
        self._kind, self._size = kind, size
        self._random = np.random.default_rng(seed)
        self._slow = np.zeros(size)

    def draw(self, observation):
        if self._kind == "zero":
            return np.zeros(self._size)
        if self._kind == "saturated":
            return self._random.integers(-1, 2, self._size).astype(np.float64)
        if self._kind == "random":
            return rounded(self._random.uniform(-1, 1, self._size))
        if self._kind == "outside":
            return rounded(self._random.uniform(-3, 3, self._size))
        if self._kind == "double":
            return self._random.uniform(-1, 1, self._size)
        self._slow = 0.95 * self._slow + self._random.uniform(-0.03, 0.03, self._size)
        if self._kind == "smooth":
            return rounded(self._slow)
        # Counted from the end, for x may stand first: tilt, joint angles, joint speeds.
        size = self._size
        first_angle = -2 * size - 3
        tilt, speeds = observation[first_angle - 1], observation[-size:]
        angles = observation[first_angle : first_angle + size]
        off_level = tilt * (np.arange(size) % 3 == 2)  # of the feet
        return rounded(-0.5 * (angles + off_level) - 0.05 * speeds + self._slow)


def play(session):
    """Plays a session in one environment of Gymnasium. Returns a list of Episode.

    Of the margins of two geoms MuJoCo 2.2 takes the larger, and so does 3.2, but 4.0 the sum.
    Hopper's geoms have all the same one, so that half of it is there what all of it is here.
    """
    environment = gymnasium.make(
        session.environment_id, disable_env_checker=True, **session.parameters
    )
    if int(mujoco.__version__.partition(".")[0]) >= 4:
        environment.unwrapped.model.geom_margin[:] /= 2
    info_names = INFO_NAMES[session.environment_id]
    size = action_size(session.environment_id)
    return [
        play_episode(environment, plan, Actions(plan.kind, plan.action_seed, size), info_names)
        for plan in session.plans
    ]


def comparable(environment_id, kind, rows):
    """Rows as they are compared: for the kind `double` with reward and reward_ctrl 0.

    Under float64 actions Gymnasium does not round the control cost to single precision.
    """
    if kind != "double":
        return rows
    info_names = INFO_NAMES[environment_id]
    first_info = rows.shape[1] - len(info_names)
    rows = rows.copy()
    rows[:, first_info - 3] = 0
    if "reward_ctrl" in info_names:
        rows[:, first_info + info_names.index("reward_ctrl")] = 0
    return rows


def draw_episode(environment_id, kind, seed, steps, render_mode="rgb_array", **camera):
    """Yields for each of these steps of an episode (0: the reset, the episode must be as long) the
    actions since the one before, shape (n, action size), and what Gymnasium draws then."""
    environment = gymnasium.make(
        environment_id, render_mode=render_mode, disable_env_checker=True, **camera
    )
    observation, _ = environment.reset(seed=seed)
    size = action_size(environment_id)
    actions = Actions(kind, seed, size)
    played = 0
    for step in steps:
        made = np.zeros((step - played, size))
        for row in made:
            row[:] = actions.draw(observation)
            observation, _, terminated, truncated, _ = environment.step(row.astype(np.float32))
            played += 1
            assert played == step or not (terminated or truncated), (kind, seed, played)
        yield made, environment.render()
    environment.close()
