"""train and convert with Stable-Baselines3: short trainings, and files with equal actions."""

import csv
import json
import os
import pathlib
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
import torch
from sb3_contrib import TQC
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize
from walker_sim import _core
from walker_sim.commands import main
from walker_sim.sb3 import VecEnv
from walker_sim.training import evaluation
from walker_sim.training.learner import actor_arrays
from walker_sim.training.run import Training
from walker_sim.training.settings import (
    Settings,
    SettingsError,
    read_settings,
    settings_from,
    write_settings,
)
from walker_sim.training.walkers import GymnasiumSource, NormalizedVecEnv, PoolSource

ROOT = pathlib.Path(__file__).parents[2]
ID = "BipedalWalker-v3"
SMALL = {
    "steps": 2048,
    "num_envs": 8,
    "rollout": 32,
    "batch_size": 64,
    "epochs": 2,
    "layers": [16, 16],
    "evaluate_every": 1024,
    "evaluation_episodes": 3,
    "parameters": {"max_episode_steps": 50},
}


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def small(**changes):
    return settings_from({**SMALL, **changes})


def train(folder, settings, num_threads=1, **keywords):
    folder.mkdir(exist_ok=True)
    training = Training(ID, settings, folder, num_threads=num_threads, **keywords)
    training.run()
    training.close()
    return training


def curve(folder):
    with (folder / "curve.csv").open(newline="") as file:
        return list(csv.DictReader(file))


# ---------------------------------------------------------------- settings


