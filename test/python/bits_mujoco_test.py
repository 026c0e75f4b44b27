"""MuJoCo robots through Gymnasium's interface.

Whole episodes equal the recordings of Gymnasium on MuJoCo 2.2.2 to the bit. With the installed
Gymnasium and MuJoCo, resets are equal to the bit, and the first steps within the difference between
MuJoCo versions (see test/robots/mujoco/episodes_gymnasium_test.py).
"""

import numpy as np
import pytest

pytest.importorskip("mujoco")  # the reference imports Gymnasium's module, which needs it

from gymnasium_reference import Plan, Session, equal_bits, hashes, play_episode
from mujoco_reference import (
    IDS,
    INFO_NAMES,
    KINDS,
    NEARLY_ALL,
    OTHER_PARAMETERS,
    Actions,
    action_size,
    comparable,
    play,
    robot_of,
)
from recording_file import read_sessions
from walkers import assert_same, make_many, make_ours, make_reference, random_actions

STEPS = 20
NEAR = 1e-9


def play_ours(session):
    environment = make_ours(session.environment_id, **session.parameters)
    info_names = INFO_NAMES[session.environment_id]
    size = action_size(session.environment_id)
    return [
        play_episode(environment, plan, Actions(plan.kind, plan.action_seed, size), info_names)
        for plan in session.plans
    ]


@pytest.mark.parametrize("environment_id", IDS)
def test_every_recorded_step(environment_id):
    kinds = []
    for session, recorded in read_sessions(f"{robot_of(environment_id).lower()}_episodes.txt"):
        if session.environment_id != environment_id:
            continue
        for plan, episode, expected in zip(session.plans, play_ours(session), recorded):
            rows = comparable(environment_id, plan.kind, episode.rows)
            ours = hashes(rows) & np.uint64(0xFFFFFFFF)
            assert ours.tolist() == expected.tolist(), (session, plan)
            kinds.append(plan.kind)
    assert len(kinds) >= 120
    assert set(kinds) == set(KINDS)


def largest_differences(session):
    """Returns each episode's largest difference. Asserts equal resets and lengths."""
    make_reference(session.environment_id)
    session = session._replace(parameters={"max_episode_steps": STEPS, **session.parameters})
    differences = []
    for plan, ours, theirs in zip(session.plans, play_ours(session), play(session)):
        assert equal_bits(ours.rows[0], theirs.rows[0]), plan
        assert ours.rows.shape == theirs.rows.shape, (plan, "ended at another step")
        differences.append(np.abs(ours.rows[1:] - theirs.rows[1:]).max())
    return np.array(differences)


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", ["random", "saturated", "outside"])
def test_first_steps(environment_id, kind):
    plans = [Plan(kind, seed, seed) for seed in range(5000, 5100)]
    differences = largest_differences(Session(environment_id, {}, plans))
    assert (differences <= NEAR).mean() >= NEARLY_ALL[robot_of(environment_id)]
    assert (differences <= 1e-5).all()


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("parameters", OTHER_PARAMETERS, ids=str)
def test_parameters(environment_id, parameters):
    plans = [Plan("random", 2**64 - 1, 1), *(Plan("saturated", None, seed) for seed in range(30))]
    session = Session(environment_id, parameters, plans)
    assert (largest_differences(session) <= NEAR).mean() >= 0.96


def test_async_vector_env_equals_sync_vector_env():
    """SyncVectorEnv steps the environments that the tests above compare with Gymnasium."""
    ours, theirs = (
        make_many("Walker2d-v5", 3, vectorization_mode=mode) for mode in ("async", "sync")
    )
    assert_same(ours.reset(seed=[5, 6, 7]), theirs.reset(seed=[5, 6, 7]))
    ends = 0
    for actions in random_actions("Walker2d-v5", 3 * 150).reshape(150, 3, 6):
        result = ours.step(actions)
        assert_same(result, theirs.step(actions))
        ends += result[2].sum()
    ours.close()
    assert ends >= 6
