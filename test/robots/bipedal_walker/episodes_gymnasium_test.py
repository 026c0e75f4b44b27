"""Spaces, terrain, heuristic and episodes against the installed Gymnasium's, bit by bit.

The seeds differ from the recorded ones (recordings_test.cpp).
"""

import gymnasium
import numpy as np
import pytest
from bipedal_walker_reference import IDS, KINDS, OBSERVATION_SIZE, play, terrain, without_reward
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from gymnasium_reference import Plan, Session, equal_bits, first_difference

LARGE_SEEDS = np.random.default_rng(2).integers(0, 2**64, 200, np.uint64)


@pytest.mark.parametrize("environment_id", IDS)
def test_spaces_and_limits(rollout, environment_id):
    environment = gymnasium.make(environment_id)
    rollout.make(environment_id)
    low, high, action_low, action_high, dt, limit, threshold = rollout.spaces()
    observations, actions = environment.observation_space, environment.action_space
    assert observations.dtype == actions.dtype == np.float32
    assert equal_bits(low, observations.low)
    assert equal_bits(high, observations.high)
    assert equal_bits(action_low, actions.low)
    assert equal_bits(action_high, actions.high)
    assert dt == 1 / environment.metadata["render_fps"]
    assert limit == environment.spec.max_episode_steps
    assert threshold == environment.spec.reward_threshold


@pytest.mark.parametrize("hardcore", [False, True])
def test_terrain_clouds_and_push(rollout, hardcore):
    seeds = [*range(1000, 2200), *map(int, LARGE_SEEDS)]  # 0 .. 999 are recorded
    differing = [
        seed
        for seed in seeds
        if not equal_bits(rollout.terrain(hardcore, seed), terrain(hardcore, seed))
    ]
    assert differing == []


def test_another_seed_or_variant_is_another_terrain(rollout):
    """Negative control of the comparison above."""
    plain = rollout.terrain(False, 5)
    assert not equal_bits(plain, terrain(False, 6))
    assert not equal_bits(plain, terrain(True, 5))


def gymnasium_actions(observations):
    heuristic = BipedalWalkerHeuristics()
    return np.array([heuristic.step_heuristic(o).copy() for o in observations.astype(np.float32)])


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", ["heuristic", "noisy"])
def test_heuristic_on_whole_episodes(rollout, environment_id, kind):
    for seed in range(500, 520):
        (episode,) = play(Session(environment_id, {}, [Plan(kind, seed, seed)]))
        observations = episode.rows[:, :OBSERVATION_SIZE]
        ours = rollout.act(observations)
        assert equal_bits(ours, gymnasium_actions(observations)), seed
        if kind == "heuristic":
            assert equal_bits(ours[:-1], episode.actions), seed


def test_heuristic_on_any_observation(rollout):
    random = np.random.default_rng(3)
    for _ in range(20):
        observations = random.normal(0, 0.5, (500, OBSERVATION_SIZE)).astype(np.float32)
        observations[:, [8, 13]] = random.integers(0, 2, (500, 2))
        actions = rollout.act(observations)
        assert equal_bits(actions, gymnasium_actions(observations))
        assert np.abs(actions).max() == 1, "the bounds are reached"


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
