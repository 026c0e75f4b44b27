"""train with Stable-Baselines3: short trainings, and policy files that act as the networks."""

import json

import numpy as np
import pytest
import stable_baselines3
import torch
from evolution_test import GROWING, check_interruptions
from evolution_test import SMALL as EVOLUTION
from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.sb3 import VecEnv
from walker_sim.training import ppo
from walker_sim.training.curve import read_curve
from walker_sim.training.es import Evolution
from walker_sim.training.learner import actor_arrays, wrap
from walker_sim.training.policy_file import read_policy
from walker_sim.training.run import Training
from walker_sim.training.settings import settings_from
from walker_sim.training.settings_file import read_settings, write_settings
from walkers import actions_of, ctrl_c, returns_of

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


def train(folder, settings, **keywords):
    folder.mkdir()
    training = Training(ID, settings, folder, num_threads=1, **keywords)
    training.run()
    training.close()
    return training


STATE = """{"id": "BipedalWalker-v3", "stage": 0, "is_done": false, "steps": 64,
"steps_before": 0, "seconds": 0.5, "best": -100}"""


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[" * 200000, "state.json: not a checkpoint: RecursionError: "),
        ("", "state.json: not a checkpoint: JSONDecodeError: Expecting value"),
        ("[]", "state.json: not a checkpoint: TypeError: "),
        ("{}", "state.json: not a checkpoint: KeyError: 'id'"),
        (STATE.replace("Bipedal", "B\\ud800"), "ValueError: id = 'B\\ud800Walker-v3': must be one"),
        (STATE.replace("Bipedal", "Quadrupedal"), "must be one of BipedalWalker-v3, "),
        (
            STATE.replace("0,", "-1,", 1),
            "stage = -1: must be one of the 1 of these settings, from 0",
        ),
        (STATE.replace("0,", "1,", 1), "stage = 1: must be one of the 1 of these settings, from 0"),
        (STATE.replace("0,", "Infinity,", 1), "not a checkpoint: OverflowError"),
        (STATE.replace("64", '"64"'), "TypeError: steps = '64': must be a number"),
        (STATE.replace("-100", "true"), "TypeError: best = True: must be a number"),
        (STATE.replace("false", "0"), "TypeError: is_done = 0: must be true or false"),
        (STATE.replace("}", ', "points": []}'), "TypeError: points = []: must be a number"),
        (STATE.replace("steps", "stepz"), "not a checkpoint: KeyError: 'steps'"),
    ],
)
def test_error_names_invalid_checkpoint(tmp_path, command, content, words):
    (tmp_path / "checkpoint").mkdir()
    (tmp_path / "checkpoint" / "state.json").write_text(content)
    write_settings(small(), tmp_path / "settings.yaml")
    error = command("train", "--resume", tmp_path, status=2).err
    assert error.startswith(f"walker_sim train: --resume {tmp_path}: ")
    assert words in error


# ---------------------------------------------------------------- environments


def wrapped(**changes):
    settings = small(num_envs=2, parameters={}, **changes)
    walkers = wrap(VecEnv(ID, settings.num_envs, num_threads=1), settings)
    walkers.seed(0)
    walkers.reset()
    return walkers


def test_learner_gets_bounded_rewards_and_monitor_does_not():
    walkers = wrapped()
    walkers.venv.least_reward = -2
    rewards, dones = [], [False]
    while not dones[0]:
        _, _, dones, infos = walkers.step(np.ones((2, 4), np.float32))
        rewards.append(walkers.get_original_reward()[0])
    assert min(rewards) == -2
    assert infos[0]["episode"]["r"] < -100


def test_delayed_action_is_the_previous_one():
    late, prompt = wrapped(action_delay=1.0), wrapped()
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (5, 2, 4)).astype(np.float32)
    for step in range(5):
        observations = late.step(actions[step])[0]
        before = actions[step - 1] if step else np.zeros((2, 4), np.float32)
        assert np.array_equal(observations, prompt.step(before)[0])


# ---------------------------------------------------------------- learner


def test_update_equals_that_of_stable_baselines3():
    results = []
    for algorithm, num_threads in ((stable_baselines3.PPO, 1), (ppo.PPO, 1), (ppo.PPO, 4)):
        small_batches = {"n_steps": 32, "batch_size": 64, "n_epochs": 2, "ent_coef": 0.01}
        model = algorithm("MlpPolicy", VecEnv(ID, 8, num_threads=1), seed=0, **small_batches)
        model.num_threads = num_threads
        results.append([each.detach() for each in model.learn(768).policy.parameters()])
    for result in results[1:]:
        assert all(map(torch.equal, results[0], result))


