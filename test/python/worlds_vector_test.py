"""Worlds of vector environments equal those of the installed SyncVectorEnv of single ones."""

import copy

import gymnasium
import numpy as np
import pytest
import walker_sim
from walkers import (
    MODES,
    assert_same,
    make_many,
    make_sync,
    play_both,
    raises,
    set_world,
    through_pickle,
)
from worlds_test import ALL

NUM_ENVS = 6
STEPS = 200
LIMITS = {"BipedalWalker-v3": 70, "Walker2d-v5": 20, "Hopper-v4": 20}


def worlds_of(environment_id):
    everything = ALL[environment_id]
    pushed = {"push_interval": (0.1, 0.2), "observation_delay": 0.04}
    dropping = {**everything, "dropout": 0.9}
    return [None, everything, "moon", {"gravity": (-20, -5)}, dropping, pushed]


def make_ours(environment_id, mode="next_step", **options):
    options = {"max_episode_steps": LIMITS[environment_id], **options}
    options.setdefault("world", worlds_of(environment_id))
    return make_many(environment_id, NUM_ENVS, autoreset_mode=mode, **options)


def make_theirs(environment_id, mode):
    theirs = make_sync(
        f"walker_sim/{environment_id}", NUM_ENVS, mode, max_episode_steps=LIMITS[environment_id]
    )
    set_world(theirs, worlds_of(environment_id), range(NUM_ENVS))
    return theirs


def actions_of(envs, count=STEPS):
    random = np.random.default_rng(3)
    return random.uniform(-1.2, 1.2, (count, *envs.action_space.shape)).astype(np.float32)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_threads", [1, 3])
@pytest.mark.parametrize("environment_id", LIMITS)
def test_equal_to_sync_vector_env(environment_id, num_threads, mode):
    """Bits and infos at resets, steps, autoresets and masked resets, with worlds that change."""
    ours = make_ours(environment_id, mode, num_threads=num_threads)
    theirs = make_theirs(environment_id, mode)
    assert ours.get_attr("world") == theirs.get_attr("world")
    worlds = {
        STEPS // 3: (["slippery", None, "noisy"], [0, 1, 5]),
        STEPS // 2: ("laggy",),
    }
    assert play_both(ours, theirs, STEPS, worlds=worlds)[1] > 10


@pytest.mark.parametrize("environment_id", LIMITS)
def test_any_worlds_beside_and_any_threads_change_no_bit(environment_id):
    world = ALL[environment_id]

    def rows(num_envs, index, num_threads, others):
        worlds = [others] * num_envs
        worlds[index] = world
        envs = make_many(
            environment_id, num_envs, world=worlds, num_threads=num_threads, max_episode_steps=20
        )
        seeds = [*range(num_envs)]
        seeds[index] = 77
        results = [envs.reset(seed=seeds)]
        for action in actions_of(make_many(environment_id, 1), 60):
            results.append(envs.step(np.repeat(action, num_envs, 0)))
        return [[np.array(part)[index].tobytes() for part in result[:-1]] for result in results]

    expected = rows(1, 0, 1, None)
    for arguments in ((5, 2, 1, None), (5, 4, 3, "pushed"), (19, 7, 2, {"gravity": (-15, -5)})):
        assert rows(*arguments) == expected, arguments


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_a_set_world_holds_from_the_next_autoreset(mode):
    envs = make_many("Walker2d-v5", 3, autoreset_mode=mode, max_episode_steps=5)
    infos = envs.reset(seed=1)[1]
    assert "world" not in infos
    seen = []
    for number in range(30):
        if number == 7:  # within the second episode
            envs.set_world({"gravity": (-9, -8)}, indices=[1])
        infos = envs.step(np.zeros((3, 6)))[4]
        if "world" in infos:
            assert infos["_world"].tolist() == [False, True, False]
            assert infos["world"]["_gravity"].tolist() == [False, True, False]
            gravity = infos["world"]["gravity"].tolist()
            assert gravity[::2] == [0, 0] and -9 <= gravity[1] <= -8
            assert "world" not in infos.get("final_info", {})
            seen.append(number)
    assert seen == ([11, 17, 23, 29] if mode == "next_step" else [9, 14, 19, 24, 29])


def test_the_worlds_of_a_reset():
    envs = make_many("Walker2d-v5", 4, autoreset_mode="disabled")
    one = {"gravity": -5}
    infos = envs.reset(seed=1, options={"world": one})[1]
    assert infos["world"]["gravity"].tolist() == [-5] * 4 and infos["_world"].all()
    mask = np.array([False, True, False, True])
    worlds = [{"gravity": -1}, {"gravity": -2}, {"gravity": -3}, None]
    infos = envs.reset(options={"reset_mask": mask, "world": worlds})[1]
    assert infos["world"]["gravity"].tolist() == [0, -2, 0, 0]
    assert infos["_world"].tolist() == infos["world"]["_gravity"].tolist() == [0, 1, 0, 0]
    five, two = ({"gravity": (gravity, gravity)} for gravity in (-5.0, -2.0))
    assert envs.world == (five, two, five, {})
    infos = envs.reset(options={"reset_mask": mask, "world": {"friction_scale": 0.5}})[1]
    assert [*infos["world"]] == ["friction_scale", "_friction_scale"]
    infos = envs.reset()[1]
    assert infos["world"]["gravity"].tolist() == [-5, 0, -5, 0]
    assert infos["world"]["friction_scale"].tolist() == [0, 0.5, 0, 0.5]
    assert infos["world"]["_gravity"].tolist() == [True, False, True, False]
    assert infos["_world"].all()
    assert "world" not in envs.reset(options={"world": None})[1]


