"""WalkerVectorEnv has the bits, types and infos of the installed SyncVectorEnv.

The reference steps Gymnasium's BipedalWalker, compared with reuse_world because it keeps its world
between episodes, and this package's single environments. promises_test.py has the bits of all ids.
"""

import time

import numpy as np
import pytest
import walker_sim
from gymnasium.wrappers import vector as wrappers
from mujoco_reference import MODELS
from walkers import (
    MODES,
    OVERFLOW,
    assert_same,
    diverging,
    make_many,
    make_sync,
    overflowing,
    play_both,
    set_world,
)
from worlds_test import ALL

NUM_ENVS = 5
NUM_STEPS = 400
PATIENCE = 60.0  # timeout that only a failing test reaches [s]
# Some episodes terminate before the limit, some do not.
GYMNASIUMS = ("BipedalWalker-v3", 90, {"reuse_world": True})
BIPEDAL_WALKER = ("walker_sim/BipedalWalker-v3", 90, {})
WALKER2D = ("walker_sim/Walker2d-v5", 25, {})


def worlds_of(case):
    """Returns worlds for the walkers of this package, none for Gymnasium's."""
    name = case[0].partition("/")[2]
    if not name:
        return None
    return [None, ALL[name], "moon", {"gravity": (-20, -5)}, {**ALL[name], "dropout": 0.9}]


def make_ours(name, mode="next_step", limit=None, **options):
    options = {"autoreset_mode": mode, "max_episode_steps": limit, **options}
    return make_many(name.split("/")[-1], NUM_ENVS, **options)


def make_pair(case, mode, world=None, **options):
    name, limit, parameters = case
    parameters_of_theirs = parameters if "/" in name else {}
    theirs = make_sync(name, NUM_ENVS, mode, max_episode_steps=limit, **parameters_of_theirs)
    if world:
        set_world(theirs, world)
    return make_ours(name, mode, limit, world=world, **options, **parameters), theirs


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "case", [GYMNASIUMS, BIPEDAL_WALKER, WALKER2D], ids=["Gymnasium's", "BipedalWalker", "Walker2d"]
)
def test_equals_sync_vector_env(case, mode):
    worlds = worlds_of(case)
    ours, theirs = make_pair(case, mode, worlds, num_threads=3)
    changes = {}
    if worlds:
        assert ours.get_attr("world") == theirs.get_attr("world")
        changes = {150: (["slippery", None, "noisy"], [0, 1, 4]), 250: ("laggy",)}
    assert play_both(ours, theirs, NUM_STEPS, changes).min() > 1
    assert ours.np_random_seed == theirs.np_random_seed
    states = [[one.bit_generator.state for one in side.np_random] for side in (ours, theirs)]
    assert states[0] == states[1]


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_walker2d_equals_gymnasiums(mode, tmp_path):
    """Another MuJoCo version's solver stops at another iterate unless its tolerance is 0 (see
    episodes_gymnasium_test.py). The episodes are too short for the remaining difference to grow."""
    converging = tmp_path / "converging.xml"
    model = MODELS["Walker2d-v5"].read_text()
    converging.write_text(model.replace("<option ", '<option tolerance="0" ', 1))
    parameters = {"xml_file": str(converging)}
    theirs = make_sync("Walker2d-v5", NUM_ENVS, mode, max_episode_steps=10, **parameters)
    ours = make_ours("Walker2d-v5", mode, 10, **parameters)
    random = np.random.default_rng(3)
    assert_same(ours.reset(seed=5), theirs.reset(seed=5), near=1e-9)
    for number in range(50):
        actions = random.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        assert_same(ours.step(actions), theirs.step(actions), number, near=1e-9)


@pytest.mark.parametrize("mode", MODES)
def test_a_failed_step(mode, tmp_path):
    case = ("walker_sim/Walker2d-v5", None, diverging(tmp_path))
    ours, theirs = make_pair(case, mode)
    assert_same(ours.reset(seed=1), theirs.reset(seed=1))
    actions = np.zeros(ours.action_space.shape, np.float32)
    actions[2] = 1
    result = ours.step(actions)
    assert_same(result, theirs.step(actions))
    infos = result[-1]["final_info"] if mode == "same_step" else result[-1]
    assert infos["_error"].tolist() == [False, False, True, False, False]
    assert infos["error"][2].startswith("MuJoCo: ")
    ours = make_ours(case[0], mode, **case[2])
    ours.reset(seed=1)
    ours.send(actions)
    assert_same(in_order_of_env_id(ours.recv()), result)


def sorted_seeds(parameters):
    """Returns the seeds below 40 with which a single environment's reset succeeds, and fails."""
    walker = walker_sim.WalkerEnv("Walker2d-v5", **parameters)
    good, bad = [], []
    for seed in range(40):
        try:
            walker.reset(seed=seed)
        except RuntimeError as error:
            assert str(error) == OVERFLOW
            bad.append(seed)
        else:
            good.append(seed)
    assert len(good) > 5 and bad
    return good, bad


@pytest.mark.parametrize("mode", MODES)
def test_the_rows_of_failed_resets(mode, tmp_path):
    parameters = overflowing(tmp_path)
    good, bad = sorted_seeds(parameters)
    ours = make_ours("Walker2d-v5", mode, 4, **parameters)
    observations, infos = ours.reset(seed=[*good[:2], bad[0], *good[2:4]])
    assert infos["_error"].tolist() == [False, False, True, False, False]
    assert infos["error"].tolist() == [None, None, OVERFLOW, None, None]
    assert infos["_x_position"].tolist() == [True, True, False, True, True]
    assert not observations[2].any()
    actions = np.full(ours.action_space.shape, 0.5, np.float32)
    if mode == "disabled":
        words = "environment 2: the simulation failed at its reset; reset first"
        with pytest.raises(walker_sim.ResetNeeded, match=words):
            ours.step(actions)
        infos = ours.reset(seed=good[4], options={"reset_mask": np.arange(5) == 2})[1]
        assert "error" not in infos
        return
    failures = 0
    for _ in range(30):
        observations, _, terminated, truncated, infos = ours.step(actions)
        failed = infos.get("_error", np.zeros(5, bool)) & (infos.get("error") == OVERFLOW)
        for walker in failed.nonzero()[0]:
            if mode == "same_step":  # in other modes a step may have failed
                assert not observations[walker].any()
            assert terminated[walker] or truncated[walker]
            failures += 1
    assert failures


