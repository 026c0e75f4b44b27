"""examples/torchrl_ppo.py: TorchRL resets the vector environment, and PPO learns."""

from running import Arguments, equal, learn, means_of_returns

HOPPER = ("--env", "walker_sim/Hopper-v5")


class TestArguments(Arguments):
    name, sizes, least = "torchrl_ppo", ("--num-envs", 4, "--rollout", 20), 80


def test_learns(tmp_path):
    sizes = ("--num-envs", 32, "--rollout", 64)
    steps = ("--steps", 10 * 32 * 64)
    text, policy = learn("torchrl_ppo", *HOPPER, *sizes, *steps, folder=tmp_path)
    means = means_of_returns(text)
    assert list(means) == [32 * 64 * i for i in range(1, 11)], text
    first, *_, last = means.values()
    assert last > 3 * first > 0, means
    assert all(values.isfinite().all() for values in policy.values())


def test_equal_policies_for_equal_seeds(tmp_path):
    sizes = ("--num-envs", 4, "--rollout", 128, "--steps", 1024)
    text, policy = learn("torchrl_ppo", *sizes, "--seed", 3, folder=tmp_path)
    assert text.splitlines()[-1].startswith("1024 steps, mean of the last "), text
    for seed in (3, 4):
        again = learn("torchrl_ppo", *sizes, "--seed", seed, folder=tmp_path)[1]
        assert equal(policy, again) == (seed == 3)
