"""Makes Stable-Baselines3's algorithms and their environments from settings."""

from __future__ import annotations

import dataclasses
import importlib
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import (
    VecEnv,
    VecEnvWrapper,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)
from torch import nn

from walker_sim.training import ppo
from walker_sim.training.models import actor_layers
from walker_sim.training.policy_file import NO_HISTORY, OBSERVATION_CLIP, PolicyFile
from walker_sim.training.settings import ACTIVATION, LAYERS, Settings

INITIAL_LOG_STD = -0.5  # of learnt noise
OBSERVATIONS_BEFORE = 10**12
"""Number of observations for which the statistics of a policy to start from count. They stay as
they are: in another world new ones would scale observations as its network has not learnt them."""


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


class ActionHistory(VecEnvWrapper):
    """Adds the latest `count` actions to the observations; zeros before an episode's first step."""

    def __init__(self, venv: VecEnv, count: int) -> None:
        observed, acted = venv.observation_space, venv.action_space
        low, high = (
            np.append(getattr(observed, end), np.tile(getattr(acted, end), count))
            for end in ("low", "high")
        )
        super().__init__(venv, Box(low, high, dtype=observed.dtype))
        self._actions = np.zeros((self.num_envs, count * acted.shape[0]), observed.dtype)

    def reset(self) -> Any:
        self._actions[:] = 0
        return np.hstack([self.venv.reset(), self._actions])

    def step_async(self, actions: NDArray[np.float32]) -> None:
        kept = self._actions[:, actions.shape[1] :]
        self._actions[:] = np.hstack([kept, actions])
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        observations, rewards, dones, infos = self.venv.step_wait()
        for index in np.flatnonzero(dones):
            last = infos[index]["terminal_observation"]
            infos[index]["terminal_observation"] = np.append(last, self._actions[index])
            self._actions[index] = 0
        return np.hstack([observations, self._actions]), rewards, dones, infos


def wrap(walkers: VecEnv, settings: Settings) -> VecNormalize:
    """Adds the wrappers. The monitor is innermost: reported returns have no bound."""
    walkers = VecMonitor(walkers)
    if settings.action_delay > 0:
        walkers = DelayedActions(walkers, settings.action_delay, settings.seed)
    num_observations, num_actions = settings.history or NO_HISTORY
    if num_observations > 1:
        walkers = VecFrameStack(walkers, num_observations)
    if num_actions > 0:
        walkers = ActionHistory(walkers, num_actions)
    walkers = BoundedRewards(walkers)
    return VecNormalize(walkers, gamma=settings.gamma, clip_obs=OBSERVATION_CLIP)


def make_learner(settings: Settings, walkers: VecNormalize) -> Any:
    first_rate, last_rate = settings.learning_rate
    network: dict[str, Any] = {
        "activation_fn": {"tanh": ppo.Tanh, "relu": nn.ReLU}[settings.activation or ACTIVATION],
        "net_arch": list(LAYERS if settings.layers is None else settings.layers),
    }
    if settings.algorithm == "ppo":
        network["log_std_init"] = settings.log_std[0] if settings.log_std else INITIAL_LOG_STD
        own: dict[str, Any] = {
            "n_steps": settings.rollout,
            "n_epochs": settings.epochs,
            "gae_lambda": settings.gae_lambda,
            "clip_range": settings.clip_range,
            "ent_coef": settings.entropy,
        }
    else:
        own = {
            "buffer_size": settings.buffer_size,
            "learning_starts": settings.learning_starts,
            "train_freq": (settings.rollout, "step"),
            "gradient_steps": settings.epochs,
        }
    packages = {"ppo": "walker_sim.training.ppo", "tqc": "sb3_contrib"}
    package = packages.get(settings.algorithm, "stable_baselines3")
    algorithm: Any = getattr(importlib.import_module(package), settings.algorithm.upper())
    return algorithm(
        "MlpPolicy",
        walkers,
        # The part of the steps that remains is negative if the last rollout exceeds them.
        learning_rate=lambda left: last_rate + (first_rate - last_rate) * max(left, 0.0),
        gamma=settings.gamma,
        batch_size=settings.batch_size,
        seed=settings.seed,
        device="cpu",
        policy_kwargs=network,
        **own,
    )


def actor_arrays(model: Any) -> list[NDArray[np.float32]]:
    """Returns copies of the weight and bias of each of the actor's layers in turn."""
    return [
        tensor.detach().numpy().copy()
        for layer in actor_layers(model.policy)
        if isinstance(layer, nn.Linear)
        for tensor in (layer.weight, layer.bias)
    ]


def settings_for(start: PolicyFile, settings: Settings) -> Settings:
    """Returns the settings with the network of a policy to start from. ValueError if they ask for
    another, or if the policy is not PPO's."""
    sizes = tuple(len(bias) for _, bias in start.layers[:-1])
    if settings.layers not in (None, sizes):
        raise ValueError(
            f"layers = {list(settings.layers)}: must be {list(sizes)} as the policy to start from "
            "has them"
        )
    if start.output != "clip":
        raise ValueError("start: its actions are squashed by tanh; PPO's must be clipped")
    return dataclasses.replace(
        settings, layers=sizes, activation=start.activation, history=start.history
    )


def begin_with(start: PolicyFile, model: Any) -> None:
    """Sets the actor and the normalisation of observations to those of a policy."""
    linear = [layer for layer in actor_layers(model.policy) if isinstance(layer, nn.Linear)]
    with torch.no_grad():
        for layer, (weight, bias) in zip(linear, start.layers):
            layer.weight.copy_(torch.tensor(weight))
            layer.bias.copy_(torch.tensor(bias))
    walkers = model.get_env()
    statistics = walkers.obs_rms
    statistics.mean, statistics.count = start.mean.copy(), OBSERVATIONS_BEFORE
    statistics.var = start.deviation**2 - walkers.epsilon