def test_settings_that_come_along_are_read_and_known_by_their_hash(tmp_path):
    files = sorted((ROOT / "config/training").glob("*.yaml"))
    assert [file.stem for file in files] == sorted(_core.ids())
    hashes = set()
    for file in files:
        settings = read_settings(file)
        write_settings(settings, tmp_path / "again.yaml")
        again = read_settings(tmp_path / "again.yaml")
        assert again == settings
        assert again.hash() == settings.hash()
        hashes.add(settings.hash())
    assert len(hashes) > 3


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"algorithms": "ppo"}, "algorithms: unknown; must be one of algorithm, steps"),
        ({"algorithm": "dqn"}, "algorithm = 'dqn': must be one of ppo, sac, tqc"),
        ({"steps": 0}, "steps = 0: must be a whole number from 1"),
        ({"steps": 1e6}, "steps = 1000000.0: must be a whole number"),
        ({"gamma": 1.5}, "gamma = 1.5: must be a number from 0 to 1"),
        ({"gamma": float("nan")}, "gamma = nan"),
        ({"layers": []}, "layers = []: must be a list of 1 to 8 whole numbers"),
        ({"layers": [64, "64"]}, "layers = '64': must be a whole number"),
        ({"learning_rate": 1e-3}, "learning_rate = 0.001: must be two numbers"),
        ({"least_reward": 1}, "least_reward = 1: must be a number from -inf to 0"),
        ({"changes": {10: {"seed": 1}}}, "changes: 'seed': must be one of gamma, least_reward"),
        ({"parameters": 3}, "parameters = 3: must be a mapping"),
        ({"parameters": {"hardcore": None}}, "parameters: hardcore = None: must be true or false,"),
    ],
)
def test_a_wrong_setting_is_named_with_what_is_allowed(given, words):
    with pytest.raises(SettingsError) as caught:
        settings_from(given)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"[" * 1000, "nested too deep"),
        (b"parameters: " + b"{a: " * 1000 + b"1" + b"}" * 1000, "nested too deep"),
        (b"steps: 2026-13-01", "month must be in 1..12"),
        (b"algorithm: \xff", "'utf-8' codec can't decode"),
        (b"steps: ]", "expected the node content"),
        (b"parameters: {hardcore: " + b"[" * 50 + b"]" * 50 + b"}", "or a list of numbers"),
    ],
)
def test_a_file_that_is_no_settings_is_named_with_the_reason(tmp_path, capsys, content, words):
    file = tmp_path / "mine.yaml"
    file.write_bytes(content)
    out = tmp_path / "run"
    assert main(["train", ID, "--settings", str(file), "--out", str(out)]) == 2
    told = capsys.readouterr().err
    assert told.startswith("walker_sim train: ")
    assert words in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[" * 200000, "nested too deep"),
        ("", "state.json: no JSON: Expecting value"),
        ("[]", "state.json: must be an object with the environment's id"),
        ("{}", "state.json: must be an object with the environment's id"),
    ],
)
def test_a_checkpoint_that_is_none_is_named_with_the_reason(tmp_path, capsys, content, words):
    (tmp_path / "checkpoint").mkdir()
    (tmp_path / "checkpoint" / "state.json").write_text(content)
    write_settings(small(), tmp_path / "settings.yaml")
    assert main(["train", "--resume", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"walker_sim train: --resume {tmp_path}: ")
    assert words in told
    assert told.count("\n") == 1


def test_settings_change_where_they_say():
    settings = small(gamma=0.9, changes={100: {"gamma": 0.95}, 200: {"least_reward": -1}})
    found = [
        (settings.at(steps).gamma, settings.at(steps).least_reward) for steps in (99, 100, 250)
    ]
    assert found == [(0.9, None), (0.95, None), (0.95, -1.0)]


# ---------------------------------------------------------------- what the learner sees


def test_our_walkers_are_gymnasiums_to_the_learner(promotion):
    """Gymnasium keeps the Box2D world between episodes, as does reuse_world."""
    settings = small(num_envs=3, parameters={}, least_reward=-5)
    ours = NormalizedVecEnv(
        PoolSource(ID, small(num_envs=3, parameters={"reuse_world": True}), 1), settings
    )
    theirs = NormalizedVecEnv(GymnasiumSource(ID, settings), settings)
    assert np.array_equal(ours.reset(), theirs.reset())
    random = np.random.default_rng(0)
    ends = 0
    for _ in range(300):
        actions = random.uniform(-1, 1, (3, 4)).astype(np.float32)
        outcomes = [walkers.step(actions) for walkers in (ours, theirs)]
        for one, other in zip(outcomes[0][:3], outcomes[1][:3]):
            assert np.array_equal(one, other)
        for one, other in zip(outcomes[0][3], outcomes[1][3]):
            assert one.keys() == other.keys()
            if one:
                ends += 1
                assert np.array_equal(one["terminal_observation"], other["terminal_observation"])
                assert one["episode"] == other["episode"]
    assert ends > 0
    ours.close()
    theirs.close()


def test_rewards_are_divided_and_a_fall_counts_as_much_as_is_said():
    settings = small(num_envs=1, parameters={}, least_reward=-2)
    walkers = NormalizedVecEnv(PoolSource(ID, settings, 1), settings)
    walkers.reset()
    least, done = 0.0, False
    while not done:
        _, rewards, dones, infos = walkers.step(np.array([[1, 1, 1, 1]], np.float32))
        done = bool(dones[0])
        scale = np.sqrt(walkers.return_statistics.var + 1e-8)
        least = min(least, float(rewards[0] * scale))
    assert least == pytest.approx(-2, rel=1e-5)
    assert infos[0]["episode"]["r"] < -100
    walkers.close()


def test_a_delayed_action_is_the_one_before():
    settings = small(num_envs=2, parameters={}, action_delay=1.0)
    late = NormalizedVecEnv(PoolSource(ID, settings, 1), settings)
    prompt = NormalizedVecEnv(
        PoolSource(ID, small(num_envs=2, parameters={}), 1), small(num_envs=2)
    )
    late.reset()
    prompt.reset()
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (5, 2, 4)).astype(np.float32)
    for step in range(5):
        observations = late.step(actions[step])[0]
        before = actions[step - 1] if step else np.zeros((2, 4), np.float32)
        assert np.array_equal(observations, prompt.step(before)[0])


