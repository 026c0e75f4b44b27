"""Episodes over ROS equal those in process and Gymnasium's BipedalWalker to the bit."""

import numpy as np
import pytest
import walker_sim
from walkers import (
    IDS,
    MODES,
    assert_same,
    follow,
    make_many,
    make_ours,
    make_reference,
    overflowing,
    play_both,
    random_actions,
)

LARGEST_SEED = 2**64 - 1
NUM_ENVS = 3
# Some episodes terminate before, some do not.
LIMITS = {"BipedalWalker-v3": 60, "Walker2d-v5": 20, "Hopper-v5": 20}


@pytest.mark.parametrize(
    ("environment_id", "keywords"),
    [
        *((environment_id, {}) for environment_id in IDS),
        ("Walker2d-v5", {"include_lidar_in_observation": True}),
    ],
)
def test_single(serve, environment_id, keywords):
    server, _ = serve(environment_id, **keywords)
    remote = make_ours(environment_id, transport="ros", server=server, **keywords)
    local = make_ours(environment_id, **keywords)
    assert remote.observation_space == local.observation_space
    assert remote.action_space == local.action_space
    assert remote.unwrapped.dt == local.unwrapped.dt
    for seed in (0, LARGEST_SEED):
        theirs, ours = local.reset(seed=seed), remote.reset(seed=seed)
        assert_same(ours, theirs)
        actions = random_actions(environment_id, 200, seed % 5)
        outcomes = follow(remote, actions)
        assert outcomes == follow(local, actions)
        assert all(type(value) is float for value in (outcomes[0][1], *outcomes[0][4].values()))
        assert type(outcomes[0][2]) is type(outcomes[0][3]) is bool


@pytest.mark.parametrize("environment_id", IDS[:2])
def test_single_is_gymnasiums(serve, environment_id):
    """Gymnasium keeps its world between episodes."""
    server, _ = serve(environment_id, reuse_world="true")
    remote = make_ours(environment_id, transport="ros", server=server, reuse_world=True)
    theirs = make_reference(environment_id)
    for seed in (0, 7, LARGEST_SEED):
        assert_same(remote.reset(seed=seed), theirs.reset(seed=seed))
        actions = random_actions(environment_id, 400, seed % 5)
        assert follow(remote, actions) == follow(theirs, actions)


def make_pair(serve, environment_id, num_envs=NUM_ENVS, **options):
    """Makes vector environments over ROS and in process."""
    server, _ = serve(environment_id, num_envs=num_envs, **options)
    remote = make_many(environment_id, num_envs, transport="ros", server=server, **options)
    return remote, make_many(environment_id, num_envs, **options)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("environment_id", LIMITS)
def test_vectorised(serve, environment_id, mode):
    limit = LIMITS[environment_id]
    remote, local = make_pair(serve, environment_id, autoreset_mode=mode, max_episode_steps=limit)
    seeds = [5, LARGEST_SEED, 6]
    assert play_both(remote, local, 4 * limit, seeds)[0] > NUM_ENVS
    options = {"reset_mask": np.array([True, False, True])}
    again = remote.reset(seed=seeds, options=options), local.reset(seed=seeds, options=options)
    assert_same(*again)
    actions = np.zeros(remote.action_space.shape, np.float32)
    assert_same(remote.step(actions), local.step(actions))


def test_one_walker_as_a_batch(serve):
    remote, local = make_pair(serve, "BipedalWalker-v3", 1, max_episode_steps=10)
    assert_same(remote.reset(seed=LARGEST_SEED), local.reset(seed=LARGEST_SEED))
    for action in random_actions("BipedalWalker-v3", 25):
        assert_same(remote.step(action[None]), local.step(action[None]))


@pytest.mark.parametrize("mode", MODES)
def test_failures_of_the_engine(serve, tmp_path, mode):
    parameters = {**overflowing(tmp_path), "max_episode_steps": 20}
    remote, local = make_pair(serve, "Walker2d-v5", 20, autoreset_mode=mode, **parameters)
    result = remote.reset(seed=0)
    assert_same(result, local.reset(seed=0))
    failed = result[1]["_error"]
    assert 0 < failed.sum() < 20
    actions = np.full((20, 6), 0.5, np.float32)
    if mode == "disabled":
        words = f"environment {failed.argmax()}: the simulation failed at its reset; reset first"
        for environments in (local, remote):
            with pytest.raises(walker_sim.ResetNeeded, match=words):
                environments.step(actions)
        return
    for number in range(60):
        assert_same(remote.step(actions), local.step(actions), number)
