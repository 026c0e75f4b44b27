"""The walkers' `VecEnv` with the wrappers that a training needs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper, VecMonitor, VecNormalize

from walker_sim.training.policy_file import OBSERVATION_CLIP
from walker_sim.training.settings import Settings

FIRST_TRAINING_SEED = 1 << 40
"""Lower bound of training seeds, far from those on which policies are chosen and evaluated."""


class BoundedRewards(VecEnvWrapper):
    """Raises rewards to at least `least_reward`; None: returns them unchanged."""

    least_reward: float | None = None

    def reset(self) -> Any:
        return self.venv.reset()

    def step_wait(self) -> Any:
        observations, rewards, dones, infos = self.venv.step_wait()
        if self.least_reward is not None:
            rewards = np.maximum(rewards, self.least_reward)
        return observations, rewards, dones, infos


class DelayedActions(VecEnvWrapper):
    """Applies the previous action of a walker instead of the new one, with a fixed probability."""

    def __init__(self, venv: VecEnv, probability: float, seed: int) -> None:
        super().__init__(venv)
        self._probability, self._random = probability, np.random.default_rng(seed)

    def reset(self) -> Any:
        self._previous = np.zeros((self.num_envs, *self.action_space.shape), np.float32)
        return self.venv.reset()

    def step_async(self, actions: NDArray[np.float32]) -> None:
        is_late = self._random.random((self.num_envs, 1)) < self._probability
        self.venv.step_async(np.where(is_late, self._previous, actions))
        self._previous = actions.copy()

    def step_wait(self) -> Any:
        outcome = self.venv.step_wait()
        self._previous[outcome[2]] = 0  # an episode begins without an action
        return outcome


def wrap(walkers: VecEnv, settings: Settings) -> VecNormalize:
    """Adds the wrappers. The monitor is innermost: reported returns have no bound."""
    walkers = VecMonitor(walkers)
    if settings.action_delay > 0:
        walkers = DelayedActions(walkers, settings.action_delay, settings.seed)
    walkers = BoundedRewards(walkers)
    return VecNormalize(walkers, gamma=settings.gamma, clip_obs=OBSERVATION_CLIP)