# ---------------------------------------------------------------- trainings


def test_a_training_leaves_a_policy_that_evaluate_takes(tmp_path, capsys, monkeypatch):
    """evaluate's returns equal the training's to the bit."""
    seen = []

    def returns(self, policy, play=evaluation.Evaluation.returns):
        seen.append(play(self, policy))
        return seen[-1]

    monkeypatch.setattr(evaluation.Evaluation, "returns", returns)
    write_settings(small(), tmp_path / "small.yaml")
    folder = tmp_path / "run"
    given = ["train", ID, "--settings", str(tmp_path / "small.yaml"), "--out", str(folder)]
    assert main([*given, "--num-threads", "1"]) == 0
    names = {path.name for path in folder.iterdir()}
    assert names == {"policy.safetensors", "settings.yaml", "curve.csv", "curve.png", "checkpoint"}
    points = curve(folder)
    assert [int(point["steps"]) for point in points] == [1024, 2048]
    best = max(float(point["evaluation_return"]) for point in points)
    policy = _core.Policy(str(folder / "policy.safetensors"))
    assert policy.notes["settings"] == read_settings(folder / "settings.yaml").hash()
    capsys.readouterr()
    file = tmp_path / "outcomes.json"
    chosen = ["--seeds", "2000000:2000003", "max_episode_steps=50", "--json", str(file)]
    assert main(["evaluate", ID, "--policy", str(folder / "policy.safetensors"), *chosen]) == 0
    returns = [each["return"] for each in json.loads(file.read_text())["outcomes"]]
    assert np.mean(returns) == pytest.approx(best, abs=1e-3)
    assert returns == max(seen, key=np.mean).tolist()
    assert main([*given]) == 2
    assert "--resume" in capsys.readouterr().err


def test_the_same_seed_gives_the_same_policy_with_any_threads(tmp_path):
    policies = []
    for num_threads in (1, 2):
        folder = tmp_path / str(num_threads)
        train(folder, small(), num_threads=num_threads)
        policies.append((folder / "policy.safetensors").read_bytes())
    assert policies[0] == policies[1]


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc"])
def test_each_algorithm_learns_stops_and_goes_on(tmp_path, algorithm):
    settings = small(
        algorithm=algorithm, activation="relu", learning_starts=100, buffer_size=5000, log_std=None
    )
    folder = tmp_path / algorithm
    folder.mkdir()
    first = Training(ID, settings, folder, num_threads=1)
    first.report = lambda training, point: setattr(training, "wants_to_stop", point is not None)
    first.run()
    assert 1024 <= first.steps < 2048
    first.close()
    second = Training(ID, settings, folder, num_threads=1)
    second.resume()
    assert second.steps == first.steps
    for one, other in zip(first.model.policy.parameters(), second.model.policy.parameters()):
        assert torch.equal(one, other)
    mean = first.walkers.observation_statistics.mean
    assert np.array_equal(mean, second.walkers.observation_statistics.mean)
    second.run()
    second.close()
    assert second.is_done
    assert int(curve(folder)[0]["steps"]) == 1024
    assert len(curve(folder)) == 2
    with pytest.raises(OSError, match="checkpoint"):
        Training(ID, settings, tmp_path, num_threads=1).resume()


def test_exploration_moves_on_its_line_and_changes_take_place(tmp_path):
    settings = small(log_std=[-0.5, -2.5], gamma=0.9, changes={1000: {"gamma": 0.95}})
    seen = []

    def look(training, point):
        if point is None:
            log_std = float(training.model.policy.log_std[0])
            seen.append((training.steps, log_std, training.model.gamma))

    train(tmp_path / "run", settings, report=look)
    for steps, log_std, gamma in seen:
        begun = steps - 8 * 32
        assert log_std == pytest.approx(-0.5 - 2 * begun / 2048)
        assert gamma == (0.95 if begun >= 1000 else 0.9)


