"""Terrain, heuristic and episodes against the installed Gymnasium's, bit by bit.

The seeds differ from the recorded ones (recordings_test.cpp).
"""

import gymnasium
import numpy as np
import pytest
from bipedal_walker_reference import (
    IDS,
    KINDS,
    OBSERVATION_SIZE,
    Actions,
    play,
    terrain,
    without_reward,
)
from draws import terrain as our_terrain
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from gymnasium_reference import Plan, Session, equal_bits, first_difference, play_episode
from walker_sim import _core
from walkers import make_many, make_ours, random_actions

LARGE_SEEDS = np.random.default_rng(2).integers(0, 2**64, 200, np.uint64)
BOTH = pytest.mark.parametrize("environment_id", IDS)


# ---------------------------------------------------------------- terrain and heuristic


@pytest.mark.parametrize("hardcore", [False, True])
def test_terrain_clouds_and_push(hardcore):
    seeds = [*range(1000, 2200), *map(int, LARGE_SEEDS)]  # 0 .. 999 are recorded
    differing = [
        seed
        for seed in seeds
        if not equal_bits(our_terrain(hardcore, seed), terrain(hardcore, seed))
    ]
    assert differing == []


def test_another_seed_or_variant_is_another_terrain():
    """Negative control of the comparison above."""
    plain = our_terrain(False, 5)
    assert not equal_bits(plain, terrain(False, 6))
    assert not equal_bits(plain, terrain(True, 5))


def our_actions(observations):
    agent = _core.Agent("heuristic", IDS[0], {}, 0)
    actions = np.empty((len(observations), 4))
    for observation, action in zip(observations.astype(np.float64), actions):
        agent.act(observation, action)
    return actions


def gymnasium_actions(observations):
    heuristic = BipedalWalkerHeuristics()
    return np.array([heuristic.step_heuristic(o).copy() for o in observations.astype(np.float32)])


@BOTH
@pytest.mark.parametrize("kind", ["heuristic", "noisy"])
def test_heuristic_on_whole_episodes(environment_id, kind):
    for seed in range(500, 520):
        (episode,) = play(Session(environment_id, {}, [Plan(kind, seed, seed)]))
        observations = episode.rows[:, :OBSERVATION_SIZE]
        ours = our_actions(observations)
        assert equal_bits(ours, gymnasium_actions(observations)), seed
        if kind == "heuristic":
            assert equal_bits(ours[:-1], episode.actions), seed


def test_heuristic_on_any_observation():
    random = np.random.default_rng(3)
    for _ in range(20):
        observations = random.normal(0, 0.5, (500, OBSERVATION_SIZE)).astype(np.float32)
        observations[:, [8, 13]] = random.integers(0, 2, (500, 2))
        actions = our_actions(observations)
        assert equal_bits(actions, gymnasium_actions(observations))
        assert np.abs(actions).max() == 1, "the bounds are reached"


# ---------------------------------------------------------------- episodes


def play_ours(session, actions_of=Actions):
    environment = make_ours(session.environment_id, **session.parameters)
    return [
        play_episode(environment, plan, actions_of(plan.kind, plan.action_seed))
        for plan in session.plans
    ]


def compare(ours, theirs=None):
    """Ignores rewards for float64 actions, which Gymnasium rounds differently."""
    episodes = play(theirs or ours)
    for plan, our, their in zip(ours.plans, play_ours(ours), episodes):
        rows = our.rows, their.rows
        if plan.kind == "double":
            rows = [without_reward(row) for row in rows]
        assert equal_bits(*rows), (plan, first_difference(*rows))
    return episodes


@BOTH
@pytest.mark.parametrize("kind", KINDS)
def test_new_worlds(environment_id, kind):
    seeds = [*range(2000, 2016), 7000, 7001, 2**63 + 7]
    compare(Session(environment_id, {}, [Plan(kind, seed, seed) for seed in seeds]))


@BOTH
def test_new_worlds_with_one_generator(environment_id):
    """By default, episodes equal those of new Gymnasium environments that share one generator."""
    plans = [Plan("heuristic", 40, 0), Plan("noisy", None, 1), Plan("saturated", None, 2)]
    plans += [Plan("noisy", 41, 0), Plan("saturated", None, 1), Plan("double", None, 2)]
    compare(Session(environment_id, {}, [*plans, Plan("noisy", None, 3)]))


