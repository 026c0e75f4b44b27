"""examples/sb3_ppo.py: the saved policy loads and acts equally in process and over ROS."""

import os
import pathlib
import re

import numpy as np
import pytest
from processes import Master
from running import Arguments, run_example
from stable_baselines3 import PPO
from walker_sim.sb3 import VecEnv

NUM_ENVS = 4
SIZES = ("--num-envs", NUM_ENVS, "--rollout", 32, "--episodes", 4)
EVALUATED = re.compile(r"^return (\S+) \+- \S+ over 4 episodes$", re.MULTILINE)


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learnt")
    return folder, run_example("sb3_ppo", *SIZES, "--steps", 256, folder=folder)


class TestArguments(Arguments):
    name, sizes, least = "sb3_ppo", SIZES, NUM_ENVS * 32


def test_learns_with_a_progress_bar(learnt):
    folder, text = learnt
    assert "256/256" in text, "the progress bar's end"
    assert re.search(r"total_timesteps *\| 256 ", text)
    assert EVALUATED.search(text)
    model = PPO.load(folder / "walker.zip", device="cpu")
    assert model.num_timesteps == 256
    observations = VecEnv("BipedalWalker-v3", NUM_ENVS).reset()
    actions, _ = model.predict(observations, deterministic=True)
    assert actions.shape == (NUM_ENVS, 4)
    assert np.isfinite(actions).all()
    assert np.abs(actions).max() <= 1


def test_loaded_policy_does_the_same(learnt):
    folder, text = learnt
    again = run_example("sb3_ppo", *SIZES, "--load", "walker.zip", folder=folder)
    assert EVALUATED.search(again)[0] == EVALUATED.search(text)[0]


def test_loaded_policy_does_the_same_over_ros(learnt):
    folder, text = learnt
    programs = pathlib.Path(os.environ["WALKER_SIM_PROGRAMS"])
    options = {"num_envs": NUM_ENVS, "autoreset_mode": "same_step"}
    with Master(programs, exports=True) as master:
        server = master.server(env="BipedalWalker-v3", **options)
        where = ("--transport", "ros", "--server", server.name)
        remote = run_example("sb3_ppo", *SIZES, "--load", "walker.zip", *where, folder=folder)
    assert EVALUATED.search(remote)[0] == EVALUATED.search(text)[0]
