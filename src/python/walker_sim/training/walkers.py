"""Stable-Baselines3 vector environment for training, with normalised observations and rewards."""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from walker_sim.training.policy_file import OBSERVATION_CLIP
from walker_sim.training.settings import Settings
from walker_sim.transport import ServerAddress, make_walkers, spaces_of

REWARD_CLIP = 10.0
EPSILON = 1e-8
"""REWARD_CLIP and EPSILON are the defaults of Stable-Baselines3's VecNormalize."""
FIRST_TRAINING_SEED = 1 << 40
"""Lower bound of training seeds, far from those on which policies are chosen and evaluated."""
_RETURNS_TOLD = 100
_NOTHING: dict[str, Any] = {}

Outcome = Any
"""Observations, rewards, terminated, truncated: arrays with one row per walker."""


class Source(Protocol):
    """Walkers with autoreset mode same_step."""

    observation_space: Box
    action_space: Box

    def reset(self, seeds: list[int]) -> NDArray[Any]:
        """Begins an episode of each walker. Returns observations, shape (n, observation size)."""

    def step(self, actions: NDArray[np.float32]) -> Outcome:
        """Steps all walkers."""

    def final_observations(self, ended: NDArray[np.intp]) -> NDArray[Any]:
        """Returns the last observations of the episodes that ended in the last step, by row."""

    def close(self) -> None:
        """Releases the walkers' resources."""


class PoolSource:
    """Walkers of a pool of this package."""

    def __init__(self, env_id: str, settings: Settings, num_threads: int) -> None:
        self._walkers = make_walkers(
            *(env_id, settings.num_envs, "same_step", dict(settings.parameters), ServerAddress()),
            num_threads,
        )
        self.observation_space, self.action_space = spaces_of(self._walkers.specification)

    def reset(self, seeds: list[int]) -> NDArray[Any]:
        return self._walkers.reset([], seeds)[0]

    def step(self, actions: NDArray[np.float32]) -> Outcome:
        batch = self._walkers.step(actions.astype(np.float64))
        # Stable-Baselines3's vector environments return rewards in single precision.
        return (
            batch.observations,
            batch.rewards.astype(np.float32),
            batch.terminated,
            batch.truncated,
        )

    def final_observations(self, ended: NDArray[np.intp]) -> NDArray[Any]:
        return self._walkers.final_rows(self._walkers.num_envs)[0][ended]

    def close(self) -> None:
        self._walkers.close()


class GymnasiumSource:
    """Gymnasium's walkers in Stable-Baselines3's DummyVecEnv, as the benchmark's reference."""

    def __init__(self, env_id: str, settings: Settings) -> None:
        parameters = dict(settings.parameters)
        self._walkers = DummyVecEnv(
            [lambda: gymnasium.make(env_id, **parameters)] * settings.num_envs
        )
        self.observation_space = self._walkers.observation_space
        self.action_space = self._walkers.action_space
        self._infos: list[dict[str, Any]] = []

    def reset(self, seeds: list[int]) -> NDArray[Any]:
        self._walkers.seed(seeds[0])
        return np.array(self._walkers.reset())

    def step(self, actions: NDArray[np.float32]) -> Outcome:
        observations, rewards, dones, self._infos = self._walkers.step(actions)
        is_cut_off = [info["TimeLimit.truncated"] for info in self._infos]
        truncated = np.array(is_cut_off, np.bool_)
        return observations, rewards, dones & ~truncated, truncated

    def final_observations(self, ended: NDArray[np.intp]) -> NDArray[Any]:
        return np.stack([self._infos[index]["terminal_observation"] for index in ended])

    def close(self) -> None:
        self._walkers.close()


