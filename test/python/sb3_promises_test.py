"""Each script gives VecEnv the oracle's trace, to the bit."""

import re
import struct

import numpy as np
import promises
import pytest
from gymnasium_interfaces import GroupWalkers
from promises import (
    ALL,
    CASES,
    NUM_WALKERS,
    SCRIPTS,
    check,
    resets_all,
    sets_coordinates,
    write_model,
)
from walker_sim.sb3 import VecEnv
from walkers import through_pickle


class VecEnvWalkers(GroupWalkers):
    """VecEnv; its rewards are float32, and an episode that terminates is not truncated."""

    def __init__(self, case, keywords):
        envs = VecEnv(case.env_id, NUM_WALKERS, **keywords)
        super().__init__(case, envs, keywords, copied=through_pickle)

    def reported(self, line):
        def rounded(match):
            (reward,) = struct.unpack(">d", bytes.fromhex(match[1]))
            return f"reward={promises.hexadecimal(np.float32(reward))}"

        line = re.sub("reward=([0-9a-f]+)", rounded, line)
        return line.replace(" terminated truncated", " terminated")

    def reset(self, walkers, seed=None):
        assert walkers == ALL
        if seed is not None:
            self.envs.seed(seed)
        observations = self.envs.reset()
        for i in ALL:
            self.add_reset(i, observations[i], self.envs.reset_infos[i])

    def step(self, actions):
        observations, rewards, dones, infos = self.envs.step(np.array(actions, np.float32))
        for i in ALL:
            if self.has_ended[i]:
                self.add_reset(i, observations[i], self.envs.reset_infos[i])
                continue
            last = infos[i].get("terminal_observation", observations[i])
            truncated = infos[i]["TimeLimit.truncated"]
            terminated = dones[i] and not truncated
            self.add_step(i, last, rewards[i], terminated, truncated, infos[i])
            if dones[i]:
                self.add_reset(i, observations[i], self.envs.reset_infos[i])


@pytest.mark.parametrize(
    "script", [s for s in SCRIPTS if resets_all(s) and not sets_coordinates(s)]
)
@pytest.mark.parametrize("case", CASES)
def test_cell(case, script, tmp_path):
    check(script, CASES[case], VecEnvWalkers(CASES[case], write_model(CASES[case], tmp_path)))
