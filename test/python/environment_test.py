"""Gymnasium's API of a single in-process environment. Other suites compare the bits."""

import copy
import inspect
import warnings

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.utils.env_checker import check_env
from mujoco_reference import own_model
from walker_sim import WalkerEnv, _core
from walkers import (
    IDS,
    ROBOTS,
    diverging,
    make_ours,
    make_theirs,
    random_actions,
)

PAIRS = pytest.mark.parametrize("environment_id", IDS)


def wrapper_types(environment):
    types = []
    while environment is not environment.unwrapped:
        types.append(type(environment))
        environment = environment.env
    return types


def warnings_of_check(environment):
    is_ours = isinstance(environment, WalkerEnv)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(environment, skip_render_check=not is_ours)
    return [str(warning.message).replace("walker_sim/", "") for warning in caught]


@PAIRS
@pytest.mark.usefixtures("pygame")
def test_the_checker_gives_no_more_warnings_than_for_gymnasiums_own(environment_id):
    theirs = warnings_of_check(make_theirs(environment_id).unwrapped)
    ours = warnings_of_check(make_ours(environment_id).unwrapped)
    assert [warning for warning in ours if warning not in theirs] == []


@PAIRS
def test_specification(environment_id):
    ours, theirs = make_ours(environment_id), make_theirs(environment_id)
    assert ours.spec.id == f"walker_sim/{environment_id}"
    assert ours.spec.id in walker_sim.ids()
    assert wrapper_types(ours) == wrapper_types(theirs)


WITH_POSITION = {"exclude_current_positions_from_observation": False}


@pytest.mark.parametrize(
    ("environment_id", "parameters"),
    [
        *((environment_id, {}) for environment_id in IDS),
        ("BipedalWalker-v3", {"hardcore": True}),
        *((environment_id, WITH_POSITION) for environment_id in ROBOTS),
        ("Walker2d-v5", {**WITH_POSITION, "frame_skip": 5}),
        *((robot, {"frame_skip": n}) for robot in ROBOTS[1::2] for n in (1, 3, 4, 5, 10)),
    ],
)
def test_spaces_and_metadata(environment_id, parameters):
    ours, theirs = (make(environment_id, **parameters) for make in (make_ours, make_theirs))
    assert ours.metadata == theirs.metadata
    is_robot = environment_id in ROBOTS
    assert ours.unwrapped.dt == (theirs.unwrapped.dt if is_robot else 1 / 50)
    assert ours.reset(seed=3)[0].shape == theirs.reset(seed=3)[0].shape
    for name in ("observation_space", "action_space"):
        our_space, their_space = getattr(ours, name), getattr(theirs, name)
        assert our_space == their_space
        assert our_space.dtype == their_space.dtype
        assert our_space.low.tobytes() == their_space.low.tobytes()
        assert our_space.high.tobytes() == their_space.high.tobytes()
        for space in (our_space, their_space):
            space.seed(5)
        assert our_space.sample().tobytes() == their_space.sample().tobytes()


@PAIRS
def test_results_have_gymnasiums_types_and_names(environment_id):
    ours = make_ours(environment_id)
    first, first_info = ours.reset(seed=2)
    action = random_actions(environment_id, 1)[0]
    second, *outcome, info = ours.step(action)
    for observation in (first, second):
        assert observation in ours.observation_space
        assert observation.dtype == ours.observation_space.dtype
        assert observation.flags.writeable
        assert observation.flags.owndata
    assert [type(value) for value in outcome] == [float, bool, bool]
    assert all(type(value) is float for value in info.values())
    theirs = make_theirs(environment_id)  # may skip the rest
    assert list(first_info) == list(theirs.reset(seed=2)[1])
    assert list(info) == list(theirs.step(action)[-1])


@pytest.mark.parametrize("environment_id", ROBOTS)
def test_parameters_and_their_defaults(environment_id):
    environment = make_theirs(environment_id)
    signature = inspect.signature(type(environment.unwrapped).__init__).parameters
    theirs = {name: parameter.default for name, parameter in signature.items()}
    for name in ("self", "default_camera_config", "kwargs"):  # the last two are for rendering
        theirs.pop(name, None)
    theirs["include_lidar_in_observation"] = False
    theirs["max_episode_steps"] = environment.spec.max_episode_steps
    ours = _core.Pool(environment_id, {}).specification["parameters"]
    assert list(ours) == list(theirs)
    if "xml_file" in theirs:
        theirs["xml_file"] = own_model(environment_id)  # the same model under a versioned name
    assert _core.Pool(environment_id, theirs).specification["parameters"] == ours


def state_after_seed(environment, seed):
    try:
        environment.reset(seed=seed)
    except Exception as error:
        return type(error), str(error)
    return seed is None or environment.unwrapped.np_random.bit_generator.state


