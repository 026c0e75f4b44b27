"""Copies, pickles and saved states of single and vector environments.

promises_test.py replaces environments by such copies, and compares the bits of what follows.
"""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from walker_sim import WalkerEnv, _core
from walkers import (
    ASSETS,
    IDS,
    assert_same,
    follow,
    make_many,
    make_ours,
    random_actions,
    restored,
    through_pickle,
)

NUM_ENVS = 5
WORLD = {"push_interval": (0.1, 0.3), "observation_delay": 0.04, "gravity": (-12, -8)}
VARIANTS = (
    ("BipedalWalker-v3", {"reuse_world": True}),
    ("Walker2d-v5", {"xml_file": ASSETS / "walker2d_v4.xml", "frame_skip": 5}),
)


COPIED = pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy, restored])


@COPIED
@pytest.mark.parametrize("has_begun", [True, False])
@pytest.mark.parametrize(("environment_id", "parameters"), VARIANTS, ids=str)
def test_copies_and_their_originals_continue_equally(environment_id, parameters, has_begun, copied):
    """Also with a generator that the user has set or drawn from."""
    actions = random_actions(environment_id, 150)
    parameters = {"world": WORLD, "max_episode_steps": 40, **parameters}
    original = WalkerEnv(environment_id, **parameters)
    original.np_random = np.random.default_rng(3)
    if has_begun:
        original.reset()
        follow(original, actions[:9])
        original.np_random.integers(7)  # leaves a buffered uint32
    state = original.get_state()
    twin = copied(original)
    assert twin.world == original.world
    assert twin.observation_space == original.observation_space
    assert twin.get_state() == original.get_state() == state

    def continue_with(environment):
        if not has_begun:
            environment.reset()
        return follow(environment, actions), environment.np_random.bit_generator.state

    assert continue_with(twin) == continue_with(original)


def make_envs(environment_id="Hopper-v5", **options):
    return make_many(environment_id, NUM_ENVS, max_episode_steps=60, **options)


@pytest.mark.parametrize("make", [lambda: make_ours("Hopper-v5"), make_envs])
@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
def test_copies_of_new_and_of_closed_environments(make, copied):
    original = make()
    twin = copied(original)
    assert str(twin) == str(original)
    assert twin.spec == original.spec
    actions = np.zeros(original.action_space.shape)
    with pytest.raises(gymnasium.error.ResetNeeded):
        twin.step(actions)
    assert twin.reset(seed=1)[0].tobytes() == original.reset(seed=1)[0].tobytes()
    original.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        copied(original).step(actions)


def test_another_version_is_refused():
    stored = pickle.dumps(_core.Pool("BipedalWalker-v3", {}), protocol=2)
    version = _core.__version__.encode()
    assert version in stored
    other = version[:-1] + b"x"
    with pytest.raises(ValueError, match=f"pickled by walker_sim {other.decode()} on Box2D"):
        pickle.loads(stored.replace(version, other))


@pytest.mark.parametrize("environment_id", IDS)
def test_the_size_of_a_state_does_not_grow(environment_id):
    environment = WalkerEnv(environment_id)
    sizes = []
    for num_steps in (1, 20):
        environment.reset(seed=3)
        for _ in range(num_steps):
            environment.step(np.zeros(environment.action_space.shape))
        state = environment.get_state()
        assert isinstance(state, bytes)
        sizes.append(len(state))
    assert abs(sizes[1] - sizes[0]) < 1000  # the number of contacts varies
    assert max(sizes) < 20000


def test_a_shallow_copy_has_its_own_walker_and_set_state_opens_a_closed_one():
    environment = WalkerEnv("Walker2d-v5")
    environment.reset(seed=1)
    state = environment.get_state()
    copy.copy(environment).step(np.ones(6))
    assert environment.get_state() == state
    environment.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="get_state"):
        environment.get_state()
    environment.set_state(state)
    environment.step(np.zeros(6))


def test_refused_states_of_walkers_change_nothing():
    """bad_input_test.py has what is not a state."""
    envs, others, stranger = make_envs(), make_envs(), WalkerEnv("Walker2d-v5")
    for each in (envs, others, stranger):
        each.reset(seed=5)
    envs.reset(seed=1)
    states, damaged = envs.get_state(), others.get_state()
    damaged[3] = damaged[3][:-1]
    wrong = "another environment: id = Walker2d-v5 there; here it is Hopper-v5"
    for given, indices, error, message in [
        (damaged, None, ValueError, "environment 3: the state is damaged"),
        ([stranger.get_state()], [0], ValueError, wrong),
        (states[:4], None, ValueError, "4 states; must be a sequence of 5"),
        (states[0], [0], ValueError, "one state; must be a sequence of 1"),
        (["a"] * 5, None, TypeError, "must be bytes"),
    ]:
        with pytest.raises(error, match=message):
            envs.set_state(given, indices)
    assert envs.get_state() == states
    envs.close()
    for call in (envs.get_state, lambda: envs.set_state(states)):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError):
            call()


def rollout(envs, actions):
    return [envs.step([action] * NUM_ENVS) for action in actions]


@pytest.mark.parametrize("environment_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_states_move_between_single_and_vector(environment_id):
    worlds = ["moon", None, None, "pushed", WORLD]
    envs, single = make_envs(environment_id, world=worlds), WalkerEnv(environment_id)
    envs.reset(seed=3)
    actions = random_actions(environment_id, 12)
    rollout(envs, actions[:5])
    single.set_state(envs.get_state([4])[0])
    rollout(envs, actions[5:])
    follow(single, actions[5:])
    assert [single.get_state()] == envs.get_state([4])
    envs.set_state([single.get_state()], [1])
    states = envs.get_state()
    assert states[1] == single.get_state()
    envs.set_state(states[2:4], [1, 0])
    assert envs.get_state([1, 0]) == states[2:4]
    envs.set_state(states)
    assert envs.get_state() == states
    assert envs.world[1] == envs.world[4] == single.world


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, through_pickle])
def test_copies_of_vector_environments_continue_equally(copied):
    actions = random_actions("BipedalWalker-v3", 120)
    options = {"reuse_world": True, "world": [None, "moon", WORLD, "pushed", "noisy"]}
    original = make_envs("BipedalWalker-v3", **options)
    original.reset(seed=3)
    rollout(original, actions[:50])
    states = original.get_state()
    twin = copied(original)
    for name in ("np_random_seed", "autoreset_mode", "num_envs", "num_threads", "world"):
        assert getattr(twin, name) == getattr(original, name), name
    assert twin.action_space == original.action_space
    assert twin.get_state() == original.get_state() == states
    assert_same(rollout(twin, actions[50:]), rollout(original, actions[50:]))


def test_walkers_in_flight_have_no_state():
    envs = make_envs(batch_size=2)
    envs.reset(seed=1)
    states = envs.get_state()
    envs.send(np.zeros((2, 3)), [0, 1])
    for call in (envs.get_state, lambda: envs.set_state(states), lambda: copy.deepcopy(envs)):
        with pytest.raises(RuntimeError, match="under way"):
            call()
    envs.recv()
    copy.deepcopy(envs).set_state(states)
