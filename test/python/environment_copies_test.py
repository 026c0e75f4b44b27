"""Copies and pickles of an environment hold its complete state and continue equally to the bit."""

import copy
import pathlib
import pickle

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import WalkerEnv, _core
from walkers import IDS, follow, make_ours, random_actions

MODEL = pathlib.Path(__file__).resolve().parents[2] / "assets" / "walker2d_v4.xml"
VARIANTS = (
    *((environment_id, {}) for environment_id in IDS),
    ("BipedalWalker-v3", {"hardcore": True, "max_episode_steps": 40}),
    ("Walker2d-v4", {"healthy_z_range": (0.7, 2.5), "reset_noise_scale": 0.1}),
    ("Walker2d-v5", {"xml_file": str(MODEL), "frame_skip": 5}),
    ("Walker2d-v5", {"xml_file": MODEL, "max_episode_steps": 40}),
    ("Walker2d-v5", {"terminate_when_unhealthy": False, "ctrl_cost_weight": 0.1}),
)


def pickled(environment):
    return pickle.loads(pickle.dumps(environment))


def pickled_twice(environment):
    return pickled(pickled(environment))


def bring_to_reset(environment, actions):
    environment.reset(seed=5)


def bring_into_episode(environment, actions):
    environment.reset(seed=5)
    follow(environment, actions[:9])


def bring_into_later_episode(environment, actions):
    environment.reset(seed=5)
    follow(environment, actions)


def bring_to_drawn_generator(environment, actions):
    bring_into_episode(environment, actions)
    environment.unwrapped.np_random.integers(7)  # leaves a buffered uint32


def bring_to_set_generator(environment, actions):
    bring_into_episode(environment, actions)
    environment.unwrapped.np_random = np.random.default_rng(3)


def bring_to_generator_before_first_reset(environment, actions):
    environment.unwrapped.np_random = np.random.default_rng(3)


def go_on(environment, actions):
    if environment.unwrapped.is_fresh:  # set by the test, copied with the environment
        environment.reset()
    outcomes = follow(environment, actions)
    return outcomes, environment.unwrapped.np_random.bit_generator.state


@pytest.mark.parametrize("copied", [pickled, pickled_twice, copy.deepcopy])
@pytest.mark.parametrize(
    "bring",
    [
        bring_to_reset,
        bring_into_episode,
        bring_into_later_episode,
        bring_to_drawn_generator,
        bring_to_set_generator,
        bring_to_generator_before_first_reset,
    ],
)
@pytest.mark.parametrize(("environment_id", "parameters"), VARIANTS, ids=str)
def test_copies_go_on_alike(environment_id, parameters, bring, copied):
    actions = random_actions(environment_id, 150)
    original, untouched = (make_ours(environment_id, **parameters) for _ in range(2))
    for environment in (original, untouched):
        bring(environment, actions)
        environment.unwrapped.is_fresh = bring is bring_to_generator_before_first_reset
    twin = copied(original)
    expected = go_on(untouched, actions)
    assert go_on(twin, actions) == expected
    assert go_on(original, actions) == expected
    assert str(twin) == str(original)
    assert twin.spec == original.spec
    assert twin.observation_space == original.observation_space


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
@pytest.mark.parametrize("environment_id", IDS)
def test_before_the_first_reset(environment_id, copied):
    original = make_ours(environment_id).unwrapped
    twin = copied(original)
    with pytest.raises(walker_sim.ResetNeeded, match="there is no episode yet"):
        twin.step(random_actions(environment_id, 1)[0])
    observations = [environment.reset(seed=2)[0].tobytes() for environment in (original, twin)]
    assert observations[0] == observations[1]


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
@pytest.mark.parametrize("environment_id", IDS)
def test_after_the_end(environment_id, copied):
    original = make_ours(environment_id).unwrapped
    original.reset(seed=5)
    actions = random_actions(environment_id, 2000)
    steps = next(i for i, action in enumerate(actions, 1) if original.step(action)[2])
    twin = copied(original)
    with pytest.raises(walker_sim.ResetNeeded, match=f"ended after {steps} steps"):
        twin.step(actions[0])
    observations = [environment.reset()[0].tobytes() for environment in (original, twin)]
    assert observations[0] == observations[1]


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
def test_a_copy_of_a_closed_environment_is_closed(copied):
    original = make_ours("Walker2d-v5")
    original.reset(seed=1)
    original.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="reset first"):
        copied(original).step(np.zeros(6))


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
def test_time_limit_of_its_own(copied):
    original = WalkerEnv("Walker2d-v5", max_episode_steps=9, terminate_when_unhealthy=False)
    original.reset(seed=1)
    for _ in range(5):
        original.step(np.zeros(6))
    twin = copied(original)
    for environment in (original, twin):
        assert [environment.step(np.zeros(6))[3] for _ in range(4)] == [False, False, False, True]


@pytest.mark.parametrize("copied", [pickled, copy.deepcopy])
def test_a_reused_world_is_copied(copied):
    environment, untouched = (make_ours("BipedalWalker-v3", reuse_world=True) for _ in range(2))
    copied(environment).reset(seed=1)
    actions = random_actions("BipedalWalker-v3", 400)
    for each in (environment, untouched):
        each.reset(seed=1)
        follow(each, actions[:300])
    expected = follow(untouched, actions[300:])
    assert follow(copied(environment), actions[300:]) == expected
    assert follow(environment, actions[300:]) == expected


def test_another_version_is_refused():
    stored = pickle.dumps(_core.Environment("BipedalWalker-v3", {}), protocol=2)
    version = _core.__version__.encode()
    assert version in stored
    other = version[:-1] + b"x"
    with pytest.raises(ValueError, match=f"pickled by walker_sim {other.decode()} on Box2D"):
        pickle.loads(stored.replace(version, other))


def test_a_changed_model_is_noticed(tmp_path):
    model = tmp_path / "walker.xml"
    model.write_text(MODEL.read_text())
    environment = WalkerEnv("Walker2d-v5", xml_file=str(model))
    environment.reset(seed=1)
    environment.step(np.ones(6))
    stored = pickle.dumps(environment)
    pickle.loads(stored)
    changed = MODEL.read_text().replace('gear="100"', 'gear="90"')
    assert changed != MODEL.read_text()
    model.write_text(changed)
    with pytest.raises(ValueError, match="the state is of another model than this Walker2d-v5"):
        pickle.loads(stored)