@PAIRS
@pytest.mark.parametrize(
    "seed",
    [
        *(0, True, 2**32, 2**64, 2**100 + 1, np.int64(3), np.uint8(3), None),
        *(-1, -(10**400), 1.5, "1", b"1", [], {}, float("nan")),
    ],
    ids=repr,
)
def test_seeds_as_in_gymnasium(environment_id, seed):
    ours, theirs = make_ours(environment_id), make_theirs(environment_id)
    assert state_after_seed(ours, seed) == state_after_seed(theirs, seed)


@PAIRS
def test_np_random_equals_gymnasiums(environment_id):
    """Its state equals Gymnasium's even after the user draws from it or replaces it."""
    pair = [make(environment_id).unwrapped for make in (make_ours, make_theirs)]
    steps = [
        lambda environment: environment.reset(seed=11),
        lambda environment: environment.reset(),
        lambda environment: environment.np_random.uniform(),
        lambda environment: environment.reset(),
        lambda environment: environment.np_random.integers(5),  # leaves a buffered uint32
        lambda environment: environment.reset(),
        lambda environment: setattr(environment, "np_random", np.random.default_rng(99)),
        lambda environment: environment.reset(),
    ]
    for number, step in enumerate(steps):
        for environment in pair:
            step(environment)
        ours, theirs = (environment.np_random.bit_generator.state for environment in pair)
        assert ours == theirs, number


def test_np_random_seed():
    environment = make_ours("Walker2d-v5").unwrapped
    if not hasattr(gymnasium.Env, "np_random_seed"):
        pytest.skip("this Gymnasium has no np_random_seed")
    environment.reset(seed=17)
    assert environment.np_random_seed == 17
    environment.np_random = np.random.default_rng(1)
    assert environment.np_random_seed == -1
    environment.np_random = np.random.Generator(np.random.MT19937(1))
    with pytest.raises(ValueError, match="np_random uses MT19937; must use PCG64"):
        environment.reset()


@PAIRS
def test_after_close(environment_id):
    """As in Gymnasium, reset works after close, but step needs a reset first."""
    environment = make_ours(environment_id)
    action = environment.action_space.sample()
    expected, _ = environment.reset(seed=1)
    state = environment.unwrapped.np_random.bit_generator.state
    environment.close()
    environment.close()
    closed = "step: the environment has been closed; reset first"
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match=closed):
        environment.step(action)
    assert environment.unwrapped.np_random.bit_generator.state == state
    assert environment.reset(seed=1)[0].tobytes() == expected.tobytes()
    environment.step(action)


def test_parameters_of_numpy_types():
    plain = {"frame_skip": 2, "healthy_z_range": (0.5, 2.5), "terminate_when_unhealthy": False}
    numpys = {
        "frame_skip": np.int32(2),
        "healthy_z_range": np.array([0.5, 2.5]),
        "terminate_when_unhealthy": np.bool_(False),
    }
    one, other = (_core.Pool("Walker2d-v5", given).specification for given in (plain, numpys))
    assert one["parameters"] == other["parameters"]


def length_of(environment):
    """Returns the step of the truncation; None: not within 1100 steps."""
    environment.reset(seed=1)
    return next((i for i in range(1, 1101) if environment.step(np.zeros(6))[3]), None)


def test_time_limit():
    """Gymnasium's wrapper applies it; the environment itself has none by default."""
    endless = {"terminate_when_unhealthy": False}
    assert length_of(make_ours("Walker2d-v5", **endless)) == 1000
    assert length_of(make_ours("Walker2d-v5", max_episode_steps=7, **endless)) == 7
    limited = WalkerEnv("Walker2d-v5", max_episode_steps=5, **endless)
    assert issubclass(walker_sim.ResetNeeded, gymnasium.error.ResetNeeded)
    with pytest.raises(walker_sim.ResetNeeded, match="there is no episode yet; reset first"):
        limited.step(np.zeros(6))
    assert length_of(limited) == 5
    with pytest.raises(walker_sim.ResetNeeded, match="ended after 5 steps"):
        limited.step(np.zeros(6))
    for never in (None, -1, 0):
        unlimited = WalkerEnv("Walker2d-v5", max_episode_steps=never, **endless)
        assert length_of(unlimited) is None
    with pytest.raises(ValueError, match="max_episode_steps = -2"):
        WalkerEnv("Walker2d-v5", max_episode_steps=-2)


def test_a_failure_of_the_engine_ends_the_episode(tmp_path):
    """The info holds only the engine's error."""
    environment = WalkerEnv("Walker2d-v5", render_mode="rgb_array", **diverging(tmp_path))
    environment.reset(seed=1)
    info = environment.step(np.ones(6))[-1]
    assert list(info) == ["error"]
    assert info["error"].startswith("MuJoCo: ")
    for failed in (environment, copy.deepcopy(environment)):
        for call in (lambda one: one.step(np.zeros(6)), lambda one: one.render()):
            with pytest.raises(walker_sim.ResetNeeded, match="the simulation failed; reset first"):
                call(failed)
        failed.reset(seed=1)
        assert "error" not in failed.step(np.zeros(6))[-1]