@BOTH
@pytest.mark.parametrize("first", [*range(3000, 3006), 7100])
def test_reused_world(environment_id, first):
    """Episodes equal those of one Gymnasium environment, which keeps its world."""
    plans = [Plan("heuristic", first, 0)]
    plans += [Plan(kind, None, first + i) for i, kind in enumerate(KINDS)]
    plans += [Plan("noisy", first, first), Plan("heuristic", first + 1, 0)]
    compare(Session(environment_id, {"reuse_world": True}, plans))


def test_hardcore():
    plans = [Plan("heuristic", 7200, 0), Plan("noisy", None, 1)]
    ours = Session("BipedalWalker-v3", {"hardcore": True, "max_episode_steps": 2000}, plans)
    compare(ours, Session("BipedalWalkerHardcore-v3", {}, plans))


def test_limits_truncate_as_gymnasiums():
    """With these seeds the walkers reach the step limit."""
    for environment_id, limit in zip(IDS, (1600, 2000)):
        (episode,) = compare(Session(environment_id, {}, [Plan("random", 2, 2)]))
        assert len(episode.actions) == limit
        assert episode.rows[-1, -2:].tolist() == [0, 1]


def test_a_reused_world_differs_from_a_new_one():
    """Negative control of the comparisons above."""
    plans = [Plan("heuristic", 102, 0), Plan("zero", None, 0), Plan("heuristic", 102, 0)]
    theirs = play(Session(IDS[0], {"reuse_world": True}, plans))
    ours = play_ours(Session(IDS[0], {}, plans))
    assert equal_bits(ours[0].rows, theirs[0].rows)
    assert not equal_bits(ours[2].rows, theirs[2].rows)


class OneBitOff(Actions):
    """Changes the last bit of one action after 20 steps."""

    num_drawn = 0

    def draw(self, observation):
        action = super().draw(observation)
        if self.num_drawn == 20:
            action[1] = np.nextafter(np.float32(action[1]), np.float32(2))
        self.num_drawn += 1
        return action


def test_one_bit_of_one_action_is_seen():
    session = Session(IDS[0], {}, [Plan("noisy", 1, 1)])
    (ours,), (theirs,) = play_ours(session, OneBitOff), play(session)
    assert equal_bits(ours.rows[:21], theirs.rows[:21])
    assert not equal_bits(ours.rows, theirs.rows)


@BOTH
def test_a_generator_after_draws_and_assignment(environment_id):
    pair = make_ours(environment_id, reuse_world=True), gymnasium.make(environment_id)
    actions = random_actions(environment_id, 60)
    rows = []
    for environment in pair:
        observations = [environment.reset(seed=12)[0]]
        environment.unwrapped.np_random.integers(3)
        observations.append(environment.reset()[0])
        environment.unwrapped.np_random = np.random.default_rng(4)
        observations.append(environment.reset()[0])
        for action in actions:
            observation, _, terminated, *_ = environment.step(action)
            observations.append(observation)
            if terminated:
                break
        rows.append(np.array(observations))
    assert equal_bits(*rows)


@pytest.mark.parametrize("mode", ["sync", "async"])
@BOTH
def test_gymnasiums_vector_environments(environment_id, mode):
    if not hasattr(gymnasium.vector, "AutoresetMode"):
        pytest.skip("this Gymnasium's make_vec is another one")
    vectors = (
        make_many(environment_id, 3, vectorization_mode=mode, reuse_world=True),
        gymnasium.make_vec(environment_id, 3, vectorization_mode=mode),
    )
    actions = random_actions(environment_id, 3 * 250).reshape(250, 3, 4)
    rows = []
    for vector in vectors:
        results = [vector.reset(seed=[5, 6, 7])[0]]
        for action in actions:
            observations, *outcome, infos = vector.step(action)
            assert infos == {}
            results.append(np.column_stack([observations, *outcome]))
        vector.close()
        rows.append(np.concatenate([result.ravel() for result in results]))
    assert equal_bits(*rows)
    assert sum(result[:, -2].any() for result in results[1:]) >= 2
