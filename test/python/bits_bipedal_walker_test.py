"""BipedalWalker through Gymnasium's interface equals Gymnasium's BipedalWalker to the bit."""

import gymnasium
import numpy as np
import pytest
from bipedal_walker_reference import IDS, KINDS, Actions, play, without_reward
from gymnasium_reference import Plan, Session, equal_bits, first_difference, play_episode
from walkers import make_many, make_ours, make_reference, random_actions


@pytest.fixture(autouse=True)
def _needs_reference():
    make_reference(IDS[0])


def play_ours(session):
    environment = make_ours(session.environment_id, **session.parameters)
    return [
        play_episode(environment, plan, Actions(plan.kind, plan.action_seed))
        for plan in session.plans
    ]


def compare(ours, theirs):
    """Ignores rewards for float64 actions, which Gymnasium rounds differently."""
    for plan, our, their in zip(theirs.plans, play_ours(ours), play(theirs)):
        rows = our.rows, their.rows
        if plan.kind == "double":
            rows = [without_reward(row) for row in rows]
        assert equal_bits(*rows), (plan, first_difference(*rows))


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", KINDS)
def test_new_worlds(environment_id, kind):
    plans = [Plan(kind, seed, seed) for seed in (7000, 7001, 2**63 + 7)]
    session = Session(environment_id, {}, plans)
    compare(session, session)


@pytest.mark.parametrize("environment_id", IDS)
def test_new_worlds_with_one_generator(environment_id):
    """By default, episodes equal those of new Gymnasium environments that share one generator."""
    plans = [Plan("noisy", 41, 0), Plan("saturated", None, 1), Plan("double", None, 2)]
    session = Session(environment_id, {}, [*plans, Plan("noisy", None, 3)])
    compare(session, session)


@pytest.mark.parametrize("environment_id", IDS)
def test_reused_world(environment_id):
    """Episodes equal those of one Gymnasium environment, which keeps its world."""
    plans = [Plan("heuristic", 7100, 0), *(Plan(kind, None, i) for i, kind in enumerate(KINDS))]
    session = Session(environment_id, {"reuse_world": True}, [*plans, Plan("noisy", 7100, 9)])
    compare(session, session)


def test_hardcore():
    plans = [Plan("heuristic", 7200, 0), Plan("noisy", None, 1)]
    ours = Session("BipedalWalker-v3", {"hardcore": True, "max_episode_steps": 2000}, plans)
    compare(ours, Session("BipedalWalkerHardcore-v3", {}, plans))


@pytest.mark.parametrize("environment_id", IDS)
def test_a_generator_after_draws_and_assignment(environment_id):
    pair = make_ours(environment_id, reuse_world=True), make_reference(environment_id)
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
@pytest.mark.parametrize("environment_id", IDS)
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