def test_tanh_is_that_of_pytorch():
    inputs = torch.linspace(-10, 10, 10001, requires_grad=True)
    outputs, gradients = [], []
    for function in (torch.tanh, ppo.Tanh()):
        outputs.append(function(inputs))
        gradients.append(torch.autograd.grad((outputs[-1] ** 2).sum(), inputs)[0])
    assert torch.allclose(*outputs, rtol=0, atol=1e-6)
    assert torch.allclose(*gradients, rtol=0, atol=1e-6)
    assert float(gradients[0].abs().max()) > 0.5


# ---------------------------------------------------------------- trainings


def test_evaluate_repeats_the_best_evaluation(tmp_path, command, evaluate, monkeypatch):
    """evaluate's returns equal the training's to the bit."""
    seen = []

    def returns(self, *given, play=Training._returns):
        seen.append(play(self, *given))
        return seen[-1]

    monkeypatch.setattr(Training, "_returns", returns)
    write_settings(small(), tmp_path / "small.yaml")
    folder = tmp_path / "run"
    given = ["train", ID, "--settings", tmp_path / "small.yaml", "--out", folder]
    command(*given, "--num-threads", 1)
    names = {path.name for path in folder.iterdir()}
    assert names == {"policy.safetensors", "settings.yaml", "curve.csv", "curve.png", "checkpoint"}
    points = read_curve(folder / "curve.csv")
    assert [point.steps for point in points] == [1024, 2048]
    best = max(point.evaluation_return for point in points)
    policy = _core.Policy(str(folder / "policy.safetensors"))
    assert policy.notes["settings"] == read_settings(folder / "settings.yaml").hash()
    chosen = ["--seeds", "2000000:2000003", "max_episode_steps=50"]
    returns = returns_of(evaluate(ID, "--policy", folder / "policy.safetensors", *chosen)[1])
    assert np.mean(returns) == pytest.approx(best, abs=1e-3)
    assert returns == max(seen, key=np.mean)[0].tolist()
    assert "--resume" in command(*given, status=2).err


def test_the_policy_to_start_from_is_kept_if_it_stays_the_best(tmp_path):
    """PPO with such a learning rate makes the walker fall."""
    settings = small(start="shipped", layers=None, learning_rate=[1, 1])
    training = train(tmp_path / "run", settings)
    returns = [point.evaluation_return for point in training.points]
    assert training.points[0].steps == 0
    assert returns[0] > max(returns[1:])
    kept = read_policy(tmp_path / "run" / "policy.safetensors")
    shipped, last = read_policy(shipped_policy(ID)), training.policy()
    for one, other, after in zip(kept.layers, shipped.layers, last.layers):
        assert all(map(np.array_equal, one, other))
        assert not np.allclose(one[0], after[0])
    assert np.allclose(last.mean, shipped.mean, rtol=0, atol=1e-6)  # the normalisation stays
    assert np.allclose(last.deviation, shipped.deviation, rtol=1e-6)


def test_only_the_value_network_learns_at_first(tmp_path):
    settings = small(start="shipped", layers=None, value_steps=1024)
    seen = {}

    def look(training, point):
        if point is not None:
            network = training.model.policy
            tensors = network.action_net.weight, network.value_net.weight
            seen[training.steps] = [tensor.detach().numpy().copy() for tensor in tensors]

    train(tmp_path / "run", settings, report=look)
    (actor, value), (same, other), (changed, _) = (seen[steps] for steps in (0, 1024, 2048))
    assert np.array_equal(actor, same) and not np.array_equal(actor, changed)
    assert not np.array_equal(value, other)


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "tqc"])
def test_each_algorithm_stops_and_resumes(tmp_path, algorithm):
    own = {"learning_starts": 100, "buffer_size": 5000} if algorithm != "ppo" else {"log_std": None}
    settings = small(algorithm=algorithm, activation="relu", **own)
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
    for name in ("obs_rms", "ret_rms"):
        for part in ("mean", "var", "count"):
            one, other = (getattr(getattr(each.walkers, name), part) for each in (first, second))
            assert np.array_equal(one, other)
    for one, other in zip(first.networks, second.networks):
        assert all(map(np.array_equal, one, other))
    second.run()
    second.close()
    assert second.is_done
    points = read_curve(folder / "curve.csv")
    assert (points[0].steps, len(points)) == (1024, 2)


