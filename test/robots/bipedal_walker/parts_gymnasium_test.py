"""Spaces, terrain and heuristic against the installed Gymnasium's, bit by bit."""

import gymnasium
import numpy as np
import pytest
from bipedal_walker_reference import IDS, OBSERVATION_SIZE, play, terrain
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from gymnasium_reference import Plan, Session, equal_bits

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


def test_hardcore_as_a_parameter_keeps_the_limit(rollout):
    environment = gymnasium.make(IDS[0], hardcore=True)
    rollout.make(IDS[0], hardcore=True)
    assert rollout.spaces()[5] == environment.spec.max_episode_steps == 1600


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
