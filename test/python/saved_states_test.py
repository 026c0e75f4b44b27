"""Copies, pickles and saved states of single and vector environments continue to the bit."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import WalkerEnv, _core
from walkers import (
    ASSETS,
    IDS,
    MODES,
    assert_same,
    follow,
    make_many,
    make_ours,
    random_actions,
    through_pickle,
)

MODEL = ASSETS / "walker2d_v4.xml"
VARIANTS = (
    *((environment_id, {}) for environment_id in IDS),
    ("BipedalWalker-v3", {"hardcore": True, "max_episode_steps": 40}),
    ("BipedalWalker-v3", {"reuse_world": True}),
    ("Walker2d-v4", {"healthy_z_range": (0.7, 2.5), "reset_noise_scale": 0.1}),
    ("Walker2d-v5", {"xml_file": str(MODEL), "frame_skip": 5}),
    ("Walker2d-v5", {"xml_file": MODEL, "max_episode_steps": 40}),
    ("Walker2d-v5", {"terminate_when_unhealthy": False, "ctrl_cost_weight": 0.1}),
)
NUM_ENVS = 5


def restored(environment):
    """Returns a new environment with the state of another, which need not have wrappers."""
    new = environment.unwrapped.spec.make().unwrapped
    new.set_state(through_pickle(environment.unwrapped.get_state()))
    return new


def play(environment, actions):
    environment.reset(seed=5)
    follow(environment, actions)


def play_and_draw(environment, actions):
    play(environment, actions[:9])
    environment.unwrapped.np_random.integers(7)  # leaves a buffered uint32


def set_generator(environment, _):
    environment.unwrapped.np_random = np.random.default_rng(3)


def play_and_set_generator(environment, actions):
    play(environment, actions[:9])
    set_generator(environment, actions)


def continue_with(environment, actions):
    if environment.unwrapped.is_fresh:  # set by the test, copied with the environment
        environment.reset()
    outcomes = follow(environment, actions)
    return outcomes, environment.unwrapped.np_random.bit_generator.state


COPIED = pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy, restored])


@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
@pytest.mark.parametrize(
    "bring",
    [
        lambda environment, actions: play(environment, actions[:9]),
        *(play, play_and_draw, play_and_set_generator, set_generator),
    ],
)
@pytest.mark.parametrize(("environment_id", "parameters"), VARIANTS, ids=str)
def test_copies_continue_equally(environment_id, parameters, bring, copied):
    actions = random_actions(environment_id, 150)
    original, untouched = (make_ours(environment_id, **parameters) for _ in range(2))
    for environment in (original, untouched):
        bring(environment, actions)
        environment.unwrapped.is_fresh = bring is set_generator
    twin = copied(original)
    expected = continue_with(untouched, actions)
    assert continue_with(twin, actions) == expected
    assert continue_with(original, actions) == expected
    assert str(twin) == str(original)
    assert twin.spec == original.spec
    assert twin.observation_space == original.observation_space


@COPIED
@pytest.mark.parametrize("environment_id", IDS)
def test_before_the_first_reset_and_after_the_end(environment_id, copied):
    original = make_ours(environment_id).unwrapped
    actions = random_actions(environment_id, 2000)
    message = "there is no episode yet"
    for seed in (2, None):
        twin = copied(original)
        with pytest.raises(walker_sim.ResetNeeded, match=message):
            twin.step(actions[0])
        observations = [one.reset(seed=seed)[0].tobytes() for one in (original, twin)]
        assert observations[0] == observations[1]
        original.reset(seed=5)
        steps = next(i for i, action in enumerate(actions, 1) if original.step(action)[2])
        message = f"ended after {steps} steps"


def make_envs(environment_id="Hopper-v5", mode="next_step", **options):
    options = {"autoreset_mode": mode, "max_episode_steps": 60, **options}
    return make_many(environment_id, NUM_ENVS, **options)


@pytest.mark.parametrize("make", [lambda: make_ours("Hopper-v5"), make_envs])
@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
def test_copies_of_new_and_of_closed_environments(make, copied):
    original = make()
    twin = copied(original)
    actions = np.zeros(original.action_space.shape)
    with pytest.raises(gymnasium.error.ResetNeeded):
        twin.step(actions)
    assert twin.reset(seed=1)[0].tobytes() == original.reset(seed=1)[0].tobytes()
    original.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        copied(original).step(actions)


@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
def test_copies_have_their_own_step_count(copied):
    original = WalkerEnv("Walker2d-v5", max_episode_steps=9, terminate_when_unhealthy=False)
    original.reset(seed=1)
    for _ in range(5):
        original.step(np.zeros(6))
    twin = copied(original)
    for environment in (original, twin):
        assert [environment.step(np.zeros(6))[3] for _ in range(4)] == [False, False, False, True]


def test_another_version_is_refused():
    stored = pickle.dumps(_core.Environment("BipedalWalker-v3", {}), protocol=2)
    version = _core.__version__.encode()
    assert version in stored
    other = version[:-1] + b"x"
    with pytest.raises(ValueError, match=f"pickled by walker_sim {other.decode()} on Box2D"):
        pickle.loads(stored.replace(version, other))


def rollout(envs, actions):
    outcomes = []
    for action in actions:
        outcome = envs.step(np.repeat(action[np.newaxis], envs.num_envs, 0))
        outcomes.append(outcome)
        ended = outcome[2] | outcome[3]
        if ended.any() and envs.metadata["autoreset_mode"].name == "DISABLED":
            outcomes.append(envs.reset(options={"reset_mask": ended}))
    return outcomes


@pytest.mark.parametrize("environment_id", IDS)
def test_a_restored_environment_continues_equally(environment_id):
    actions = random_actions(environment_id, 130)
    original, fresh, other = (make_ours(environment_id).unwrapped for _ in range(3))
    original.reset(seed=5)
    follow(original, actions[:30])
    original.np_random.integers(7)  # leaves a buffered uint32
    other.reset(seed=9)
    follow(other, actions[:12])
    state = original.get_state()
    assert original.get_state() == state
    expected = None
    for environment in (original, fresh, other):
        environment.set_state(through_pickle(state))
        outcomes = follow(environment, actions[30:])
        generator = environment.np_random.bit_generator.state
        expected = expected or (outcomes, generator)
        assert (outcomes, generator) == expected
    original.set_state(state)
    assert follow(original, actions[30:]) == expected[0]


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


def test_refused_states_change_nothing():
    environment = WalkerEnv("Walker2d-v5")
    environment.reset(seed=1)
    state = environment.get_state()
    stranger = WalkerEnv("Hopper-v5")
    stranger.reset(seed=1)
    flipped = bytearray(state)
    flipped[len(state) // 2] ^= 1
    wrong = "another environment: id = Hopper-v5 there; here it is Walker2d-v5"
    for given, error, message in [
        (stranger.get_state(), ValueError, wrong),
        (state[:-3], ValueError, "the state is damaged"),
        (bytes(flipped), ValueError, "checksum"),
        (b"something else", ValueError, "no saved state"),
        ("something else", TypeError, "must be bytes"),
    ]:
        with pytest.raises(error, match=message):
            environment.set_state(given)
    assert environment.get_state() == state


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("environment_id", IDS)
def test_restored_walkers_continue_equally(environment_id, mode):
    actions = random_actions(environment_id, 150)
    original, other = (make_envs(environment_id, mode) for _ in range(2))
    original.reset(seed=3)
    other.reset(seed=99)
    rollout(original, actions[:50])
    rollout(other, actions[:7])
    states = original.get_state()
    other.set_state(states)
    assert_same(rollout(other, actions[50:]), rollout(original, actions[50:]))
    assert other.get_state() == original.get_state()
    original.set_state(states)
    other.set_state(states[2:4], [2, 3])
    assert other.get_state([2, 3]) == states[2:4]


@pytest.mark.parametrize("environment_id", IDS)
def test_a_walker_continues_as_a_single_environment(environment_id):
    envs, single = make_envs(environment_id), WalkerEnv(environment_id)
    envs.reset(seed=3)
    actions = random_actions(environment_id, 20)
    rollout(envs, actions[:10])
    single.set_state(envs.get_state([4])[0])
    for action in actions[10:]:
        observation, reward, *_ = single.step(action)
        observations, rewards, *_ = envs.step(np.repeat(action[np.newaxis], NUM_ENVS, 0))
        assert observation.tobytes() == observations[4].tobytes()
        assert reward == rewards[4]
        assert single.get_state() == envs.get_state([4])[0], "states differ"
    envs.set_state([single.get_state()], [0])


def test_refused_states_of_walkers_change_nothing():
    envs = make_envs()
    envs.reset(seed=1)
    states = envs.get_state()
    others = make_envs()
    others.reset(seed=5)
    damaged = others.get_state()
    damaged[3] = damaged[3][:-1]
    for given, indices, error, message in [
        (damaged, None, ValueError, "environment 3: the state is damaged"),
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


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, through_pickle])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("environment_id", IDS)
def test_copies_of_vector_environments_continue_equally(environment_id, mode, copied):
    actions = random_actions(environment_id, 120)
    parameters = {"reuse_world": True} if environment_id.startswith("Bipedal") else {}
    original, untouched = (make_envs(environment_id, mode, **parameters) for _ in range(2))
    for envs in (original, untouched):
        envs.reset(seed=3)
        rollout(envs, actions[:50])
    twin = copied(original)
    expected = rollout(untouched, actions[50:])
    assert_same(rollout(twin, actions[50:]), expected)
    assert_same(rollout(original, actions[50:]), expected)
    assert twin.np_random_seed == original.np_random_seed
    assert twin.autoreset_mode == original.autoreset_mode
    assert twin.num_envs == original.num_envs
    assert twin.num_threads == original.num_threads
    assert twin.action_space == original.action_space
    assert twin.spec == original.spec
    assert twin.get_state() == original.get_state()


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
