"""examples/cleanrl_ppo.py learns, reproducibly, and equally on Gymnasium's environments."""

import re

import gymnasium
import pytest
import torch
import walker_sim  # noqa: F401  # registers the walkers
from running import Arguments, equal, learn

OURS = "walker_sim/BipedalWalker-v3"


def mean_action(agent, observation):
    """Returns the mean of the saved agent's action distribution, clipped."""
    values = torch.as_tensor(observation, dtype=torch.float32)
    for index in (0, 2, 4):
        values = agent[f"mean.{index}.weight"] @ values + agent[f"mean.{index}.bias"]
        values = values.tanh() if index < 4 else values
    return values.clamp(-1, 1).numpy()


class TestArguments(Arguments):
    name, sizes, least = "cleanrl_ppo", ("--num-envs", 4, "--rollout", 20), 80


@pytest.mark.parametrize("env_id", [OURS, "walker_sim/Walker2d-v5"])
def test_learns_and_acts(env_id, tmp_path):
    sizes = ("--num-envs", 8, "--rollout", 128, "--steps", 2048)
    text, agent = learn("cleanrl_ppo", "--env", env_id, *sizes, folder=tmp_path)
    lines = text.splitlines()
    assert [line.split()[0] for line in lines] == ["1024", "2048"]
    assert re.search(r"mean of the last [1-9]\d* returns -?\d", lines[-1])
    assert all(values.isfinite().all() for values in agent.values())
    assert agent["log_deviation"].abs().max() > 0, "it began as 0"
    environment = gymnasium.make(env_id)
    observation, _ = environment.reset(seed=1)
    _, reward, *_ = environment.step(mean_action(agent, observation))
    assert abs(reward) < 100, "nobody falls in the first step"


def test_equal_policies_for_equal_seeds_also_on_gymnasiums_walkers(tmp_path):
    """No episode ends in these steps; Gymnasium reuses its Box2D world in a second episode."""
    sizes = ("--num-envs", 4, "--rollout", 20, "--steps", 160)

    def learnt(*arguments, **environment):
        return learn("cleanrl_ppo", *sizes, *arguments, folder=tmp_path, **environment)

    text, agent = learnt("--seed", 3)
    assert "none ended yet" in text.splitlines()[-1]
    assert equal(agent, learnt("--seed", 3)[1])
    assert not equal(agent, learnt("--seed", 4)[1])
    # NPY_PROMOTION_STATE: NumPy 1.24 promotes the reward's types like NumPy 2.
    theirs = ("--env", "BipedalWalker-v3", "--seed", 3)
    assert equal(agent, learnt(*theirs, NPY_PROMOTION_STATE="weak")[1])
