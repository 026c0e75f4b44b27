"""EnvPool's step(actions, env_id) equals single environments to the bit."""

import time

import numpy as np
import pytest
from walkers import MODES, assert_same, make_many, make_sync

NUM_ENVS = 5
PATIENCE = 60.0  # timeout that only a failing test reaches [s]
LIMITS = {"BipedalWalker-v3": 70, "Walker2d-v5": 20, "Hopper-v5": 20}


def infos_of(infos, row):
    """Returns a row of infos without absent ones and masks, which a single environment lacks."""
    kept = {}
    for name, value in infos.items():
        if name == "env_id" or name.startswith("_") or not infos[f"_{name}"][row]:
            continue
        kept[name] = infos_of(value, row) if isinstance(value, dict) else value[row : row + 1]
    return kept


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("environment_id", LIMITS)
def test_equals_single_environments(environment_id, mode):
    limit = {"max_episode_steps": LIMITS[environment_id]}
    ours = make_many(environment_id, NUM_ENVS, autoreset_mode=mode, **limit)
    name = f"walker_sim/{environment_id}"
    theirs = [make_sync(name, 1, mode, **limit) for _ in range(NUM_ENVS)]
    random = np.random.default_rng(2)
    observations, _ = ours.reset(seed=7)
    for index, single in enumerate(theirs):
        assert single.reset(seed=7 + index)[0][0].tobytes() == observations[index].tobytes()
    num_ends, ended = 0, np.zeros(NUM_ENVS, bool)
    for _ in range(400):
        if mode == "disabled" and ended.any():
            observations, _ = ours.reset(options={"reset_mask": ended.copy()})
            for index in ended.nonzero()[0]:
                options = {"reset_mask": np.array([True])}
                first = theirs[index].reset(options=options)[0][0]
                assert first.tobytes() == observations[index].tobytes()
            ended[:] = False
        env_id = random.permutation(NUM_ENVS)[: random.integers(1, NUM_ENVS + 1)]
        actions = random.uniform(-1.5, 1.5, (len(env_id), *ours.single_action_space.shape))
        actions = actions.astype(np.float32)
        outcome = ours.step(actions, env_id)
        assert outcome[4]["env_id"].tolist() == env_id.tolist()
        assert outcome[4]["env_id"].dtype == np.int32
        assert outcome[0].dtype == ours.observation_space.dtype
        for row, index in enumerate(env_id):
            *expected, infos = theirs[index].step(actions[row : row + 1])
            assert_same([array[row : row + 1] for array in outcome[:4]], expected)
            assert_same(infos_of(outcome[4], row), infos_of(infos, 0))
        ends = outcome[2] | outcome[3]
        ended[env_id] |= ends
        num_ends += ends.sum()
    assert num_ends > 10


def test_with_a_batch_size():
    """As in EnvPool, other environments may still be stepping."""
    envs = make_many("BipedalWalker-v3", NUM_ENVS, batch_size=2, num_threads=2)
    envs.async_reset(seed=1)
    steps = np.zeros(NUM_ENVS, int)
    *_, infos = envs.recv()
    rounds, deadline = 0, time.monotonic() + PATIENCE
    # A thread that is not scheduled delays its environments, so 60 rounds may not reach all.
    while rounds < 60 or (not steps.all() and time.monotonic() < deadline):
        rounds += 1
        env_id = infos["env_id"]
        steps[env_id] += 1
        observations, *_, infos = envs.step(np.zeros((2, 4), np.float32), env_id)
        assert observations.shape == (2, 24) and len({*infos["env_id"]}) == 2
    assert steps.sum() == 2 * rounds and steps.all()
