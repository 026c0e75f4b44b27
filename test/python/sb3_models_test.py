"""convert: a policy file that is made of a model of Stable-Baselines3 acts as the model does."""

import numpy as np
import pytest
import torch
from sb3_contrib import TQC, CrossQ, RecurrentPPO
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize
from walker_sim.sb3 import VecEnv
from walker_sim.training.models import load_sb3
from walkers import actions_of

ID = "BipedalWalker-v3"


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


class MyPolicy(ActorCriticPolicy):
    pass


@pytest.mark.parametrize(
    ("algorithm", "network"),
    [
        *((algorithm, "MlpPolicy") for algorithm in (PPO, A2C, SAC, TQC, TD3, CrossQ)),
        (PPO, MyPolicy),
        (RecurrentPPO, "MlpLstmPolicy"),
    ],
)
def test_loads_and_converts_sb3_models(tmp_path, command, algorithm, network):
    walkers = VecNormalize(VecEnv(ID, 2))
    walkers.reset()
    for _ in range(50):
        walkers.step(np.random.default_rng(0).uniform(-1, 1, (2, 4)))
    model = algorithm(network, walkers, policy_kwargs={"net_arch": [32, 32]}, seed=3)
    model.save(tmp_path / "model.zip")
    assert load_sb3(tmp_path / "model.zip")[0] == algorithm.__name__
    walkers.save(tmp_path / "normal.pkl")
    out = tmp_path / "walker.safetensors"
    given = [tmp_path / "model.zip", out, "--id", f"walker_sim/{ID}"]
    given += ["--normalization", tmp_path / "normal.pkl"]
    if algorithm in (TD3, CrossQ, RecurrentPPO):
        error = command("convert", *given, status=2).err
        assert f"of {algorithm.__name__}; must be of PPO, A2C, SAC or TQC" in error
        return
    assert "actions differ by at most" in command("convert", *given).out
    observations = np.random.default_rng(1).normal(0, 1, (200, 24))
    expected = model.predict(walkers.normalize_obs(observations), deterministic=True)[0]
    assert np.allclose(actions_of(out, observations), expected, rtol=0, atol=1e-6)


def test_error_names_unsupported_model(tmp_path, command):
    class Elu(torch.nn.ELU):
        pass

    model = PPO("MlpPolicy", VecEnv(ID, 1), policy_kwargs={"activation_fn": Elu})
    model.save(tmp_path / "model.zip")
    (tmp_path / "other.zip").write_bytes(b"nothing")
    (tmp_path / "other.onnx").write_bytes(b"nothing")
    out = tmp_path / "walker.safetensors"
    for name, words in (
        ("model.zip", "Elu; must be Linear, Tanh or ReLU"),
        ("other.zip", "not a model saved by Stable-Baselines3"),
        ("other.onnx", "ONNX"),
        ("none.zip", "no such file"),
        ("model.pt", "no such file"),
    ):
        error = command("convert", tmp_path / name, out, "--id", ID, status=2).err
        assert words in error
        assert name in error
    assert not out.exists()
    error = command("convert", tmp_path / "model.zip", "walker.bin", status=2).err
    assert "walker.bin: must end in" in error
    torch.set_num_threads(2)
    given = ["--policy", tmp_path / "model.zip"]
    error = command("evaluate", "Hopper-v5", *given, status=2).err
    assert "have shapes (24,) and (4,); must be (11,) and (3,)" in error
    assert torch.get_num_threads() == 1  # more would wait for each other
