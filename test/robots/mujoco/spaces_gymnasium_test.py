"""Spaces, time step, limits, infos and parameters of the specification against Gymnasium's."""

import inspect
import math

import gymnasium
import numpy as np
import pytest
from gymnasium_reference import equal_bits
from mujoco_reference import IDS, action_size, own_model

# Gymnasium's parameters for rendering.
PICTURES = {"default_camera_config", "kwargs"}


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize(
    "parameters", [{}, {"exclude_current_positions_from_observation": False}], ids=str
)
def test_spaces_and_limits(rollout, environment_id, parameters):
    environment = gymnasium.make(environment_id, **parameters)
    rollout.make(environment_id, **parameters)
    low, high, action_low, action_high, dt, limit, threshold = rollout.spaces()
    observations, actions = environment.observation_space, environment.action_space
    assert observations.dtype == np.float64
    assert actions.dtype == np.float32
    assert equal_bits(low, observations.low)
    assert equal_bits(high, observations.high)
    assert equal_bits(action_low, actions.low)
    assert equal_bits(action_high, actions.high)
    assert dt == environment.unwrapped.dt
    assert limit == environment.spec.max_episode_steps == 1000
    theirs = environment.spec.reward_threshold
    assert math.isnan(threshold) if theirs is None else threshold == theirs


@pytest.mark.parametrize("environment_id", IDS[1::2])
@pytest.mark.parametrize("frame_skip", [1, 3, 4, 5, 10])
def test_time_step(rollout, environment_id, frame_skip):
    environment = gymnasium.make(environment_id, frame_skip=frame_skip)
    rollout.make(environment_id, frame_skip=frame_skip)
    assert rollout.spaces()[4] == environment.unwrapped.dt


@pytest.mark.parametrize("environment_id", IDS)
def test_infos(rollout, environment_id):
    environment = gymnasium.make(environment_id)
    _, reset_info = environment.reset(seed=0)
    *_, step_info = environment.step(np.zeros(action_size(environment_id), np.float32))
    rollout.make(environment_id)
    names, _ = rollout.description()
    assert names == list(step_info)
    reset_row, (step_row,) = (
        rollout.reset(0),
        rollout.step(np.zeros((1, action_size(environment_id)))),
    )
    given = [n for n, v in zip(names, reset_row[-len(names) :]) if not np.isnan(v)]
    assert given == list(reset_info)
    assert not np.isnan(step_row).any()


@pytest.mark.parametrize("environment_id", IDS)
def test_parameters_and_their_defaults(rollout, environment_id):
    environment = gymnasium.make(environment_id)
    signature = inspect.signature(type(environment.unwrapped).__init__).parameters
    theirs = {name: p.default for name, p in signature.items() if name not in {"self", *PICTURES}}
    theirs["max_episode_steps"] = environment.spec.max_episode_steps
    rollout.make(environment_id)
    _, ours = rollout.description()
    assert list(ours) == list(theirs)
    if "xml_file" in theirs:
        theirs["xml_file"] = own_model(environment_id)  # the same model under a versioned name
    rollout.make(environment_id, **theirs)  # we accept Gymnasium's defaults
    _, completed = rollout.description()
    assert ours == completed
