"""Distribution of episodes over environments, tested with fake environments."""

import numpy as np
import pytest
from walker_sim.commands.episodes import play
from walker_sim.transport import Batch


class CountingWalkers:
    """Fake environments. An episode with seed s ends at step s; observations are step counts."""

    def __init__(self, num_envs, last_reward=1.0, error="", env_id="BipedalWalker-v3", refused=()):
        self.specification = {"id": env_id, "info_names": ["x"], "action_low": [-1.0]}
        self.num_envs, self.last_reward, self.text = num_envs, last_reward, error
        self.lengths, self.steps = np.zeros(num_envs), np.zeros(num_envs)
        self.actions = []
        self.refused = refused  # seeds whose resets fail

    def rows(self):
        return self.steps[:, np.newaxis].copy(), np.full((self.num_envs, 1), np.nan)

    def reset(self, environments, seeds):
        chosen = environments or list(range(self.num_envs))
        self.lengths[chosen] = seeds or 10**6
        self.steps[chosen] = 0
        return self.rows()

    def step(self, actions):
        assert (self.lengths > 0).all(), "an environment without an episode"
        self.actions.append(actions.copy())
        self.steps += 1
        ends = self.steps == self.lengths
        rewards = np.where(ends, self.last_reward, 1.0)
        observations, info = self.rows()
        return Batch(observations, rewards, ends, np.zeros(self.num_envs, bool), info)

    def world_values(self, environments):
        return [{}] * len(environments)

    def error(self, environment):
        return self.text

    def reset_error(self, environment):
        return "no ground" if self.lengths[environment] in self.refused else ""


def by_count(seed):
    return lambda observation: np.full(1, seed + observation[0] / 100, np.float32)


@pytest.mark.parametrize("num_envs", [1, 2, 5, 9])
def test_plays_one_episode_per_seed(num_envs):
    seeds = [3, 7, 1, 4, 2]
    walkers = CountingWalkers(num_envs)
    episodes = sorted(play(walkers, seeds, by_count, keeps_steps=True))
    assert [episode.seed for episode in episodes] == seeds
    for episode in episodes:
        assert episode.length == episode.episode_return == episode.seed
        assert [row[0] for row in episode.steps.observations] == [*range(episode.seed + 1)]
        wanted = [np.float32(episode.seed + step / 100) for step in range(episode.seed)]
        assert [action[0] for action in episode.steps.actions] == wanted
        assert len(episode.steps.infos) == episode.seed + 1
    assert len(walkers.actions) < sum(seeds) + 1


@pytest.mark.parametrize("num_envs", [1, 2, 5, 9])
def test_failed_reset_is_an_episode_without_steps(num_envs):
    seeds = [3, 7, 1, 4, 2]
    walkers = CountingWalkers(num_envs, refused=(3, 1, 2))
    episodes = sorted(play(walkers, seeds, by_count))
    assert [episode.seed for episode in episodes] == seeds
    assert [episode.length for episode in episodes] == [0, 7, 0, 4, 0]
    failed, arrived = ("failed", "no ground"), ("arrived", "")
    assert [(episode.end, episode.error) for episode in episodes] == [
        *(failed, arrived, failed, arrived, failed)
    ]


def test_idle_environments_get_zero_actions():
    walkers = CountingWalkers(3)
    list(play(walkers, [2, 5], by_count))
    assert [bool(actions[0]) for actions in walkers.actions] == [True] * 2 + [False] * 3
    assert [bool(actions[1]) for actions in walkers.actions] == [True] * 5
    assert not any(actions[2] for actions in walkers.actions)


@pytest.mark.parametrize(
    ("keywords", "end"),
    [
        ({}, "arrived"),
        ({"last_reward": -100.0}, "fell"),
        ({"last_reward": 0.0, "error": "the engine's words"}, "failed"),
        ({"env_id": "Walker2d-v5"}, "terminated"),
    ],
)
def test_ends(keywords, end):
    (episode,) = play(CountingWalkers(1, **keywords), [2], by_count)
    assert (episode.end, episode.error) == (end, keywords.get("error", ""))