def tensor_of(path, name):
    content = path.read_bytes()
    (size,) = struct.unpack_from("<Q", content)
    entry = json.loads(content[8 : 8 + size])[name]
    begin, end = entry["data_offsets"]
    return np.frombuffer(content[8 + size :][begin:end], "<f4").reshape(entry["shape"])


def test_the_mean_of_the_last_networks_is_kept(tmp_path):
    networks = []

    def look(training, point):
        if point is None:  # at a rollout's end: the network after the previous update
            networks.append(actor_arrays(training.model))

    training = train(tmp_path / "run", small(average_updates=3, evaluate_every=2048), report=look)
    weight = tensor_of(tmp_path / "run" / "policy.safetensors", "layers.0.weight")
    networks.append(actor_arrays(training.model))
    expected = np.mean([network[0] for network in networks[-3:]], axis=0)
    assert np.allclose(weight, expected, rtol=0, atol=1e-7)
    assert not np.allclose(weight, networks[-1][0], rtol=0, atol=1e-7)


def test_ctrl_c_saves(tmp_path):
    settings = small(steps=10_000_000, evaluate_every=10_000_000)
    write_settings(settings, tmp_path / "long.yaml")
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "walker_sim", "train", ID, "--out", str(folder)]
    command += ["--settings", str(tmp_path / "long.yaml"), "--num-threads", "1"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        wait_for_file(folder / "settings.yaml")
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert f"--resume {folder}" in said
    state = json.loads((folder / "checkpoint" / "state.json").read_text())
    assert state["id"] == ID


def wait_for_file(path):
    for _ in range(600):
        if path.exists():
            return
        time.sleep(0.1)
    raise AssertionError(f"{path} does not come")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["train", "Walker3d-v5"], "Walker3d-v5"),
        (["train", ID, "--settings", "missing.yaml"], "missing.yaml"),
        (["train", "--resume", "nowhere"], "--resume nowhere: has no checkpoint"),
        (["train", ID, "--resume", "nowhere"], "walker cannot be given too"),
        (["train", ID, "max_episode_steps=-3"], "max_episode_steps"),
    ],
)
def test_wrong_input_is_named(given, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(given) == 2
    assert words in capsys.readouterr().err


# ---------------------------------------------------------------- the file beside the network


def actions_of(path, observations, env_id=ID):
    policy = _core.Policy(str(path))
    policy.check(env_id, {})
    actions = np.empty((len(observations), 4))
    policy.act(observations, actions)
    return actions


def test_actions_are_the_networks_within_a_millionth(tmp_path):
    training = train(tmp_path / "run", small(layers=[256, 256], evaluate_every=2048))
    observations = np.random.default_rng(0).normal(0, 1, (100_000, 24))
    normal = training.walkers.normal(observations)
    expected = training.model.predict(normal, deterministic=True)[0]
    found = actions_of(tmp_path / "run" / "policy.safetensors", observations)
    assert np.abs(found - expected).max() < 1e-6
    assert np.std(expected) > 0


@pytest.mark.parametrize("algorithm", [PPO, A2C, SAC, TQC])
def test_models_are_converted(tmp_path, capsys, algorithm):
    walkers = VecNormalize(VecEnv(ID, 2))
    walkers.reset()
    for _ in range(50):
        walkers.step(np.random.default_rng(0).uniform(-1, 1, (2, 4)))
    model = algorithm("MlpPolicy", walkers, policy_kwargs={"net_arch": [32, 32]}, seed=3)
    model.save(tmp_path / "model.zip")
    walkers.save(tmp_path / "normal.pkl")
    out = tmp_path / "walker.safetensors"
    given = ["convert", str(tmp_path / "model.zip"), str(out), "--id", f"walker_sim/{ID}"]
    assert main([*given, "--normalization", str(tmp_path / "normal.pkl")]) == 0
    assert "actions differ by at most" in capsys.readouterr().out
    observations = np.random.default_rng(1).normal(0, 1, (200, 24))
    expected = model.predict(walkers.normalize_obs(observations), deterministic=True)[0]
    assert np.allclose(actions_of(out, observations), expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("ends_in_tanh", [False, True])
def test_onnx_is_converted(tmp_path, ends_in_tanh, capsys):
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    random = np.random.default_rng(0)
    sizes, names = [17, 20, 6], []
    nodes, values, last = [], [], "observation"
    for index in range(2):
        weight = random.normal(0, 0.3, sizes[index : index + 2]).astype(np.float32)
        bias = random.normal(0, 0.3, sizes[index + 1]).astype(np.float32)
        values += [numpy_helper.from_array(weight, f"w{index}")]
        values += [numpy_helper.from_array(bias, f"b{index}")]
        out = f"layer{index}"
        nodes.append(helper.make_node("Gemm", [last, f"w{index}", f"b{index}"], [out]))
        names.append(out)
        last = out
        if index == 0 or ends_in_tanh:
            nodes.append(helper.make_node("Tanh", [last], [last + "_tanh"]))
            last += "_tanh"
    make = helper.make_tensor_value_info
    graph = helper.make_graph(
        nodes,
        "walker",
        [make("observation", TensorProto.FLOAT, ["n", 17])],
        [make(last, TensorProto.FLOAT, ["n", 6])],
        values,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, tmp_path / "model.onnx")
    out = tmp_path / "walker.safetensors"
    assert main(["convert", str(tmp_path / "model.onnx"), str(out)]) == 0
    assert "Walker2d-v5, 2 layers; actions differ by at most" in capsys.readouterr().out


def test_what_cannot_be_converted_is_named(tmp_path, capsys):
    class Elu(torch.nn.ELU):
        pass

    model = PPO("MlpPolicy", VecEnv(ID, 1), policy_kwargs={"activation_fn": Elu})
    model.save(tmp_path / "model.zip")
    (tmp_path / "other.zip").write_bytes(b"nothing")
    (tmp_path / "other.onnx").write_bytes(b"nothing")
    out = str(tmp_path / "walker.safetensors")
    for name, words in (
        ("model.zip", "Elu; must be Linear, Tanh or ReLU"),
        ("other.zip", "no model that Stable-Baselines3 has saved"),
        ("other.onnx", "ONNX"),
        ("none.zip", "there is no such file"),
        ("model.pt", "there is no such file"),
    ):
        assert main(["convert", str(tmp_path / name), out, "--id", ID]) == 2
        error = capsys.readouterr().err
        assert words in error
        assert name in error
    assert not pathlib.Path(out).exists()
    assert main(["convert", str(tmp_path / "model.zip"), "walker.bin"]) == 2


def test_settings_have_a_default_for_everything():
    assert settings_from({}) == Settings()


def test_an_evaluation_plays_every_seed_whatever_runs_at_once(monkeypatch):
    random = np.random.default_rng(0)
    content = bytearray((ROOT / "assets/policies" / f"{ID}.safetensors").read_bytes())
    last_bias = np.frombuffer(content, "<f4", offset=len(content) - 4 * 4)  # the file's last tensor
    last_bias += random.normal(0, 0.3, 4).astype(np.float32)  # makes the walker fall sometimes
    policy = _core.Policy.from_bytes("with noise", bytes(content))
    returns = []
    for at_once in (7, 3):
        monkeypatch.setattr(evaluation, "_AT_ONCE", at_once)
        plays = evaluation.Evaluation(ID, {"max_episode_steps": 200}, 7, 1)
        returns.append(plays.returns(policy))
        plays.close()
    assert np.array_equal(returns[0], returns[1])
    assert len(set(returns[0])) == 7
