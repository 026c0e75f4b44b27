"""Our built-in models against Gymnasium's model files on our engine: every value bit by bit.

Ours list the geom pairs that can collide and have small buffers; neither changes a result.
"""

import numpy as np
import pytest
from gymnasium_reference import equal_bits, first_difference
from mujoco_reference import IDS, MODELS, Actions, action_size, own_model, robot_of

STEPS = 1000


def rows(rollout, robot, xml_file, parameters, seed, actions):
    rollout.make(f"{robot}-v5", xml_file=str(xml_file), **parameters)
    return np.vstack([rollout.reset(seed), rollout.step(actions)])


@pytest.mark.parametrize("model", IDS)
@pytest.mark.parametrize("kind", ["random", "saturated", "zero", "outside", "smooth"])
@pytest.mark.parametrize("noise", [5e-3, 0.3])
def test_results_are_equal(rollout, model, kind, noise):
    """The walker lies and flails on the floor, so every limb touches it."""
    for seed in range(4):
        source = Actions(kind, seed, action_size(model))
        actions = np.array([source.draw(None) for _ in range(STEPS)])
        parameters = {"terminate_when_unhealthy": False, "reset_noise_scale": noise}
        ours = rows(rollout, robot_of(model), own_model(model), parameters, seed, actions)
        theirs = rows(rollout, robot_of(model), MODELS[model], parameters, seed, actions)
        assert len(ours) == STEPS + 1
        assert equal_bits(ours, theirs), (seed, first_difference(ours, theirs))
