"""Our heuristic against Gymnasium's on the observations of whole episodes, to the bit."""

import numpy as np
import pytest
from bipedal_walker_reference import IDS, OBSERVATION_SIZE, play
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from gymnasium_reference import Plan, Session, equal_bits


def gymnasium_actions(observations):
    heuristic = BipedalWalkerHeuristics()
    return np.array([heuristic.step_heuristic(o).copy() for o in observations.astype(np.float32)])


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("kind", ["heuristic", "noisy"])
def test_actions_are_equal(rollout, environment_id, kind):
    for seed in range(500, 520):
        (episode,) = play(Session(environment_id, {}, [Plan(kind, seed, seed)]))
        observations = episode.rows[:, :OBSERVATION_SIZE]
        ours = rollout.act(observations)
        assert equal_bits(ours, gymnasium_actions(observations)), seed
        if kind == "heuristic":
            assert equal_bits(ours[:-1], episode.actions), seed


def test_actions_are_equal_on_any_observation(rollout):
    random = np.random.default_rng(3)
    for _ in range(20):
        observations = random.normal(0, 0.5, (500, OBSERVATION_SIZE)).astype(np.float32)
        observations[:, [8, 13]] = random.integers(0, 2, (500, 2))
        assert equal_bits(rollout.act(observations), gymnasium_actions(observations))