def test_send_and_recv_and_steps_of_some():
    envs = make_many("Hopper-v5", 4, batch_size=2, max_episode_steps=3, world="moon")
    envs.async_reset(seed=1)
    envs.set_world(None, indices=[])
    with pytest.raises(RuntimeError, match="under way"):
        envs.set_world(None)
    resets = 0
    for _ in range(40):
        infos = envs.recv()[4]
        if "world" in infos:
            assert {*infos["world"]["gravity"][infos["_world"]]} == {-1.62}
            resets += sum(infos["_world"])
            envs.set_world("moon", indices=infos["env_id"])  # of walkers at rest
        envs.send(np.zeros((2, 3)), infos["env_id"])
    assert resets >= 16
    envs = make_many("Hopper-v5", 4, max_episode_steps=1, world=[None, "moon", None, "moon"])
    envs.reset(seed=1)
    envs.step(np.zeros((3, 3)), env_id=[0, 3, 2])
    infos = envs.step(np.zeros((2, 3)), env_id=[3, 0])[4]
    assert infos["_world"].tolist() == [True, False]
    assert "world" not in envs.step(np.zeros((1, 3)), env_id=[1])[4]


def test_gymnasiums_wrapper_splits_the_infos():
    envs = make_many("Hopper-v5", 3, world=[None, "moon", {"gravity": (-9, -8), "dropout": 0.1}])
    infos = gymnasium.wrappers.vector.DictInfoToList(envs).reset(seed=1)[1]
    assert [info.get("world") for info in infos[:2]] == [None, {"gravity": -1.62}]
    assert infos[2]["world"]["dropout"] == 0.1 and -9 <= infos[2]["world"]["gravity"] <= -8


def restored(envs):
    other = make_ours(envs.spec.id.partition("/")[2], world="pushed")
    other.reset(seed=9)
    other.set_state(envs.get_state())
    return other


@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy, restored])
@pytest.mark.parametrize("environment_id", LIMITS)
def test_copies_continue_to_the_bit(environment_id, copied):
    envs = make_ours(environment_id)
    envs.reset(seed=2)
    actions = actions_of(envs)
    for one in actions[:33]:
        envs.step(one)
    envs.set_world("noisy", indices=[0, 3])
    twin = copied(envs)
    assert twin.world == envs.world
    assert twin.get_state() == envs.get_state()
    drawn = 0
    for number, one in enumerate(actions):
        result = envs.step(one)
        assert_same(twin.step(one), result, number)
        drawn += "world" in result[4]
    assert drawn


@pytest.mark.parametrize("environment_id", LIMITS)
def test_states_move_between_single_and_vector(environment_id):
    env = walker_sim.WalkerEnv(environment_id, world=ALL[environment_id])
    env.reset(seed=8)
    actions = actions_of(make_many(environment_id, 1), 5)[:, 0]
    for action in actions:
        env.step(action)
    envs = make_ours(environment_id, world=None)
    envs.reset(seed=1)
    envs.set_state([env.get_state()], indices=[4])
    assert envs.world == ({},) * 4 + (env.world, {})
    for action in actions:
        expected = env.step(action)[0]
        assert envs.step([action] * NUM_ENVS)[0][4].tobytes() == expected.tobytes()
    infos = envs.reset()[1]
    assert infos["_world"].tolist() == [False] * 4 + [True, False]


@pytest.mark.parametrize(
    ("world", "error", "message"),
    [
        ([None] * 2, ValueError, "2 worlds; must be one, or 3, one for each walker"),
        ([], ValueError, "0 worlds; must be one, or 3, one for each walker"),
        ([None, "moon", {"wind": 1}], ValueError, "world 2: world parameter wind = 1.0: unknown"),
        ([None, "moon", {"gravity": "x"}], TypeError, "world 2: world parameter gravity = 'x': "),
        ([None, 7, None], TypeError, "world 1: world = 7: must be None"),
        ({"gravity": 1}, ValueError, "world parameter gravity = 1.0: must be in [-50.0, 0.0]"),
        (7, TypeError, "world = 7: must be None"),
    ],
)
def test_a_refused_world_changes_nothing(world, error, message):
    with raises(error, message):
        make_many("Hopper-v5", 3, world=world)
    envs = make_many("Hopper-v5", 3, world="pushed", autoreset_mode="disabled")
    envs.reset(seed=1)
    before = envs.get_state()
    mask = np.array([True, False, False])
    for call in (
        envs.set_world,
        lambda world: envs.reset(seed=3, options={"world": world}),
        lambda world: envs.reset(seed=3, options={"world": world, "reset_mask": mask}),
    ):
        with raises(error, message):
            call(world)
        assert envs.get_state() == before
        assert envs.np_random_seed == (1, 2, 3)


def test_refused_calls():
    envs = make_many("Hopper-v5", 3)
    with raises(ValueError, "2 worlds; must be one, or 1, one for each walker"):
        envs.set_world(["moon", "moon"], indices=[1])
    envs.set_world("moon", indices=[])
    envs.set_world([], indices=[])
    assert envs.world == ({},) * 3
    with raises(AttributeError, "set_world: the walkers have no methods that can be called"):
        envs.call("set_world", "moon")
    with raises(AttributeError, "world: cannot be set; must be np_random"):
        envs.set_attr("world", "moon")
    envs.close()
    with raises(gymnasium.error.ClosedEnvironmentError, "set_world: this environment was closed"):
        envs.set_world("moon")


def test_a_spec_keeps_the_world():
    expected = {"gravity": (-1.62, -1.62)}, {"gravity": (-9.0, -8.0)}
    envs = make_many("Hopper-v5", 2, world=["moon", {"gravity": (-9, -8)}])
    assert envs.world == gymnasium.make_vec(envs.spec).unwrapped.world == expected