# The learning rate is the default, which CMA has not.
CMA = {"algorithm": "cma", "learning_rate": [7e-4, 5e-5]}


def test_cma_finds_a_gait(tmp_path):
    given = {**EVOLUTION, **CMA, "steps": 30_000, "population": 10, "sigma": [0.2, 0.2]}
    training = Evolution("Hopper-v5", settings_from(given), tmp_path)
    training.run()
    assert training.points[-1].evaluation_return > 200  # standing has about 100


def test_cma_repeats_interrupted_episodes(tmp_path, monkeypatch):
    stages = [{"steps": 2_000, **GROWING}]
    check_interruptions(tmp_path, monkeypatch, stages=stages, **CMA)


def test_exploration_fades_linearly_and_changes_apply(tmp_path):
    changes = {1024: {"gamma": 0.95}, 1536: {"least_reward": -1}}
    settings = small(log_std=[-0.5, -2.5], gamma=0.9, changes=changes)
    seen = {}

    def look(training, point):
        if point is None:  # at the end of a rollout of 256 steps
            log_std = float(training.model.policy.log_std[0])
            seen[training.steps - 256] = training.model.gamma, training.walkers.venv.least_reward
            assert log_std == pytest.approx(-0.5 - 2 * (training.steps - 256) / 2048)

    train(tmp_path / "run", settings, report=look)
    assert [seen[begun] for begun in (768, 1024, 1536)] == [(0.9, None), (0.95, None), (0.95, -1)]


def test_policy_is_the_mean_of_the_last_networks(tmp_path):
    networks = []

    def look(training, point):
        if point is None:  # at a rollout's end: the network after the previous update
            networks.append(actor_arrays(training.model))

    training = train(tmp_path / "run", small(average_updates=3, evaluate_every=2048), report=look)
    weight = read_policy(tmp_path / "run" / "policy.safetensors").layers[0][0]
    networks.append(actor_arrays(training.model))
    expected = np.mean([network[0] for network in networks[-3:]], axis=0)
    assert np.allclose(weight, expected, rtol=0, atol=1e-7)
    assert not np.allclose(weight, networks[-1][0], rtol=0, atol=1e-7)


def test_ctrl_c_saves_a_checkpoint(tmp_path, command):
    write_settings(small(steps=10_000_000, evaluate_every=10_000_000), tmp_path / "long.yaml")
    folder = tmp_path / "run"
    given = ["--out", folder, "--settings", tmp_path / "long.yaml", "--num-threads", 1]
    with ctrl_c(2):
        error = command("train", ID, *given, status=130).err
    assert f"--resume {folder}" in error
    assert json.loads((folder / "checkpoint" / "state.json").read_text())["id"] == ID


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["Walker3d-v5"], "Walker3d-v5"),
        ([ID, "--settings", "missing.yaml"], "missing.yaml"),
        (["--resume", "nowhere"], "--resume nowhere: has no checkpoint"),
        ([ID, "--resume", "nowhere"], "--resume nowhere: not allowed with walker"),
        ([ID, "max_episode_steps=-3"], "max_episode_steps"),
        ([ID, "--seed", 2**32], "seed = 4294967296: must be a whole number from 0 to 4294967295"),
        *(
            ([ID, f"{name}={value}"], f"parameter {name}: unknown; must be one of")
            for name, value in (("hard", 1), ("width", 64), ("transport", "ros"), ("zoom", 2))
        ),
    ],
)
def test_error_names_invalid_argument(given, words, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert words in command("train", *given, status=2).err


def test_file_acts_as_the_network_within_a_millionth(tmp_path):
    training = train(tmp_path / "run", small(layers=[256, 256], evaluate_every=2048))
    observations = np.random.default_rng(0).normal(0, 1, (100_000, 24))
    normal = training.walkers.normalize_obs(observations)
    expected = training.model.predict(normal, deterministic=True)[0]
    found = actions_of(tmp_path / "run" / "policy.safetensors", observations)
    assert np.abs(found - expected).max() < 1e-6
    assert np.std(expected) > 0
