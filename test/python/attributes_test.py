"""Attributes and methods of Gymnasium's environments, and the table of those that ours lack."""

import pathlib
import re

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import WalkerEnv
from walkers import IDS, ROBOTS, make_many, make_ours, make_reference, make_theirs, random_actions

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md"


def attributes(environment):
    return {
        name
        for name in dir(environment)
        if not name.startswith("_") and not hasattr(gymnasium.Env, name)
    }


@pytest.mark.parametrize("env_id", IDS)
def test_the_docs_name_all_missing_attributes(env_id):
    theirs = attributes(make_theirs(env_id).unwrapped)
    ours = make_ours(env_id).unwrapped
    ours.reset(seed=1)
    missing = {name for name in theirs if not hasattr(ours, name)} - {"control_cost"}
    rows = re.findall(r"^\| (`.*) \|.*\|.*\|$", DOCS.read_text(), re.MULTILINE)
    assert missing - {*re.findall(r"`(\w+)`", " ".join(rows))} == set()


WITH_POSITION = {"exclude_current_positions_from_observation": False}
KEYWORDS = [
    *((env_id, {}) for env_id in IDS),
    ("BipedalWalker-v3", {"hardcore": True}),
    *((env_id, WITH_POSITION) for env_id in ("Walker2d-v5", "Hopper-v5")),
]


@pytest.mark.parametrize(("env_id", "keywords"), KEYWORDS, ids=str)
def test_constant_attributes(env_id, keywords):
    theirs, ours = (make(env_id, **keywords).unwrapped for make in (make_theirs, make_ours))
    many = make_many(env_id, 2, **keywords)
    for name in ("hardcore", "observation_structure"):
        assert hasattr(ours, name) == hasattr(theirs, name), name
        if hasattr(theirs, name):
            assert getattr(ours, name) == getattr(theirs, name)
            assert type(getattr(ours, name)) is type(getattr(theirs, name))
            assert many.get_attr(name) == (getattr(theirs, name),) * 2
            with pytest.raises(AttributeError):
                setattr(ours, name, 1)
        else:
            with pytest.raises(AttributeError, match=f"{name}: {env_id} has no such attribute"):
                getattr(ours, name)


@pytest.mark.parametrize(("env_id", "size"), [("Walker2d-v5", 9), ("Hopper-v5", 6)])
def test_observation_structure_with_the_lidar(env_id, size):
    ours = make_ours(env_id, include_lidar_in_observation=True).unwrapped
    expected = {"skipped_qpos": 1, "qpos": size - 1, "qvel": size, "lidar": 10}
    assert ours.observation_structure == expected
    assert sum(expected.values()) - 1 == ours.observation_space.shape[0]


@pytest.mark.parametrize("env_id", ROBOTS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_control_cost(env_id, dtype):
    keywords = {"ctrl_cost_weight": 0.37}
    theirs = make_theirs(env_id, **keywords).unwrapped
    ours = make_ours(env_id, **keywords).unwrapped
    for action in random_actions(env_id, 20).astype(dtype):
        expected = theirs.control_cost(action)
        assert ours.control_cost(action) == expected
        assert type(ours.control_cost(action)) is type(expected)


def test_control_cost_equals_the_rewards_term():
    make_reference("Walker2d-v5")  # skips if Gymnasium's cost has another precision
    ours = make_ours("Walker2d-v5").unwrapped
    ours.reset(seed=1)
    for action in random_actions("Walker2d-v5", 20):
        assert ours.step(action)[4]["reward_ctrl"] == -ours.control_cost(action)
        ours.set_state([0, 1.25, *[0] * 7], [0] * 9)


@pytest.mark.parametrize("env_id", ROBOTS)
def test_is_healthy(env_id):
    """Checks states on both sides of each bound, and velocities that observations would clip."""
    theirs, ours = make_theirs(env_id).unwrapped, make_ours(env_id).unwrapped
    with pytest.raises(walker_sim.ResetNeeded, match="is_healthy: there is no episode yet"):
        _ = ours.is_healthy
    theirs.reset(seed=1)
    ours.reset(seed=1)
    size = theirs.model.nq
    seen = set()
    for index in range(2 * size):
        for value in (-150, -99, -1.01, -0.99, -0.19, 0.69, 0.71, 0.79, 0.81, 1.99, 2.01, 99, 150):
            state = np.zeros(2 * size)
            state[1] = 1.25
            state[index] = value
            for environment in (theirs, ours):
                environment.set_state(state[:size], state[size:])
            assert ours.is_healthy == theirs.is_healthy, (index, value)
            seen.add(ours.is_healthy)
    assert seen == {True, False}


def test_refused_coordinates():
    robot, walker = WalkerEnv("Hopper-v5"), WalkerEnv("BipedalWalker-v3")
    zeros = np.zeros(6)
    with pytest.raises(walker_sim.ResetNeeded, match="set_state: there is no episode yet"):
        robot.set_state(zeros, zeros)
    robot.reset(seed=1)
    walker.reset(seed=1)
    before = robot.get_state()
    for qpos, qvel, message in [
        (zeros, np.zeros((6, 1)), r"qvel has the shape \(6, 1\); must be one-dimensional"),
        (zeros, [0, 0, 0, 0, 0, np.nan], r"qvel\[5\] = nan; must be finite"),
        (zeros, ["a"] * 6, "could not convert"),
    ]:
        with pytest.raises(ValueError, match=message):
            robot.set_state(qpos, qvel)
    assert robot.get_state() == before
    with pytest.raises(RuntimeError, match="BipedalWalker-v3 has no positions and velocities"):
        walker.set_state(zeros, zeros)
    with pytest.raises(TypeError, match="must be bytes, as get_state gives them"):
        robot.set_state(zeros)
    robot.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="set_state: "):
        robot.set_state(zeros, zeros)


@pytest.mark.parametrize("env_id", IDS[:2])
def test_bipedal_walker_lacks_the_robots_attributes(env_id):
    ours = make_ours(env_id).unwrapped
    for when in ("before a reset", "after it"):
        with pytest.raises(AttributeError, match=f"is_healthy: {env_id} has no such attribute"):
            _ = ours.is_healthy
        with pytest.raises(AttributeError, match=f"control_cost: {env_id} has no such method"):
            ours.control_cost(np.zeros(4))
        assert ours.reset(seed=1), when