def test_recv_reports_failed_resets(tmp_path):
    parameters = overflowing(tmp_path)
    _, bad = sorted_seeds(parameters)
    for mode in MODES:
        ours = make_ours("Walker2d-v5", mode, 4, **parameters)
        ours.async_reset(seed=[bad[0]] * 5)
        observations, rewards, terminated, truncated, infos = ours.recv()
        assert not observations.any() and not rewards.any() and not truncated.any()
        assert terminated.all()
        assert infos["error"].tolist() == [OVERFLOW] * 5
        if mode == "same_step":
            assert infos["_final_obs"].all() and "error" not in infos["final_info"]


def in_order_of_env_id(received):
    """Converts the outcome of a `recv` of all environments to that of a step."""
    *arrays, infos = received
    infos = dict(infos)
    order = np.argsort(infos.pop("env_id"))
    assert sorted(order) == list(range(NUM_ENVS))

    def sort(value):
        return {k: sort(v) for k, v in value.items()} if isinstance(value, dict) else value[order]

    return (*(array[order] for array in arrays), sort(infos))


@pytest.mark.parametrize("mode", MODES)
def test_send_and_recv_equal_step(mode):
    def step(ours, actions):
        first, second = [3, 0], np.array([4, 1, 2])
        ours.send(actions[first], first)
        ours.send(actions[second], second)
        return in_order_of_env_id(ours.recv())

    ours, theirs = make_pair(WALKER2D, mode, worlds_of(WALKER2D), num_threads=2)
    play_both(ours, theirs, NUM_STEPS // 4, step=step)


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_trajectories_do_not_depend_on_the_order_of_arrival(mode):
    """Batches of three of five environments, in the send/recv loop of asynchronous learners."""
    ours, theirs = make_pair(WALKER2D, mode, worlds_of(WALKER2D), batch_size=3)
    random = np.random.default_rng(6)
    actions = random.uniform(-1, 1, (NUM_STEPS, *ours.action_space.shape)).astype(np.float32)
    steps = [theirs.reset(seed=11)[0]]
    rewards = [np.zeros(NUM_ENVS)]
    for row in actions:
        observations, reward, *_ = theirs.step(row)
        steps.append(observations)
        rewards.append(reward)
    ours.async_reset(seed=11)
    counts = np.zeros(NUM_ENVS, int)
    while counts.max() < NUM_STEPS:
        observations, reward, terminated, truncated, infos = ours.recv()
        ids = infos["env_id"]
        assert len(set(ids.tolist())) == 3 == len(observations) == len(terminated) == len(truncated)
        for row, index in enumerate(ids):
            np.testing.assert_array_equal(observations[row], steps[counts[index]][index])
            assert reward[row] == rewards[counts[index]][index]
        ours.send(actions[counts[ids], ids], ids)
        counts[ids] += 1
    assert counts.sum() > 3 * NUM_STEPS


def test_arrays_belong_to_the_caller():
    ours = make_ours("Walker2d-v5", "same_step", 3)
    twin = make_ours("Walker2d-v5", "same_step", 3)
    kept = [ours.reset(seed=1)]
    expected = [twin.reset(seed=1)]
    actions = np.zeros(ours.action_space.shape, np.float32)
    for _ in range(7):
        kept.append(ours.step(actions))
        expected.append(twin.step(actions))
        for values in kept[-1][:-1]:
            values[...] = 1  # must not affect later outcomes or the environment
        kept[-1][-1]["x_position"][...] = 1
        assert_same(twin.step(actions), ours.step(actions))
    assert_same(kept[0], expected[0])
    for *arrays, _ in kept[1:]:
        assert all((values == 1).all() for values in arrays)


# ---------------------------------------------------------------- steps of some


def infos_of(infos, row):
    """Returns a row of infos without absent ones and masks, which a single environment lacks."""
    kept = {}
    for name, value in infos.items():
        if name == "env_id" or name.startswith("_") or not infos[f"_{name}"][row]:
            continue
        kept[name] = infos_of(value, row) if isinstance(value, dict) else value[row : row + 1]
    return kept


@pytest.mark.parametrize("mode", MODES)
def test_steps_of_some_equal_single_environments(mode):
    name, limit, _ = WALKER2D
    worlds = worlds_of(WALKER2D)
    ours = make_ours(name, mode, limit, world=worlds)
    theirs = [make_sync(name, 1, mode, max_episode_steps=limit) for _ in range(NUM_ENVS)]
    for single, world in zip(theirs, worlds):
        set_world(single, [world])
    random = np.random.default_rng(2)
    observations, _ = ours.reset(seed=7)
    for index, single in enumerate(theirs):
        assert single.reset(seed=7 + index)[0][0].tobytes() == observations[index].tobytes()
    num_ends, ended = 0, np.zeros(NUM_ENVS, bool)
    for _ in range(NUM_STEPS):
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


def test_steps_of_some_with_a_batch_size():
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


# ---------------------------------------------------------------- Gymnasium's wrappers

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
    sides = make_pair(WALKER2D, mode, worlds_of(WALKER2D))
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
