"""Policies of the commands: user functions, and Stable-Baselines3 files with a fake library.

normalization_test.py and train_test.py use the real library.
"""

import json
import re
import sys
import zipfile
from types import SimpleNamespace

import numpy as np
import pytest
from walker_sim import _core
from walker_sim.commands import main
from walker_sim.commands.options import InputError
from walker_sim.commands.policies import PolicyFailed, make_policies, shipped_policy

ID = "BipedalWalker-v3"
SPECIFICATION = _core.Environment(ID, {}).specification
OBSERVATION = np.linspace(-1, 1, 24, dtype=np.float32)


class Counting:
    def __init__(self):
        self.calls = 0

    def __call__(self, observation):
        self.calls += 1
        return [0.1 * self.calls] * 4


def first_four(observation):
    return observation[:4]


def policies(text):
    return make_policies(text, ID, {}, SPECIFICATION)


def test_function_action_is_rounded_to_float32():
    action = policies(f"{__name__}:first_four")(0)(OBSERVATION.astype(np.float64) / 3)
    assert action.dtype == np.float32
    assert (action == (OBSERVATION.astype(np.float64) / 3)[:4].astype(np.float32)).all()


def test_class_is_instantiated_per_episode():
    make = policies(f"{__name__}:Counting")
    one, other = make(0), make(1)
    assert one(OBSERVATION)[0] == np.float32(0.1)
    assert one(OBSERVATION)[0] == np.float32(0.2)
    assert other(OBSERVATION)[0] == np.float32(0.1)


def test_random_depends_only_on_the_seed():
    def draw(seed):
        policy = policies("random")(seed)
        return [policy(OBSERVATION).tolist() for _ in range(3)]

    assert draw(1) == draw(1)
    assert draw(1) != draw(2)
    assert all(np.float32(value) == value for action in draw(1) for value in action)


def raising(observation):
    return observation[100]


def test_error_names_seed_of_failing_function():
    with pytest.raises(PolicyFailed, match="raising failed in the episode of seed 7") as caught:
        main(["evaluate", ID, "--policy", f"{__name__}:raising", "--seeds", "7"])
    assert isinstance(caught.value.__cause__, IndexError)


def no_action(observation):
    return 3


def text(observation):
    return "forward"


def not_finite(observation):
    return [0, 0, 0, np.nan]


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (no_action, "action has shape (); must have (4,), one per joint"),
        (text, "action = 'forward': must hold numbers, not <U7"),
        (not_finite, "action = [0, 0, 0, nan]: must be finite"),
    ],
)
def test_error_names_invalid_action(capsys, function, words):
    policy = f"{__name__}:{function.__name__}"
    assert main(["evaluate", ID, "--policy", policy, "--seeds", "3"]) == 1
    assert capsys.readouterr().err == f"walker_sim evaluate: --policy {policy}, seed 3: {words}\n"


def model_file(path, module, **data):
    """Writes the parts of a saved model that are read without the library."""
    with zipfile.ZipFile(path, "w") as file:
        data = {"policy_class": {"__module__": module}, **data}
        file.writestr("data", json.dumps(data))
    return str(path)


def library(loaded, observations=24):

    class Algorithm:
        observation_space = SimpleNamespace(shape=(observations,))
        action_space = SimpleNamespace(shape=(4,))

        @classmethod
        def load(cls, path, device):
            loaded.append((path, device))
            return cls()

        def predict(self, observation, deterministic):
            assert deterministic
            return observation[4:8], None

    return Algorithm


@pytest.mark.parametrize(
    ("module", "data", "package", "name"),
    [
        ("stable_baselines3.common.policies", {"clip_range": 0.2}, "stable_baselines3", "PPO"),
        ("stable_baselines3.common.policies", {}, "stable_baselines3", "A2C"),
        ("stable_baselines3.sac.policies", {}, "stable_baselines3", "SAC"),
        ("stable_baselines3.td3.policies", {}, "stable_baselines3", "TD3"),
        ("sb3_contrib.crossq.policies", {}, "sb3_contrib", "CrossQ"),
        ("my_own.networks", {"clip_range": 0.2}, "stable_baselines3", "PPO"),
    ],
)
def test_model_is_loaded_by_its_algorithm(tmp_path, monkeypatch, module, data, package, name):
    loaded = []
    monkeypatch.setitem(sys.modules, package, SimpleNamespace(**{name: library(loaded)}))
    torch = SimpleNamespace(set_num_threads=lambda count: loaded.append(count))
    monkeypatch.setitem(sys.modules, "torch", torch)
    file = model_file(tmp_path / "model.zip", module, **data)
    action = policies(file)(0)(OBSERVATION)
    assert (action == OBSERVATION[4:8]).all()
    assert loaded == [(file, "cpu"), 1]


def test_rejects_model_of_other_sizes(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", SimpleNamespace(A2C=library([], 17)))
    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(set_num_threads=lambda count: None))
    file = model_file(tmp_path / "model.zip", "stable_baselines3.common.policies")
    with pytest.raises(InputError, match=r"shapes \(17,\) and \(4,\); must be \(24,\) and \(4,\)"):
        policies(file)


def test_error_names_missing_library(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    file = model_file(tmp_path / "model.zip", "stable_baselines3.common.policies")
    with pytest.raises(InputError, match="pip install stable-baselines3"):
        policies(file)


def test_a_zip_that_is_no_model(tmp_path):
    path = tmp_path / "other.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("readme", "nothing")
    with pytest.raises(InputError, match="not a model saved by Stable-Baselines3"):
        policies(str(path))


def test_shipped_network_acts():
    shipped = policies("shipped")(0)(OBSERVATION)
    file = policies(str(shipped_policy(ID)))(1)(OBSERVATION)
    assert shipped.shape == (4,)
    assert (abs(shipped) <= 1).all()
    assert (shipped == file).all()
    assert (shipped == shipped.astype(np.float32)).all()


def test_rejects_unfit_network(tmp_path):
    path = tmp_path / "broken.safetensors"
    path.write_bytes(b"nothing")
    for text, words in (
        (str(path), "broken.safetensors: it has 7 bytes"),
        (str(tmp_path / "none.safetensors"), "none.safetensors: it cannot be read as a file"),
        (str(shipped_policy("Walker2d-v5")), "made for Walker2d-v5: it takes 17 observations"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            policies(text)


def test_error_without_a_shipped_network(monkeypatch):
    monkeypatch.setattr("walker_sim.commands.policies.package_file", lambda name: None)
    with pytest.raises(InputError, match="there is none for BipedalWalker-v3; `train` makes one"):
        policies("shipped")
