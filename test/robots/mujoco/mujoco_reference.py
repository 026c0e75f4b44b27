"""Episodes of Gymnasium's Walker2d and Hopper. player.h has the same actions in C++."""

from __future__ import annotations

import os
import pathlib

# Renders without a display; Gymnasium's default may end the process in that case.
os.environ.setdefault("MUJOCO_GL", "egl")

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.mujoco import mujoco_env
from gymnasium_reference import OPEN_LOOP, play_episode, rounded

IDS = ("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5")
KINDS = ("random", "saturated", "zero", "outside", "smooth", "balance", "double")
REWARD_TERMS = ("reward_forward", "reward_ctrl", "reward_survive")
V4_INFO_NAMES = ("x_position", "x_velocity")
V5_INFO_NAMES = ("x_position", "z_distance_from_origin", "x_velocity", *REWARD_TERMS)
INFO_NAMES = {
    environment_id: V5_INFO_NAMES if environment_id.endswith("v5") else V4_INFO_NAMES
    for environment_id in IDS
}
OTHER_PARAMETERS = (
    {"forward_reward_weight": 2.5, "ctrl_cost_weight": 0.3, "healthy_reward": 1.5},
    {"healthy_z_range": (1.2, 1.26), "healthy_angle_range": (-0.1, 0.1)},
    {"healthy_z_range": (1.2, 1.26), "terminate_when_unhealthy": False},
    {"reset_noise_scale": 0.05},
    {"exclude_current_positions_from_observation": False},
)
MODELS = {
    environment_id: pathlib.Path(mujoco_env.__file__).parent / "assets" / name
    for environment_id, name in zip(
        IDS, ("walker2d.xml", "walker2d_v5.xml", "hopper.xml", "hopper.xml")
    )
}


# Fraction of episodes that must agree closely. Hopper stands on the ground from the first step on,
# where the solver's tolerance has an effect (episodes_gymnasium_test.py).
NEARLY_ALL = {"Walker2d": 0.98, "Hopper": 0.93}


def robot_of(environment_id):
    return environment_id.partition("-")[0]


def own_model(environment_id):
    return environment_id.lower().replace("-", "_") + ".xml"


def action_size(environment_id):
    return {"Walker2d": 6, "Hopper": 3}[robot_of(environment_id)]


class Actions:
    """Actions of one episode: float32 values in float64, except for the kind `double`.

    `smooth` varies slowly; `balance` holds the legs straight and the feet level, which keeps the
    walker upright for hundreds of steps. Only sums and products, so that C++ gets the same bits.
    """

    def __init__(self, kind, seed, size):
        assert kind in KINDS
        self._kind, self._size = kind, size
        self._random = np.random.default_rng(seed)
        self._slow = np.zeros(size)

    def draw(self, observation):
        if self._kind in OPEN_LOOP:
            return OPEN_LOOP[self._kind](self._random, self._size)
        self._slow = 0.95 * self._slow + self._random.uniform(-0.03, 0.03, self._size)
        if self._kind == "smooth":
            return rounded(self._slow)
        # Indexed from the end, because x may come first: tilt, joint angles, joint speeds.
        size = self._size
        first_angle = -2 * size - 3
        tilt, speeds = observation[first_angle - 1], observation[-size:]
        angles = observation[first_angle : first_angle + size]
        off_level = tilt * (np.arange(size) % 3 == 2)  # only for the feet
        return rounded(-0.5 * (angles + off_level) - 0.05 * speeds + self._slow)


def make_theirs(environment_id, parameters):
    """Makes Gymnasium's environment.

    For a pair of geoms, MuJoCo 2.2 and 3.2 use the larger margin, MuJoCo 4.0 the sum. Hopper's
    geoms all have the same margin, so half of it in 4.0 equals the whole margin here.
    """
    environment = gymnasium.make(environment_id, disable_env_checker=True, **parameters)
    if int(mujoco.__version__.partition(".")[0]) >= 4:
        environment.unwrapped.model.geom_margin[:] /= 2
    return environment


def play(session, change=lambda model: None):
    """Plays a session in one Gymnasium environment and returns a list of Episode. `change` is
    called with its model."""
    environment = make_theirs(session.environment_id, session.parameters)
    change(environment.unwrapped.model)
    info_names = INFO_NAMES[session.environment_id]
    size = action_size(session.environment_id)
    return [
        play_episode(environment, plan, Actions(plan.kind, plan.action_seed, size), info_names)
        for plan in session.plans
    ]


def comparable(environment_id, kind, rows):
    """Sets reward and reward_ctrl to 0 for the kind `double`.

    With float64 actions, Gymnasium does not round the control cost to single precision.
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
    """Yields for each of `steps` the actions since the previous one, shape (n, action size), and
    Gymnasium's image. Step 0 is the reset. The episode must not end before the last step."""
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
