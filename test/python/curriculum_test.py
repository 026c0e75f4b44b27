"""Ranges of a world that grow during a training, and trainings that start from a policy."""

import json
import math

import numpy as np
import pytest
from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.training.curriculum import Curriculum
from walker_sim.training.curve import read_curve
from walker_sim.training.es import Evolution
from walker_sim.training.policy_file import read_policy
from walker_sim.training.run import Training
from walker_sim.training.settings import settings_from

ID = "Hopper-v5"
WORLD = {
    "friction_scale": (0.5, 1.5),  # Gymnasium's 1 is between
    "gravity": (-12.0, -11.0),  # -9.81 is not
    "action_delay": (0.0, 0.016),  # Gymnasium has none
    "motor_strength": (0.9, 0.9),
}
GROWTH = {"thresholds": (10.0, 20.0), "moves": 4, "episodes": 3}
SMALL = {
    "steps": 5000,
    "start": "shipped",
    "layers": None,
    "parameters": {"max_episode_steps": 50},
    "world": WORLD,
    "curriculum": {**GROWTH, "thresholds": [-math.inf, -math.inf]},
    "evaluate_every": 1000,
    "evaluation_episodes": 2,
}
ES = {**SMALL, "algorithm": "es", "population": 4}
PPO = {**SMALL, "num_envs": 8, "rollout": 32, "batch_size": 64, "epochs": 1}


def test_ranges_begin_next_to_gymnasium_s_values():
    assert Curriculum(ID, {}, WORLD, GROWTH).world == {
        "friction_scale": (1.0, 1.0),
        "gravity": (-11.0, -11.0),
        "action_delay": (0.0, 0.0),
        "motor_strength": (0.9, 0.9),
    }
    pushed = {"push_interval": (1.0, 3.0), "push_impulse": (0.0, 9.0)}
    assert Curriculum(ID, {}, pushed, GROWTH).world["push_impulse"] == (0.0, 0.0)


def test_one_end_after_another_moves_by_its_return():
    curriculum = Curriculum(ID, {}, WORLD, GROWTH)
    assert curriculum.trial(0) == curriculum.world
    for turn, mean_return in ((0, 20.0), (4, 19.9), (8, 30.0), (12, 10.0), (16, 9.9)):
        curriculum.take(turn, mean_return)
    assert curriculum.world["friction_scale"] == (0.875, 1.0)
    assert curriculum.trial(4)["friction_scale"] == (0.875, 0.875)
    assert curriculum.trial(5)["friction_scale"] == (1.0, 1.0)
    assert curriculum.training_worlds[2:4] == [curriculum.world, curriculum.trial(1)]
    assert len(curriculum.training_worlds) == 8
    for _ in range(9):
        curriculum.take(1, 20.0)
    assert curriculum.world["friction_scale"] == (0.875, 1.5)
    for _ in range(9):
        curriculum.take(0, 0.0)
    assert curriculum.world["friction_scale"] == (1.0, 1.5)
    assert curriculum.progress == pytest.approx(4 / 16)


def test_the_whole_world_is_reached():
    """A delay of less than half a step is left out."""
    curriculum = Curriculum(ID, {}, WORLD, GROWTH)
    delays = set()
    for turn in range(4 * 4):
        curriculum.take(turn, 20.0)
        delays.add(curriculum.world["action_delay"][1])
    assert curriculum.world == WORLD
    assert curriculum.progress == 1
    assert delays == {0.0, 0.004, 0.008, 0.012, 0.016}
    short = Curriculum(ID, {"frame_skip": 8}, WORLD, GROWTH)  # a step takes 16 ms
    short.take(3, 20.0)
    assert short.world["action_delay"] == (0.0, 0.008)


@pytest.mark.parametrize(("kind", "given"), [(Evolution, ES), (Training, PPO)], ids=["es", "ppo"])
def test_training_s_ranges_grow_and_are_resumed(tmp_path, kind, given):
    settings = settings_from(given)
    training = kind(ID, settings, tmp_path, num_threads=1)

    def stop(training, point):
        training.wants_to_stop = training.steps >= 1000

    training.report = stop
    training.run()
    training.close()
    grown = training.world
    assert 0 < training.curriculum.progress < 1
    resumed = kind(ID, settings, tmp_path, num_threads=1)
    resumed.resume()
    assert resumed.world == grown
    if kind is Training:
        worlds = resumed.walkers.get_attr("world")
        assert worlds[0] == worlds[2] == grown
        assert worlds[1] == resumed.curriculum.trial(0)
    resumed.run()
    resumed.close()
    assert resumed.world == WORLD
    worlds = [point.world for point in read_curve(tmp_path / "curve.csv")]
    assert worlds[-1] == _core.world_text(WORLD)
    assert len(set(worlds)) > 1
    notes = _core.Policy(str(tmp_path / "policy.safetensors")).notes
    assert notes["world"] in worlds
    state = json.loads((tmp_path / "checkpoint/state.json").read_text())
    assert state["moves"] == [4, 4, 4, 4]


@pytest.mark.parametrize(("kind", "given"), [(Evolution, ES), (Training, PPO)], ids=["es", "ppo"])
def test_starts_from_the_shipped_policy(tmp_path, kind, given):
    shipped = read_policy(shipped_policy(ID))
    for layers in (None, [len(bias) for _, bias in shipped.layers[:-1]]):
        training = kind(ID, settings_from({**given, "layers": layers}), tmp_path, num_threads=1)
        first = training.policy()
        training.close()
        for one, other in zip(first.layers, shipped.layers):
            assert all(map(np.array_equal, one, other))
        assert np.array_equal(first.mean, shipped.mean)
        assert np.allclose(first.deviation, shipped.deviation, rtol=1e-12)
        assert first.activation == shipped.activation
    wrong_settings = [
        ({"layers": [7, 7]}, r"layers = \[7, 7\]: must be "),
        ({"activation": "relu"}, "activation = 'relu': must be 'tanh' as the policy to start from"),
    ]
    if kind is Training:
        wrong_settings.append(
            ({"num_envs": 4}, "num_envs = 4: must be at least 8, twice the number")
        )
    for wrong, words in wrong_settings:
        with pytest.raises(ValueError, match=words):
            kind(ID, settings_from({**given, **wrong}), tmp_path)
