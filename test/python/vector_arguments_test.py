"""WalkerVectorEnv: accepted and rejected arguments, attributes, worlds."""

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import AutoresetMode
from walkers import assert_same, make_many, make_sync, raises, run_python

BIPEDAL = "walker_sim/BipedalWalker-v3"
NUM_ENVS = 3


def make(name=BIPEDAL, num_envs=NUM_ENVS, **options):
    return gymnasium.make_vec(name, num_envs, **options)


@pytest.fixture()
def envs():
    made = make()
    made.reset(seed=1)
    yield made
    made.close()


def zeros(envs, count=NUM_ENVS):
    return np.zeros((count, envs.single_action_space.shape[0]), np.float32)


@pytest.mark.parametrize("name", walker_sim.ids())
def test_attributes_equal_those_of_sync_vector_env(name):
    ours = make(name)
    theirs = gymnasium.make_vec(name, NUM_ENVS, vectorization_mode="sync")
    assert isinstance(ours, walker_sim.WalkerVectorEnv)
    for attribute in (
        *("num_envs", "observation_space", "action_space", "single_observation_space"),
        *("single_action_space", "metadata", "render_mode", "autoreset_mode", "closed"),
    ):
        assert getattr(ours, attribute) == getattr(theirs, attribute), attribute
    for attribute in ("action_space", "observation_space", "render_mode", "dt"):
        assert ours.get_attr(attribute) == ours.call(attribute) == theirs.get_attr(attribute)
    observations, infos = ours.reset(seed=2)
    assert observations in ours.observation_space and isinstance(infos, dict)
    assert ours.unwrapped is ours
    assert ours.spec.id == name
    assert repr(ours) == f"WalkerVectorEnv({name}, num_envs=3)"


def test_make_vec_from_a_spec():
    options = {"max_episode_steps": 7, "autoreset_mode": "same_step", "num_threads": 2}
    envs = make(world=["moon", {"gravity": (-9, -8)}, None], **options)
    again = gymnasium.make_vec(envs.spec)
    assert again.world == envs.world == ({"gravity": (-1.62, -1.62)}, {"gravity": (-9, -8)}, {})
    assert again.num_envs == NUM_ENVS
    assert again.num_threads == 2
    assert again.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    again.reset(seed=0)
    ends = [again.step(zeros(again))[3].all() for _ in range(7)]
    assert ends == [False] * 6 + [True]


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, "same_step", "SameStep"])
def test_spellings_of_autoreset_modes(mode):
    assert make(autoreset_mode=mode).autoreset_mode is AutoresetMode.SAME_STEP


@pytest.mark.parametrize(("given", "limit"), [(None, 1600), (-1, 0), (0, 0), (5, 5)])
def test_time_limits(given, limit):
    for envs in (
        make(max_episode_steps=given),
        walker_sim.WalkerVectorEnv("BipedalWalker-v3", 2, max_episode_steps=given),
    ):
        assert envs._walkers.specification["max_episode_steps"] == limit


@pytest.mark.parametrize("seed", [5, np.int64(5), [5, 6, 7], (5, 6, 7), np.array([5, 6, 7])])
def test_forms_of_seeds(envs, seed):
    expected = make().reset(seed=[5, 6, 7])
    assert_same(envs.reset(seed=seed), expected)
    assert envs.np_random_seed == (5, 6, 7)


def test_large_seeds():
    seeds = [2**64 - 1, 2**64, 2**200]
    ours, theirs = make(), make_sync(BIPEDAL, NUM_ENVS)
    assert_same(ours.reset(seed=seeds), theirs.reset(seed=seeds))
    assert ours.np_random_seed == theirs.np_random_seed


def test_without_a_seed_the_generator_is_seeded_once():
    envs = make()
    first, _ = envs.reset()
    seeds = envs.np_random_seed
    assert len(set(seeds)) == NUM_ENVS
    second, _ = envs.reset()
    assert envs.np_random_seed == seeds
    again = make()
    np.testing.assert_array_equal(again.reset(seed=seeds)[0], first)
    np.testing.assert_array_equal(again.reset()[0], second)
    unused = make()
    seeds = unused.np_random_seed
    np.testing.assert_array_equal(unused.reset()[0], again.reset(seed=seeds)[0])


