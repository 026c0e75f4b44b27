"""WalkerVectorEnv has the bits, types and infos of the installed SyncVectorEnv.

The reference steps Gymnasium's BipedalWalker, compared with reuse_world because it keeps its world
between episodes, and this package's single environments. promises_test.py has the bits of all ids.
"""

import time

import gymnasium
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
PATIENCE = 60.0  # timeout that only a failing test reaches [s]
# Some episodes terminate before the limit, some do not.
# Some episodes terminate before the limit, some do not.
EVERYTHING = ALL["Walker2d-v5"]
WORLDS = [None, EVERYTHING, "moon", {"gravity": (-20, -5)}, {**EVERYTHING, "dropout": 0.9}]
GYMNASIUMS = ("BipedalWalker-v3", 90, {"reuse_world": True}, None)
WALKER2D = ("walker_sim/Walker2d-v5", 25, {}, WORLDS)


def make_ours(name, mode="next_step", limit=None, **options):
    options = {"autoreset_mode": mode, "max_episode_steps": limit, **options}
    return make_many(name.split("/")[-1], NUM_ENVS, **options)


def make_pair(case, mode, **options):
    name, limit, parameters, worlds = case
    parameters_of_theirs = parameters if "/" in name else {}
    theirs = make_sync(name, NUM_ENVS, mode, max_episode_steps=limit, **parameters_of_theirs)
    if worlds:
        set_world(theirs, worlds)
    return make_ours(name, mode, limit, world=worlds, **options, **parameters), theirs


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("case", [GYMNASIUMS, WALKER2D], ids=["Gymnasium's", "ours"])
def test_equals_sync_vector_env(case, mode):
    ours, theirs = make_pair(case, mode, num_threads=3)
    changes = {}
    if case is WALKER2D:
        assert ours.get_attr("world") == theirs.get_attr("world")
        changes = {150: (["slippery", None, "noisy"], [0, 1, 4]), 250: ("laggy",)}
    assert play_both(ours, theirs, 400, changes).min() > 1
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
    case = ("walker_sim/Walker2d-v5", None, diverging(tmp_path), None)
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


def in_order_of_env_id(received):
    """Converts the outcome of a `recv` of all environments to that of a step."""
    *arrays, infos = received
    infos = dict(infos)
    order = np.argsort(infos.pop("env_id"))
    assert sorted(order) == list(range(len(order)))

    def sort(value):
        return {k: sort(v) for k, v in value.items()} if isinstance(value, dict) else value[order]

    return (*(array[order] for array in arrays), sort(infos))


@pytest.mark.parametrize("mode", MODES)
def test_the_rows_of_failed_resets(mode, tmp_path):
    envs = make_many("Walker2d-v5", 20, autoreset_mode=mode, **overflowing(tmp_path))
    observations, infos = envs.reset(seed=0)
    failed = infos["_error"]
    assert 0 < failed.sum() < 20
    assert infos["error"].tolist() == [OVERFLOW if is_failed else None for is_failed in failed]
    assert infos["_x_position"].tolist() == (~failed).tolist()
    assert (~observations.any(axis=1)).tolist() == failed.tolist()
    if mode == "disabled":
        words = f"environment {failed.argmax()}: the simulation failed at its reset; reset first"
        with pytest.raises(walker_sim.ResetNeeded, match=words):
            envs.step(np.zeros((20, 6)))
    envs.async_reset(seed=0)
    received, rewards, terminated, truncated, infos_of_recv = in_order_of_env_id(envs.recv())
    assert received.tobytes() == observations.tobytes()
    assert not rewards.any() and not truncated.any()
    assert terminated.tolist() == failed.tolist()
    assert infos_of_recv["error"].tolist() == infos["error"].tolist()
    if mode == "same_step":
        assert infos_of_recv["_final_obs"].tolist() == failed.tolist()
        assert "error" not in infos_of_recv["final_info"]


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


def wrapped(envs, mode):
    low, high = (np.full(6, bound, np.float32) for bound in (-2, 2))
    envs = wrappers.ClipAction(wrappers.RescaleAction(envs, low, high))
    envs = wrappers.NormalizeReward(wrappers.RecordEpisodeStatistics(envs))
    envs = wrappers.ClipReward(envs, -0.1, 0.1)
    if mode == "next_step":  # these two refuse another mode
        envs = wrappers.NormalizeObservation(wrappers.FlattenObservation(envs))
    # Gymnasium 1.1's cannot read the infos of RecordEpisodeStatistics.
    is_old = gymnasium.__version__.startswith("1.1.")
    return envs if is_old else wrappers.DictInfoToList(envs)


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_gymnasiums_wrappers_give_equal_results(mode):
    sides = [wrapped(side, mode) for side in make_pair(WALKER2D, mode)]
    random = np.random.default_rng(2)
    assert_same(*(side.reset(seed=3) for side in sides))
    num_ended = 0
    for number in range(80):
        actions = random.uniform(-1, 1, sides[0].action_space.shape).astype(np.float32)
        results = [side.step(actions.copy()) for side in sides]
        for *_, infos in results:
            if isinstance(infos, dict):  # of Gymnasium 1.1, with a row for each environment
                infos.get("episode", {}).pop("t", None)
                ended = np.count_nonzero(infos.get("_episode", 0))
            else:
                ended = len([info["episode"].pop("t") for info in infos if "episode" in info])
        num_ended += ended
        assert_same(*results, number)
    assert num_ended > 5