class NormalizedVecEnv(VecEnv):
    """Vector environment of a source's walkers for a learner.

    If an episode has ended, its infos have ``terminal_observation``, ``TimeLimit.truncated`` and
    ``episode``, which Stable-Baselines3's learners need. Other infos are empty.
    """

    render_mode: str | None = None

    def __init__(self, source: Source, settings: Settings) -> None:
        size = source.observation_space.shape
        super().__init__(
            settings.num_envs,
            Box(-OBSERVATION_CLIP, OBSERVATION_CLIP, size, np.float32),
            source.action_space,
        )
        self.settings = settings
        self.observation_statistics = RunningMeanStd(shape=size)
        self.return_statistics = RunningMeanStd(shape=())
        self.returns: deque[float] = deque(maxlen=_RETURNS_TOLD)
        self._source = source
        self._random = np.random.default_rng(settings.seed)
        self._discounted = np.zeros(settings.num_envs)
        self._return = np.zeros(settings.num_envs)
        self._length = np.zeros(settings.num_envs, np.int64)
        self._held = np.zeros((settings.num_envs, *source.action_space.shape), np.float32)
        self._actions = self._held

    def reset(self) -> NDArray[np.float32]:
        first = FIRST_TRAINING_SEED + self.settings.seed * (1 << 20)
        observations = self._source.reset(list(range(first, first + self.num_envs)))
        self._begin_all()
        self.observation_statistics.update(observations)
        return self.normal(observations)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        if self.settings.action_delay > 0:
            is_late = self._random.random((self.num_envs, 1)) < self.settings.action_delay
            self._held, actions = actions, np.where(is_late, self._held, actions)
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        observations, rewards, terminated, truncated = self._source.step(self._actions)
        dones = terminated | truncated
        self._return += rewards
        self._length += 1
        infos = [_NOTHING] * self.num_envs
        ended = np.flatnonzero(dones)
        if ended.size:
            self._conclude(ended, truncated & ~terminated, infos)
        self.observation_statistics.update(observations)
        return self.normal(observations), self._learnt_rewards(rewards, dones), dones, infos

    def normal(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """Returns observations normalised by their running statistics and clipped."""
        statistics = self.observation_statistics
        values = (observations - statistics.mean) / np.sqrt(statistics.var + EPSILON)
        normal: NDArray[np.float32] = np.clip(values, -OBSERVATION_CLIP, OBSERVATION_CLIP).astype(
            np.float32
        )
        return normal

    def close(self) -> None:
        self._source.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        raise AttributeError(f"{attr_name} cannot be set to {value!r}")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **keywords: Any
    ) -> list[Any]:
        raise AttributeError(f"walkers stepped together have no method {method_name}")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]

    def _begin_all(self) -> None:
        for values in (self._discounted, self._return, self._length, self._held):
            values[:] = 0

    def _conclude(
        self, ended: NDArray[np.intp], is_cut_off: NDArray[np.bool_], infos: list[dict[str, Any]]
    ) -> None:
        last = self.normal(self._source.final_observations(ended))
        for row, index in enumerate(ended.tolist()):
            episode_return = float(self._return[index])
            self.returns.append(episode_return)
            infos[index] = {
                "terminal_observation": last[row],
                "TimeLimit.truncated": bool(is_cut_off[index]),
                "episode": {"r": episode_return, "l": int(self._length[index])},
            }
        self._return[ended] = 0
        self._length[ended] = 0
        self._held = self._held.copy()
        self._held[ended] = 0

    def _learnt_rewards(
        self, rewards: NDArray[np.float32], dones: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Returns rewards divided by the standard deviation of discounted returns, and clipped."""
        if self.settings.least_reward is not None:
            rewards = np.maximum(rewards, self.settings.least_reward)
        self._discounted = self._discounted * self.settings.gamma + rewards
        self.return_statistics.update(self._discounted)
        self._discounted[dones] = 0
        scaled = rewards / np.sqrt(self.return_statistics.var + EPSILON)
        learnt: NDArray[np.float32] = np.clip(scaled, -REWARD_CLIP, REWARD_CLIP).astype(np.float32)
        return learnt
