"""examples/rllib_ppo.py: RLlib's env runners step WalkerVectorEnv, and PPO learns."""

import re

import gymnasium
import pytest
import running
import torch
import walker_sim  # noqa: F401  # registers the walkers
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module import RLModule

HOPPER = "walker_sim/Hopper-v5"
SIZES = ("--env", HOPPER, "--runners", 2, "--num-envs", 16, "--rollout", 64)
UPDATE = 2 * 16 * 64
POLICY = "walker_rllib/learner_group/learner/rl_module/default_policy"


@pytest.fixture(scope="module")
def learnt():
    with running.short_folder() as folder:
        steps = ("--steps", 10 * UPDATE)
        yield (
            folder,
            running.run_example(
                "rllib_ppo", *SIZES, *steps, folder=folder, **running.ray_home(folder)
            ),
        )


class TestArguments(running.Arguments):
    name, sizes, least = "rllib_ppo", SIZES, UPDATE


def test_no_walkers(tmp_path):
    text = running.run_example("rllib_ppo", "--num-envs", 0, folder=tmp_path, status=2)
    assert "--num-envs 0: must be at least 1" in text


def test_walkers_are_stepped_in_two_processes(learnt):
    _, text = learnt
    shown = re.search(
        r"^16 walkers in each of the processes \S+:(\d+) \S+:(\d+)$", text, re.MULTILINE
    )
    assert shown, text
    assert shown[1] != shown[2]


def test_learns(learnt):
    _, text = learnt
    means = running.means_of_returns(text)
    assert len(means) == 10
    # A single runner would make half of the steps.
    assert all(i * UPDATE <= steps < i * UPDATE * 1.05 for i, steps in enumerate(means, 1)), means
    first, *_, last = means.values()
    assert last > 3 * first > 0, means


def test_saved_policy_acts(learnt):
    folder, _ = learnt
    policy = RLModule.from_checkpoint(folder / POLICY)
    walker = gymnasium.make(HOPPER)
    observation, _ = walker.reset(seed=1)
    observations = torch.as_tensor(observation, dtype=torch.float32)[None]
    actions = policy.forward_inference({Columns.OBS: observations})[Columns.ACTION_DIST_INPUTS]
    assert actions.shape == (1, 2 * 3), "means and logarithms of deviations"
    assert actions.isfinite().all()
    assert actions[0, 3:].abs().max() > 0, "they began as 0"