def test_np_random_can_be_read_and_set(envs):
    ours, theirs = make(), make_sync(BIPEDAL, NUM_ENVS)
    generators = [np.random.default_rng(seed) for seed in (4, 5, 6)]
    generators[0].random(3)
    ours.set_attr("np_random", generators)
    for index, single in enumerate(theirs.envs):
        single.unwrapped.np_random = np.random.default_rng(4 + index)
    theirs.envs[0].unwrapped.np_random.random(3)
    assert ours.np_random_seed == (-1, -1, -1)
    assert_same(ours.reset(), theirs.reset())
    generators = ours.get_attr("np_random")
    state = generators[1].bit_generator.state
    assert state == theirs.np_random[1].bit_generator.state
    generators[1].random()
    assert ours.np_random[1].bit_generator.state == state
    with raises(ValueError, "np_random has 2 generators; must have 3"):
        ours.np_random = generators[:2]
    with raises(ValueError, "np_random uses MT19937; must use PCG64"):
        ours.np_random = [np.random.Generator(np.random.MT19937())] * NUM_ENVS


@pytest.mark.parametrize(
    ("mask", "error", "message"),
    [
        ([True] * 3, TypeError, "options['reset_mask'] is of list; must be a NumPy array of bool"),
        (np.ones(3), TypeError, "options['reset_mask'] is of float64; must be a NumPy array of bo"),
        (np.ones(2, bool), ValueError, "options['reset_mask'] has shape (2,); must have (3,)"),
        (np.zeros(3, bool), ValueError, "options['reset_mask'] is False everywhere; must be True"),
    ],
)
def test_masks_that_sync_vector_env_refuses_too(envs, mask, error, message):
    theirs = make_sync(BIPEDAL, NUM_ENVS)
    theirs.reset(seed=1)
    with pytest.raises((error, AssertionError)):  # AssertionError before Gymnasium 1.2
        theirs.reset(options={"reset_mask": mask})
    with raises(error, message):
        envs.reset(options={"reset_mask": mask})


def test_options_are_not_changed(envs):
    options = {"reset_mask": np.array([True, False, False]), "unknown": 1}
    envs.reset(options=options)
    assert set(options) == {"reset_mask", "unknown"}


def test_walkers_in_flight():
    envs = make(batch_size=2, num_threads=2)
    assert envs.batch_size == 2
    envs.reset(seed=0)
    with raises(RuntimeError, "recv: 0 environments are under way; must be at least 2"):
        envs.recv()
    envs.send(zeros(envs, 2), [0, 2])
    with raises(RuntimeError, "environment 2: is under way; receive it first"):
        envs.send(zeros(envs, 1), [2])
    with raises(RuntimeError, "step: 2 environments are under way; receive them first"):
        envs.step(zeros(envs))
    with raises(RuntimeError, "reset: 2 environments are under way; receive them first"):
        envs.reset()
    for call in (lambda: envs.reset(seed=5), envs.async_reset, lambda: envs.set_world("moon")):
        with raises(RuntimeError, "environment 0: is under way; receive it first"):
            call()
    envs.set_world("moon", [1])
    infos = envs.recv()[-1]
    assert infos["env_id"].dtype == np.int32 and sorted(infos["env_id"]) == [0, 2]
    envs.step(zeros(envs))


@pytest.mark.parametrize("name", ["spec", "reset"])
def test_unknown_attributes(envs, name):
    with raises(AttributeError, f"{name}: the walkers have no such attribute; must be one of np_r"):
        envs.get_attr(name)
    with raises(AttributeError, f"{name}: cannot be set; must be np_random"):
        envs.set_attr(name, [1, 2, 3])


def test_after_close(envs):
    envs.close()
    envs.close()
    assert envs.closed
    for call in (envs.reset, envs.recv, envs.async_reset, lambda: envs.np_random):
        with raises(ClosedEnvironmentError, ": this environment was closed"):
            call()
    for call in (envs.step, envs.send, envs.set_world):
        with raises(ClosedEnvironmentError, f"{call.__name__}: this environment was closed"):
            call(zeros(envs))


def test_gymnasium_1_1_is_needed():
    """The rest of the package works with Gymnasium 1.0, which has no AutoresetMode."""
    script = """
import gymnasium, gymnasium.vector
del gymnasium.vector.AutoresetMode
gymnasium.__version__ = "1.0.0"
import walker_sim
assert gymnasium.make(walker_sim.ids()[0]).reset(seed=1)[0].shape == (24,)
try:
    walker_sim.WalkerVectorEnv
except ImportError as error:
    assert str(error) == "WalkerVectorEnv needs Gymnasium 1.1 or later; this is 1.0.0", error
else:
    raise AssertionError("no error")
"""
    run_python(script)


# ---------------------------------------------------------------- worlds


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


def test_refused_calls_about_worlds():
    envs = make_many("Hopper-v5", 3)
    with raises(ValueError, "2 worlds; must be one, or 1, one for each walker"):
        envs.set_world(["moon", "moon"], indices=[1])
    envs.set_world("moon", indices=[])
    envs.set_world([], indices=[])
    assert envs.world == ({},) * 3
    with raises(AttributeError, "set_world: the walkers have no methods that can be called"):
        envs.call("set_world", "moon")
