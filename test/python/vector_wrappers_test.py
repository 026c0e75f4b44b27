"""Gymnasium's wrappers of vector environments around WalkerVectorEnv."""

import numpy as np
import pytest
from gymnasium.wrappers import vector as wrappers
from walkers import assert_same, make_many, make_sync

NUM_ENVS = 3

WRAPPERS = {
    "RecordEpisodeStatistics": wrappers.RecordEpisodeStatistics,
    "NormalizeObservation": wrappers.NormalizeObservation,
    "NormalizeReward": wrappers.NormalizeReward,
    "ClipReward": lambda envs: wrappers.ClipReward(envs, -0.1, 0.1),
    "ClipAction": wrappers.ClipAction,
    "RescaleAction": lambda envs: wrappers.RescaleAction(
        envs, np.full(6, -2, np.float32), np.full(6, 2, np.float32)
    ),
    "FlattenObservation": wrappers.FlattenObservation,
    "DictInfoToList": wrappers.DictInfoToList,
    "several": lambda envs: wrappers.NormalizeObservation(
        wrappers.NormalizeReward(wrappers.RecordEpisodeStatistics(envs))
    ),
}
NEXT_STEP_ONLY = ("NormalizeObservation", "FlattenObservation", "several")


def without_times(result):
    if isinstance(result[-1], dict) and "episode" in result[-1]:
        result[-1]["episode"].pop("t", None)
    return result


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
@pytest.mark.parametrize("name", WRAPPERS)
def test_wrappers_give_equal_results(name, mode):
    sides = [
        make_many("Walker2d-v5", NUM_ENVS, autoreset_mode=mode, max_episode_steps=20),
        make_sync("Walker2d-v5", NUM_ENVS, mode, max_episode_steps=20),
    ]
    if mode == "same_step" and name in NEXT_STEP_ONLY:
        for side in sides:
            with pytest.raises((ValueError, AssertionError)):
                WRAPPERS[name](side)
        return
    sides = [WRAPPERS[name](side) for side in sides]
    random = np.random.default_rng(2)
    assert_same(*(side.reset(seed=3) for side in sides))
    num_ended = 0
    for number in range(80):
        actions = random.uniform(-1, 1, sides[0].action_space.shape).astype(np.float32)
        results = [without_times(side.step(actions.copy())) for side in sides]
        assert_same(*results, number)
        num_ended += (results[0][2] | results[0][3]).sum()
    assert num_ended > 5
    for side in sides:
        side.close()
