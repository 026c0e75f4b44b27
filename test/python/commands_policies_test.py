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
SPECIFICATION = _core.Pool(ID, {}).specification
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
    options = SimpleNamespace(policy=text, normalization=None)
    return make_policies(options, ID, {}, SPECIFICATION)


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


def returning(observation):
    return returning.action


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (3, "action has shape (); must have (4,), one per joint"),
        ("forward", "action = 'forward': must hold numbers, not <U7"),
        ([0, 0, 0, np.nan], "action = [0, 0, 0, nan]: must be finite"),
    ],
)
def test_error_names_invalid_action(command, action, words):
    returning.action = action
    policy = f"{__name__}:returning"
    error = command("evaluate", ID, "--policy", policy, "--seeds", 3, status=1).err
    assert error == f"walker_sim evaluate: --policy {policy}, seed 3: {words}\n"


@pytest.fixture
def model(tmp_path, monkeypatch):
    """Writes the part of a saved model that is read without the library, and fakes the library."""

    def write(module="stable_baselines3.common.policies", observations=24, name="A2C", **data):
        class Algorithm:
            observation_space = SimpleNamespace(shape=(observations,))
            action_space = SimpleNamespace(shape=(4,))

            @classmethod
            def load(cls, path, device):
                assert (path, device) == (file, "cpu")
                return cls()

            def predict(self, observation, deterministic, state=None):
                assert deterministic
                if name == "RecurrentPPO":
                    step = 0 if state is None else state
                    return np.full(4, step), step + 1
                assert state is None
                return observation[4:8], None

        package = "sb3_contrib" if module.startswith("sb3_contrib") else "stable_baselines3"
        monkeypatch.setitem(sys.modules, package, SimpleNamespace(**{name: Algorithm}))
        monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(set_num_threads=threads.append))
        file = str(tmp_path / "model.zip")
        with zipfile.ZipFile(file, "w") as archive:
            data = {"policy_class": {"__module__": module}, **data}
            archive.writestr("data", json.dumps(data))
        return file

    threads = write.threads = []
    return write


@pytest.mark.parametrize(
    ("module", "data", "name"),
    [
        ("stable_baselines3.common.policies", {"clip_range": 0.2}, "PPO"),
        ("stable_baselines3.common.policies", {}, "A2C"),
        ("stable_baselines3.sac.policies", {}, "SAC"),
        ("stable_baselines3.td3.policies", {}, "TD3"),
        ("sb3_contrib.crossq.policies", {}, "CrossQ"),
        ("my_own.networks", {"clip_range": 0.2}, "PPO"),
    ],
)
def test_model_is_loaded_by_its_algorithm(model, module, data, name):
    action = policies(model(module, name=name, **data))(0)(OBSERVATION)
    assert (action == OBSERVATION[4:8]).all()
    assert model.threads == [1]


def test_memory_belongs_to_an_episode(model):
    """RecurrentPPO's state is kept for each walker, and begins anew with its episode."""
    policy_of = policies(model("sb3_contrib.common.recurrent.policies", name="RecurrentPPO"))
    one, other = policy_of(0), policy_of(1)
    assert [float(act(OBSERVATION)[0]) for act in (one, one, other, one, other)] == [0, 1, 0, 2, 1]
    assert policy_of(0)(OBSERVATION)[0] == 0


def test_refuses_unknown_policy_class_by_name(model):
    words = "model.zip: has a policy class of sb3_contrib.common.maskable.policies"
    with pytest.raises(InputError, match=words):
        policies(model("sb3_contrib.common.maskable.policies", clip_range=0.2))


def test_rejects_model_of_other_sizes(model):
    with pytest.raises(InputError, match=r"shapes \(17,\) and \(4,\); must be \(24,\) and \(4,\)"):
        policies(model(observations=17))


def test_error_names_missing_library(model, monkeypatch):
    file = model()
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(InputError, match="pip install stable-baselines3"):
        policies(file)


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


def test_error_names_missing_onnx(command, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "onnx", None)
    out = tmp_path / "policy.onnx"
    error = command("convert", shipped_policy(ID), out, status=2).err
    assert ".safetensors: needs onnx: pip install onnx (" in error
    assert not out.exists()
