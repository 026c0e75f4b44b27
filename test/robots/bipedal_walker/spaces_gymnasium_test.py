"""Spaces, time step and limits of the specification against Gymnasium's."""

import gymnasium
import numpy as np
import pytest
from bipedal_walker_reference import IDS
from gymnasium_reference import equal_bits


@pytest.mark.parametrize("environment_id", IDS)
def test_spaces_and_limits(rollout, environment_id):
    environment = gymnasium.make(environment_id)
    rollout.make(environment_id)
    low, high, action_low, action_high, dt, limit, threshold = rollout.spaces()
    observations, actions = environment.observation_space, environment.action_space
    assert observations.dtype == actions.dtype == np.float32
    assert equal_bits(low, observations.low)
    assert equal_bits(high, observations.high)
    assert equal_bits(action_low, actions.low)
    assert equal_bits(action_high, actions.high)
    assert dt == 1 / environment.metadata["render_fps"]
    assert limit == environment.spec.max_episode_steps
    assert threshold == environment.spec.reward_threshold


def test_hardcore_as_a_parameter_keeps_the_limit(rollout):
    environment = gymnasium.make(IDS[0], hardcore=True)
    rollout.make(IDS[0], hardcore=True)
    assert rollout.spaces()[5] == environment.spec.max_episode_steps == 1600
