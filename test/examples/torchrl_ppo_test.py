"""examples/torchrl_ppo.py: TorchRL resets the vector environment, and PPO learns."""

import torch
from running import assert_helps, assert_refuses_too_few_steps, means_of_returns, run_example

HOPPER = ("--env", "walker_sim/Hopper-v5")


def learn(folder, *arguments):
    text = run_example("torchrl_ppo", *arguments, folder=folder)
    return text, torch.load(folder / "walker.pt")


def equal(one, other):
    assert one.keys() == other.keys()
    return all(torch.equal(one[name], other[name]) for name in one)


def test_help(tmp_path):
    assert_helps("torchrl_ppo", tmp_path)


def test_too_few_steps(tmp_path):
    sizes = ("--num-envs", 4, "--rollout", 20)
    assert_refuses_too_few_steps("torchrl_ppo", tmp_path, *sizes, least=80)


def test_learns(tmp_path):
    sizes = ("--num-envs", 32, "--rollout", 64)
    text, policy = learn(tmp_path, *HOPPER, *sizes, "--steps", 10 * 32 * 64)
    means = means_of_returns(text)
    assert list(means) == [32 * 64 * i for i in range(1, 11)], text
    first, *_, last = means.values()
    assert last > 3 * first > 0, means
    assert all(values.isfinite().all() for values in policy.values())


def test_equal_policies_for_equal_seeds(tmp_path):
    sizes = ("--num-envs", 4, "--rollout", 128, "--steps", 1024)
    text, policy = learn(tmp_path, *sizes, "--seed", 3)
    assert text.splitlines()[-1].startswith("1024 steps, mean of the last "), text
    assert equal(policy, learn(tmp_path, *sizes, "--seed", 3)[1])
    assert not equal(policy, learn(tmp_path, *sizes, "--seed", 4)[1])
