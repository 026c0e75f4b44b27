"""Policies that act on their latest observations and actions."""

import gymnasium
import numpy as np
import pytest
import walker_sim
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize
from walker_sim import _core, sb3
from walker_sim.commands.policies import acting, shipped_policy
from walker_sim.training.es import Evolution
from walker_sim.training.learner import wrap
from walker_sim.training.policy_file import read_policy, to_bytes, with_history, with_lidar
from walker_sim.training.run import Training
from walker_sim.training.settings import settings_from

ID = "Hopper-v5"
HISTORY = (3, 2)
SMALL = {
    "steps": 2000,
    "history": list(HISTORY),
    "parameters": {"max_episode_steps": 50},
    "evaluate_every": 1000,
    "evaluation_episodes": 2,
}
ES = {**SMALL, "algorithm": "es", "population": 4}
PPO_ = {**SMALL, "num_envs": 8, "rollout": 32, "batch_size": 64, "epochs": 1}


def returns_of(policy, seeds, **parameters):
    """Returns the returns of Gymnasium's interface, and those of play_out."""
    network = _core.Policy.from_bytes("policy", to_bytes(policy))
    env = gymnasium.make(f"walker_sim/{ID}", **parameters)
    stepped = []
    for seed in seeds:
        act = acting(network, network.action_size)
        observation, _ = env.reset(seed=seed)
        total, has_ended = 0.0, False
        while not has_ended:
            action = act(observation).astype(np.float32)
            observation, reward, terminated, truncated, _ = env.step(action)
            total += reward
            has_ended = terminated or truncated
        stepped.append(total)
    played = walker_sim.play_out(ID, to_bytes(policy), seeds, **parameters)
    return stepped, played.returns[0, 0].tolist()


def varied(policy):
    """Returns a policy that uses all of its input."""
    (weight, bias), *others = policy.layers
    noise = 0.05 * np.random.default_rng(0).standard_normal(weight.shape)
    policy.layers = [((weight + noise).astype(np.float32), bias), *others]
    return policy


def test_more_history_changes_no_action():
    policy = read_policy(shipped_policy(ID))
    expected = returns_of(policy, range(3))
    some = with_history(policy, HISTORY)
    assert some.history == HISTORY
    for each in (some, with_history(some, (4, 2)), with_history(some, (3, 5))):
        assert returns_of(each, range(3)) == expected
    used = varied(some)
    stepped, played = returns_of(used, range(3))
    assert stepped == played != expected[0]
    assert returns_of(with_history(used, (4, 3)), range(3)) == (stepped, played)
    with pytest.raises(ValueError, match=r"history = \[2, 5\]: must be at least \[3, 2\]"):
        with_history(used, (2, 5))


def test_the_lidar_in_the_observation_changes_no_action():
    env_id, parameters = "Walker2d-v5", {"include_lidar_in_observation": True}
    policy = with_history(read_policy(shipped_policy(env_id)), (2, 1))
    seeing = to_bytes(with_lidar(policy, 10))
    expected = walker_sim.play_out(env_id, to_bytes(policy), range(2), max_episode_steps=100)
    played = walker_sim.play_out(env_id, seeing, range(2), max_episode_steps=100, **parameters)
    assert played.returns.tolist() == expected.returns.tolist()


def walkers(num_envs=5):
    made = sb3.VecEnv(ID, num_envs, max_episode_steps=20)
    made.seed(1)
    return made


def test_observations_are_those_of_frame_stacks_and_then_actions():
    """Also the last ones of episodes, which end early or by their limit."""
    sides = [
        wrap(walkers(), settings_from({"history": history})).venv for history in ([3, 2], [3, 0])
    ] + [VecFrameStack(walkers(), 3)]
    stacks = [each.reset() for each in sides]
    size = stacks[2].shape[1]
    assert sides[0].observation_space.shape == (size + 2 * 3,)
    assert sides[1].observation_space == sides[2].observation_space
    random, acted, ends = np.random.default_rng(2), np.zeros((5, 6)), 0
    for _ in range(60):
        np.testing.assert_array_equal(stacks[1], stacks[2])
        np.testing.assert_array_equal(stacks[0], np.hstack([stacks[2], acted]))
        actions = random.uniform(-1, 1, (5, 3)).astype(np.float32)
        acted = np.hstack([acted[:, 3:], actions])
        results = [each.step(actions) for each in sides]
        stacks = [result[0] for result in results]
        for index in np.flatnonzero(results[2][2]):
            last = [result[3][index]["terminal_observation"] for result in results]
            np.testing.assert_array_equal(last[1], last[2])
            np.testing.assert_array_equal(last[0], np.hstack([last[2], acted[index]]))
            acted[index] = 0
            ends += 1
    assert ends > 10


@pytest.mark.parametrize(("kind", "given"), [(Evolution, ES), (Training, PPO_)], ids=["es", "ppo"])
@pytest.mark.parametrize("start", [None, "shipped"])
def test_is_trained_kept_and_resumed(tmp_path, kind, given, start):
    settings = settings_from({**given, "start": start})
    training = kind(ID, settings, tmp_path, num_threads=1)
    if start is not None:
        first, shipped = training.policy(), read_policy(shipped_policy(ID))
        assert returns_of(first, range(2)) == returns_of(shipped, range(2))

    def stop(training, point):
        training.wants_to_stop = training.steps >= 1000

    training.report = stop
    training.run()
    training.close()
    resumed = kind(ID, settings, tmp_path, num_threads=1)
    resumed.resume()
    resumed.run()
    resumed.close()
    assert resumed.is_complete
    policy = read_policy(tmp_path / "policy.safetensors")
    assert policy.history == HISTORY
    assert policy.layers[0][0].shape[1] == len(policy.mean) == 3 * 11 + 2 * 3
    if start is None:
        assert policy.layers[0][0].any()
    stepped, played = returns_of(policy, range(2_000_000, 2_000_002), max_episode_steps=50)
    assert stepped == played
    assert np.mean(played) == pytest.approx(resumed.best, abs=1e-6)
    again = kind(
        ID, settings_from({**given, "start": str(tmp_path / "policy.safetensors")}), tmp_path
    )
    again.close()
    assert again.policy().history == HISTORY


def test_a_model_of_frame_stacks_is_converted(tmp_path, command):
    stacked = VecNormalize(VecFrameStack(walkers(), 3))
    model = PPO("MlpPolicy", stacked, n_steps=64, seed=0, device="cpu").learn(320)
    model.save(tmp_path / "model.zip")
    stacked.save(str(tmp_path / "normal.pkl"))
    out = tmp_path / "policy.safetensors"
    given = ["--id", ID, "--normalization", tmp_path / "normal.pkl"]
    command("convert", tmp_path / "model.zip", out, *given)
    assert read_policy(out).history == (3, 0)
    network = _core.Policy(str(out))
    stacked = VecNormalize.load(str(tmp_path / "normal.pkl"), VecFrameStack(walkers(1), 3))
    stacked.training = False
    observation = stacked.reset()
    act = acting(network, network.action_size)
    newest = stacked.venv.venv.observation_space.shape[0]
    for _ in range(20):
        expected = model.predict(observation, deterministic=True)[0]
        found = act(stacked.get_original_obs()[0, -newest:])
        np.testing.assert_allclose(found, expected[0], atol=1e-5)
        observation, _, dones, _ = stacked.step(expected)
        if dones[0]:
            break


@pytest.mark.parametrize("history", [3, [0, 1], [1, -1], [1], [1, 0.5]])
def test_settings_refuse_another_history(history):
    with pytest.raises(ValueError, match="history = "):
        settings_from({"history": history})
