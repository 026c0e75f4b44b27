"""`evaluate` with a Stable-Baselines3 model and its VecNormalize statistics plays the same episodes
as Stable-Baselines3, also if the model has a memory."""

import pickle

import gymnasium
import numpy as np
import pytest
import walker_sim  # noqa: F401  # registers the ids
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from walker_sim.sb3 import VecEnv
from walkers import returns_of

ID = "BipedalWalker-v3"
SEEDS = [4, 0, 7]
LIMIT = 120


@pytest.fixture(scope="module", params=[PPO, SAC, RecurrentPPO], ids=lambda kind: kind.__name__)
def learnt(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("learnt")
    walkers = VecNormalize(VecEnv(ID, 2), clip_obs=2.0)
    sizes = {"learning_starts": 50} if request.param is SAC else {"n_steps": 128}
    network = "MlpLstmPolicy" if request.param is RecurrentPPO else "MlpPolicy"
    model = request.param(network, walkers, seed=1, device="cpu", **sizes)
    model.learn(512)
    if request.param is RecurrentPPO:  # whose memory would hardly change an action yet
        model.policy.action_net.weight.data *= 100
    model.save(folder / "model.zip")
    walkers.save(str(folder / "vec_normalize.pkl"))
    return request.param, folder


def returns_by_stable_baselines3(kind, folder):
    def make():
        return gymnasium.make(f"walker_sim/{ID}", max_episode_steps=LIMIT)

    walkers = VecNormalize.load(str(folder / "vec_normalize.pkl"), DummyVecEnv([make]))
    walkers.training, walkers.norm_reward = False, False
    model = kind.load(folder / "model.zip", device="cpu")
    returns = []
    for seed in SEEDS:
        walkers.seed(seed)
        observations, done, total, memory = walkers.reset(), [False], 0.0, None
        while not done[0]:
            actions, memory = model.predict(observations, memory, deterministic=True)
            observations, rewards, done, _ = walkers.step(actions)
            total += float(rewards[0])
        returns.append(total)
    return returns


def test_evaluate_equals_stable_baselines3(learnt, evaluate):
    kind, folder = learnt
    statistics = folder / "vec_normalize.pkl"
    words = [ID, "--policy", folder / "model.zip", f"max_episode_steps={LIMIT}"]
    words += ["--seeds", ",".join(map(str, SEEDS))]
    _, found = evaluate(*words, "--normalization", statistics)
    returns = returns_of(found)
    # Stable-Baselines3's rewards are float32.
    assert np.allclose(returns, returns_by_stable_baselines3(kind, folder), rtol=0, atol=1e-3)
    assert found["policy"] == f"{folder / 'model.zip'} with {statistics}"
    assert returns != returns_of(evaluate(*words)[1]), "without the statistics it is another policy"


def test_error_names_invalid_statistics(learnt, tmp_path, command):
    _, folder = learnt
    (tmp_path / "other.pkl").write_bytes(pickle.dumps({"mean": 0}))
    (tmp_path / "garbage.pkl").write_bytes(b"nothing")
    VecNormalize(VecEnv("Hopper-v5", 1)).save(str(tmp_path / "hopper.pkl"))
    for name, words in (
        ("other", "not a VecNormalize, but dict"),
        ("garbage", "not a VecNormalize: "),
        ("none", "not a VecNormalize: [Errno 2] No such file or directory"),
        ("hopper", "has shape (11,); must be (24,)"),
    ):
        path = tmp_path / f"{name}.pkl"
        model = ["--policy", folder / "model.zip", "--normalization", path]
        error = command("evaluate", ID, *model, status=2).err
        assert error.startswith(f"walker_sim evaluate: --normalization {path}: {words}")
