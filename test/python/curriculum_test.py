"""Trainings in several worlds, in ranges that grow, and those that start from a policy."""

import json
import math

import numpy as np
import pytest
from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.episode_player import make_player, play_jobs
from walker_sim.training.curriculum import Curriculum
from walker_sim.training.curve import read_curve
from walker_sim.training.es import Evolution
from walker_sim.training.mixture import in_turn
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
    grown = training.curriculum.world
    assert 0 < training.curriculum.progress < 1
    resumed = kind(ID, settings, tmp_path, num_threads=1)
    resumed.resume()
    assert resumed.curriculum.world == grown
    if kind is Training:
        worlds = resumed.walkers.get_attr("world")
        assert worlds[0] == worlds[2] == grown
        assert worlds[1] == resumed.curriculum.trial(0)
    resumed.run()
    resumed.close()
    assert resumed.curriculum.world == WORLD
    worlds = [point.world for point in read_curve(tmp_path / "curve.csv")]
    assert worlds[-1] == _core.world_text(WORLD)
    assert len(set(worlds)) > 1
    notes = _core.Policy(str(tmp_path / "policy.safetensors")).notes
    assert notes["world"] in worlds
    state = json.loads((tmp_path / "checkpoint/state.json").read_text())
    assert state["moves"] == [4, 4, 4, 4]


MIXTURE = [
    "slippery",
    {"world": {"gravity": -9.0}, "weight": 3},
    {"name": "weak", "world": "{motor_strength: 0.9}", "weight": 2},
    {"world": "moon", "weight": 0},
]
NAMES = ["slippery", "{gravity: -9.0}", "weak", "moon"]


def test_worlds_of_a_mixture_take_turns_by_their_weights():
    mixture = settings_from({"world": MIXTURE}).mixture
    assert [part.name for part in mixture] == NAMES
    slippery, heavy, weak = ({"friction_scale": (0.1, 0.4)}, *(each.world for each in mixture[1:3]))
    assert in_turn(mixture) == [heavy, weak, slippery, heavy, weak, heavy]
    twice = [part._replace(weight=2 * part.weight) for part in mixture]
    assert in_turn(twice) == in_turn(mixture)


@pytest.mark.parametrize(("kind", "given"), [(Evolution, ES), (Training, PPO)], ids=["es", "ppo"])
@pytest.mark.parametrize("keep_best_by", ["mean", "min"])
def test_a_mixture_is_trained_in_and_evaluated(tmp_path, kind, given, keep_best_by, monkeypatch):
    mixed = {"world": MIXTURE, "curriculum": None, "keep_best_by": keep_best_by, "steps": 3000}
    settings = settings_from({**given, **mixed})
    trained_in = set()
    play = kind.play

    def note(training, player, networks, worlds, jobs):
        if player is not training._evaluator:
            trained_in.update(_core.world_text(worlds[job[2]]) for job in jobs)
        return play(training, player, networks, worlds, jobs)

    monkeypatch.setattr(kind, "play", note)
    training = kind(ID, settings, tmp_path, num_threads=1)
    if kind is Training:
        worlds = training.walkers.get_attr("world")
        assert worlds[:6] == in_turn(settings.mixture)
        trained_in.update(map(_core.world_text, worlds))
    training.run()
    training.close()
    texts = [_core.world_text(part.world) for part in settings.mixture]
    assert trained_in == set(texts[:3])
    points = read_curve(tmp_path / "curve.csv")
    for point in points:
        assert list(point.means) == NAMES
        assert point.evaluation_return == pytest.approx(np.mean(list(point.means.values())), 1e-4)
    worths = [
        min(point.means.values()) if keep_best_by == "min" else point.evaluation_return
        for point in points
    ]
    assert training.best == pytest.approx(max(worths), 1e-4)
    resumed = kind(ID, settings, tmp_path, num_threads=1)
    resumed.resume()
    resumed.close()
    assert (resumed.best, resumed.points[-1].means.keys()) == (training.best, set(NAMES))
    # The means are those of `evaluate`, world by world.
    policy = _core.Policy(str(tmp_path / "policy.safetensors"))
    assert policy.notes["world"] == (
        "1 slippery {friction_scale: [0.1, 0.4]}, 3 {gravity: -9.0}, "
        "2 weak {motor_strength: 0.9}, 0 moon {gravity: -1.62}"
    )
    best = points[worths.index(max(worths))]
    player = make_player(ID, SMALL["parameters"], 1)
    for part in settings.mixture:
        jobs = [(0, 2_000_000 + index, 0) for index in range(2)]
        played = play_jobs(player, [policy], [part.world], jobs)
        mean = np.mean([episode.episode_return for episode in played])
        assert best.means[part.name] == pytest.approx(mean, 1e-4)


def test_a_mixture_needs_a_walker_for_each_of_its_weights(tmp_path):
    settings = settings_from({**PPO, "world": MIXTURE, "curriculum": None, "num_envs": 5})
    with pytest.raises(ValueError, match="num_envs = 5: must be at least 6, the sum of the weig"):
        Training(ID, settings, tmp_path)
    unknown = settings_from({"world": ["moon", {"hip_speed": 3}]})
    with pytest.raises(ValueError, match="hip_speed"):
        Training(ID, unknown, tmp_path)


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
