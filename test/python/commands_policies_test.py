"""Policies of the commands: user functions, networks, and files that are refused.

normalization_test.py and sb3_models_test.py have those of Stable-Baselines3.
"""

import json
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


@pytest.mark.parametrize(
    ("module", "words"),
    [
        (
            "sb3_contrib.common.maskable.policies",
            "model.zip: has a policy class of sb3_contrib.common.maskable.policies",
        ),
        ("stable_baselines3.sac.policies", "pip install stable-baselines3"),
        ("sb3_contrib.tqc.policies", "pip install sb3-contrib"),
    ],
)
def test_error_names_a_model_that_cannot_be_loaded(tmp_path, monkeypatch, module, words):
    """sb3_models_test.py loads those that can be."""
    for name in ("stable_baselines3", "sb3_contrib"):
        monkeypatch.setitem(sys.modules, name, None)
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as archive:
        data = {"policy_class": {"__module__": module}, "clip_range": 0.2}
        archive.writestr("data", json.dumps(data))
    with pytest.raises(InputError, match=words):
        policies(str(tmp_path / "model.zip"))


def test_shipped_network_is_that_of_its_file():
    shipped, file = policies("shipped")(0), policies(str(shipped_policy(ID)))(1)
    assert (shipped(OBSERVATION) == file(OBSERVATION)).all()
    assert abs(shipped(OBSERVATION)).max() > 0


def test_error_without_a_shipped_network(monkeypatch):
    monkeypatch.setattr("walker_sim.commands.policies.package_file", lambda name: None)
    with pytest.raises(InputError, match="there is none for BipedalWalker-v3; `train` makes one"):
        policies("shipped")
