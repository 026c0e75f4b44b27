"""Episodes against the installed Gymnasium: every observation, reward and flag, bit by bit.

The seeds differ from the recorded ones (recordings_test.cpp).
"""

import numpy as np
import pytest
from bipedal_walker_reference import IDS, KINDS, play, without_reward
from gymnasium_reference import Plan, Session, equal_bits, first_difference


def our_rows(rollout, session, episodes):
    """Yields our environment's rows for the actions that were played in Gymnasium."""
    rollout.make(session.environment_id, **session.parameters)
    for plan, episode in zip(session.plans, episodes):
        yield np.vstack([rollout.reset(plan.seed), rollout.step(episode.actions)])


def compare(rollout, session):
    episodes = play(session)
    for plan, episode, ours in zip(session.plans, episodes, our_rows(rollout, session, episodes)):
        theirs = episode.rows
        if plan.kind == "double":
            ours, theirs = without_reward(ours), without_reward(theirs)
        assert equal_bits(ours, theirs), (plan, first_difference(ours, theirs))
    return episodes


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", KINDS)
def test_new_environments(rollout, environment_id, kind):
    for seed in range(2000, 2016):
        compare(rollout, Session(environment_id, {}, [Plan(kind, seed, seed)]))


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("first", range(3000, 3006))
def test_several_resets_in_one_world(rollout, environment_id, first):
    plans = [Plan("heuristic", first, 0)]
    plans += [Plan(kind, None, first + i) for i, kind in enumerate(KINDS)]
    plans += [Plan("noisy", first, first), Plan("heuristic", first + 1, 0)]
    compare(rollout, Session(environment_id, {"reuse_world": True}, plans))


@pytest.mark.parametrize("environment_id", IDS)
def test_new_worlds_with_one_generator(rollout, environment_id):
    """The default: equals new Gymnasium environments that pass on their random generator."""
    plans = [Plan("heuristic", 40, 0), Plan("noisy", None, 1), Plan("saturated", None, 2)]
    compare(rollout, Session(environment_id, {}, plans))


def test_limits_truncate_as_gymnasiums(rollout):
    """With these seeds the walkers reach the step limit."""
    for environment_id, limit in zip(IDS, (1600, 2000)):
        (episode,) = compare(rollout, Session(environment_id, {}, [Plan("random", 2, 2)]))
        assert len(episode.actions) == limit
        assert episode.rows[-1, -2:].tolist() == [0, 1]


def test_generator_state_is_numpys(rollout):
    import gymnasium

    environment = gymnasium.make(IDS[1])
    environment.reset(seed=2**63 + 5)
    state = environment.unwrapped.np_random.bit_generator.state
    rollout.make(IDS[1])
    rollout.reset(2**63 + 5)
    high_low = [divmod(state["state"][name], 2**64) for name in ("state", "inc")]
    expected = [*high_low[0], *high_low[1], state["has_uint32"], state["uinteger"]]
    assert rollout.generator_state().tolist() == expected


def test_a_reused_world_differs_from_a_new_one(rollout):
    """Negative control of the comparisons above."""
    plans = [Plan("heuristic", 102, 0), Plan("zero", None, 0), Plan("heuristic", 102, 0)]
    session = Session(IDS[0], {"reuse_world": True}, plans)
    episodes = play(session)
    rows = list(our_rows(rollout, session._replace(parameters={}), episodes))
    assert equal_bits(rows[0], episodes[0].rows)
    assert not equal_bits(rows[2], episodes[2].rows)


def test_one_bit_of_one_action_is_seen(rollout):
    session = Session(IDS[0], {}, [Plan("noisy", 1, 1)])
    (episode,) = play(session)
    episode.actions[20, 1] = np.nextafter(np.float32(episode.actions[20, 1]), np.float32(2))
    (ours,) = our_rows(rollout, session, [episode])
    assert not equal_bits(ours, episode.rows)
