"""convert: an ONNX graph that is written from a policy file acts as the policy does."""

import dataclasses
import sys

import gymnasium
import numpy as np
import onnx
import onnxruntime
import pytest
import walker_sim  # noqa: F401  # registers the environments
from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.training import onnx_file
from walker_sim.training.policy_file import PolicyFile, read_policy, write_policy

IDS = _core.ids()
ID = "Walker2d-v5"
TOLERANCE = 1e-5  # the command's


def session_of(path):
    return onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])


def actions_of_file(path, observations, size):
    actions = np.empty((len(observations), size))
    _core.Policy(str(path)).act(np.ascontiguousarray(observations, np.float64), actions)
    return actions


def small_policy(activation, output):
    random = np.random.default_rng(7)
    sizes = [17, 20, 9, 6]
    low = np.array([-1, -0.5, -1, -0.2, -1, -1], np.float32)
    return PolicyFile(
        env_id=ID,
        parameters={"ctrl_cost_weight": "0.5"},
        activation=activation,
        output=output,
        mean=random.normal(size=17),
        deviation=random.uniform(0.01, 3, 17),
        low=low,
        high=np.array([1, 1, 0.3, 1, 1, 2], np.float32),
        layers=[
            (
                random.normal(0, 0.5, (outputs, inputs)).astype(np.float32),
                random.normal(0, 0.5, outputs).astype(np.float32),
            )
            for inputs, outputs in zip(sizes, sizes[1:])
        ],
        notes={"algorithm": "ppo"},
    )


@pytest.mark.parametrize("env_id", IDS)
def test_shipped_policy_acts_equally_in_an_episode(env_id, tmp_path, command):
    out = tmp_path / "policy.onnx"
    said = command("convert", shipped_policy(env_id), out).out
    assert said.startswith(f"{out}: {read_policy(shipped_policy(env_id)).env_id}, ")
    assert said.endswith(" on 1000 random observations (ONNX Runtime)\n")
    session = session_of(out)
    environment = gymnasium.make(f"walker_sim/{env_id}")
    observation, _ = environment.reset(seed=4)
    observations, actions, ended = [], [], False
    while not ended and len(actions) < 300:
        (found,) = session.run(None, {"observation": observation[np.newaxis]})
        assert found.dtype == np.float32
        observations.append(observation)
        actions.append(found[0])
        observation, _, terminated, truncated, _ = environment.step(found[0])
        ended = terminated or truncated
    assert len(actions) > 100
    expected = actions_of_file(shipped_policy(env_id), observations, len(actions[0]))
    assert np.abs(actions - expected).max() < TOLERANCE
    assert np.std(expected) > 0.1


@pytest.mark.parametrize("output", ["clip", "tanh"])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_graph_computes_the_documented_formula(activation, output, tmp_path, command):
    policy = small_policy(activation, output)
    write_policy(policy, tmp_path / "walker.safetensors")
    command("convert", tmp_path / "walker.safetensors", tmp_path / "walker.onnx")
    observations = np.random.default_rng(1).normal(0, 20, (200, 17))
    values = (observations - policy.mean) / policy.deviation
    assert (np.abs(values) > 10).any()
    assert (np.abs(values) < 1).any()
    values = values.clip(-10, 10)
    for index, (weight, bias) in enumerate(policy.layers):
        values = values @ weight.astype(np.float64).T + bias
        if index < 2:
            values = np.tanh(values) if activation == "tanh" else values.clip(0)
    if output == "tanh":
        values = policy.low + (policy.high - policy.low) / 2 * (np.tanh(values) + 1)
    expected = values.clip(policy.low, policy.high)
    session = session_of(tmp_path / "walker.onnx")
    (found,) = session.run(None, {"observation": observations})
    assert found.shape == (200, 6)
    assert np.abs(found - expected).max() < TOLERANCE
    assert ((found >= policy.low) & (found <= policy.high)).all()
    (one,) = session.run(None, {"observation": observations[:1]})
    assert np.abs(one - expected[:1]).max() < TOLERANCE


def test_model_has_the_environments_type_and_the_policys_metadata(tmp_path, command):
    policy = small_policy("tanh", "clip")
    write_policy(policy, tmp_path / "walker.safetensors")
    command("convert", tmp_path / "walker.safetensors", tmp_path / "walker.onnx")
    model = onnx.load(tmp_path / "walker.onnx")
    onnx.checker.check_model(model, full_check=True)
    assert {each.key: each.value for each in model.metadata_props} == {
        "id": ID,
        "parameters": '{"ctrl_cost_weight": "0.5"}',
        "algorithm": "ppo",
    }
    (entry,) = session_of(tmp_path / "walker.onnx").get_inputs()
    assert (entry.name, entry.type, entry.shape) == ("observation", "tensor(double)", ["n", 17])
    command("convert", shipped_policy("BipedalWalker-v3"), tmp_path / "other.onnx")
    (entry,) = session_of(tmp_path / "other.onnx").get_inputs()
    assert (entry.name, entry.type, entry.shape) == ("observation", "tensor(float)", ["n", 24])
    assert not [*tmp_path.glob("*.new")]


def test_onnxs_own_evaluator_replaces_the_runtime(tmp_path, command, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    said = command("convert", shipped_policy(ID), tmp_path / "policy.onnx").out
    assert said.endswith(" on 1000 random observations (onnx's reference evaluator)\n")


def test_another_policy_is_an_error(tmp_path, command, monkeypatch):
    write = onnx_file.write_onnx

    def write_another(policy, dtype, path):
        write(dataclasses.replace(policy, mean=policy.mean + 1e-3), dtype, path)

    monkeypatch.setattr(onnx_file, "write_onnx", write_another)
    said = command("convert", shipped_policy(ID), tmp_path / "policy.onnx", status=1).out
    assert said.endswith("the difference is above 1e-05: the file is another policy\n")


def test_error_names_invalid_argument(tmp_path, command):
    policy, out = shipped_policy(ID), tmp_path / "policy.onnx"
    (tmp_path / "damaged.safetensors").write_bytes(b"nothing")
    for given, words in (
        ([policy, tmp_path / "policy.zip"], "policy.zip: must end in .onnx, made of "),
        ([policy, out, "--id", ID], "--id: not allowed with "),
        ([policy, out, "--normalization", "a.pkl"], "--normalization: not allowed with "),
        ([tmp_path / "damaged.safetensors", out], "damaged.safetensors: it has 7 bytes"),
        ([tmp_path / "none.safetensors", out], "none.safetensors: no such file"),
    ):
        assert words in command("convert", *given, status=2).err
    assert not out.exists()
