"""convert: an ONNX graph that is written from a policy file acts as the policy does."""

import dataclasses
import sys

import numpy as np
import onnx
import onnxruntime
import pytest
from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.training import onnx_file
from walker_sim.training.policy_file import read_policy, with_history, write_policy

ID = "Walker2d-v5"
TOLERANCE = 1e-5  # the command's


def session_of(path):
    return onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])


def changed_policy(activation, output):
    policy = read_policy(shipped_policy(ID))
    *layers, (weight, bias) = policy.layers
    return dataclasses.replace(
        policy,
        layers=[*layers, (weight / 4, bias / 4)],  # so that not all actions are clipped
        parameters={"ctrl_cost_weight": "0.5"},
        activation=activation,
        output=output,
        low=np.array([-1, -0.5, -1, -0.2, -1, -1], np.float32),
        high=np.array([1, 1, 0.3, 1, 1, 2], np.float32),
        notes={"algorithm": "ppo"},
    )


@pytest.mark.parametrize("env_id", _core.ids())
def test_round_trip_of_shipped_policy(env_id, tmp_path, command):
    """The ONNX file, whose actions are compared, names the environment and gives the same file."""
    out = tmp_path / "policy.onnx"
    said = command("convert", shipped_policy(env_id), out).out
    assert said.startswith(f"{out}: {read_policy(shipped_policy(env_id)).env_id}, ")
    assert said.endswith(" on 1000 random observations (ONNX Runtime)\n")
    words = ["convert", out, tmp_path / "again.safetensors"]
    command(*words)
    assert (tmp_path / "again.safetensors").read_bytes() == shipped_policy(env_id).read_bytes()
    error = command(*words, "--normalization", "a.pkl", status=2).err
    assert "--normalization a.pkl is not allowed" in error


def test_round_trip_of_a_policy_that_remembers(tmp_path, command):
    policy = with_history(read_policy(shipped_policy(ID)), (3, 2))
    (weight, bias), *others = policy.layers
    noise = np.random.default_rng(0).normal(0, 0.01, weight.shape).astype(np.float32)
    policy.layers = [(weight + noise, bias), *others]
    files = [tmp_path / name for name in ("walker.safetensors", "walker.onnx", "again.safetensors")]
    write_policy(policy, files[0])
    command("convert", *files[:2])
    assert session_of(files[1]).get_inputs()[0].shape == ["n", 3 * 17 + 2 * 6]
    command("convert", *files[1:])
    assert files[2].read_bytes() == files[0].read_bytes()


@pytest.mark.parametrize("output", ["clip", "tanh"])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_graph_computes_the_documented_formula(activation, output, tmp_path, command):
    policy = changed_policy(activation, output)
    policy.parameters["frame_skip"] = "3"
    files = [tmp_path / f"walker.{suffix}" for suffix in ("safetensors", "onnx")]
    write_policy(policy, files[0])
    command("convert", *files)
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
    session = session_of(files[1])
    (found,) = session.run(None, {"observation": observations})
    assert found.shape == (200, 6)
    assert np.abs(found - expected).max() < TOLERANCE
    assert ((found >= policy.low) & (found <= policy.high)).all()
    (one,) = session.run(None, {"observation": observations[:1]})
    assert np.abs(one - expected[:1]).max() < TOLERANCE
    command("convert", files[1], tmp_path / "again.safetensors")
    assert (tmp_path / "again.safetensors").read_bytes() == files[0].read_bytes()


def test_model_has_the_environments_type_and_the_policys_metadata(tmp_path, command):
    write_policy(changed_policy("tanh", "clip"), tmp_path / "walker.safetensors")
    for policy, element, size in (
        (shipped_policy("BipedalWalker-v3"), "float", 24),
        (tmp_path / "walker.safetensors", "double", 17),
    ):
        command("convert", policy, tmp_path / "walker.onnx")
        (entry,) = session_of(tmp_path / "walker.onnx").get_inputs()
        form = (entry.name, entry.type, entry.shape)
        assert form == ("observation", f"tensor({element})", ["n", size])
    model = onnx.load(tmp_path / "walker.onnx")
    onnx.checker.check_model(model, full_check=True)
    assert {each.key: each.value for each in model.metadata_props} == {
        "id": ID,
        "parameters": '{"ctrl_cost_weight": "0.5"}',
        "algorithm": "ppo",
    }
    assert not [*tmp_path.glob("*.new")]


def test_onnxs_own_evaluator_replaces_the_runtime(tmp_path, command, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    said = command("convert", shipped_policy(ID), tmp_path / "policy.onnx").out
    assert said.endswith(" on 1000 random observations (onnx's reference evaluator)\n")


def test_another_policy_is_an_error(tmp_path, command, monkeypatch):
    make = onnx_file.to_model

    def make_another(policy, dtype):
        return make(dataclasses.replace(policy, mean=policy.mean + 1e-3), dtype)

    monkeypatch.setattr(onnx_file, "to_model", make_another)
    out = tmp_path / "policy.onnx"
    out.write_bytes(b"earlier")
    said = command("convert", shipped_policy(ID), out, status=1).out
    assert said.endswith(f"is above 1e-05, so {out} is not written\n")
    assert out.read_bytes() == b"earlier"


def test_error_names_invalid_argument(tmp_path, command):
    policy, out = shipped_policy(ID), tmp_path / "policy.onnx"
    for given, words in (
        ([policy, tmp_path / "policy.zip"], "policy.zip: must end in .onnx if made from "),
        ([policy, out, "--id", ID], "--id: not allowed with "),
        ([policy, out, "--normalization", "a.pkl"], "--normalization: not allowed with "),
        ([tmp_path / "none.safetensors", out], "none.safetensors: no such file"),
    ):
        assert words in command("convert", *given, status=2).err
    assert not out.exists()
