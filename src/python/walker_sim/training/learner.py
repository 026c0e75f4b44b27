"""Makes Stable-Baselines3's algorithms from settings, and policy files from them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from torch import nn

from walker_sim.training.policy_file import PolicyFile
from walker_sim.training.settings import Settings
from walker_sim.training.walkers import EPSILON, NormalizedVecEnv

_ACTIVATIONS = {"tanh": nn.Tanh, "relu": nn.ReLU}
LEARNT_LOG_STD = -0.5


def make_learner(settings: Settings, walkers: NormalizedVecEnv) -> Any:
    layers = list(settings.layers)
    network = {"activation_fn": _ACTIVATIONS[settings.activation]}
    common = {
        "learning_rate": schedule(settings),
        "gamma": settings.gamma,
        "batch_size": settings.batch_size,
        "seed": settings.seed,
        "device": "cpu",
    }
    if settings.algorithm == "ppo":
        begin = LEARNT_LOG_STD if settings.log_std is None else settings.log_std[0]
        return PPO(
            "MlpPolicy",
            walkers,
            n_steps=settings.rollout,
            n_epochs=settings.epochs,
            gae_lambda=settings.gae_lambda,
            clip_range=settings.clip_range,
            ent_coef=settings.entropy,
            policy_kwargs={**network, "net_arch": layers, "log_std_init": begin},
            **common,
        )
    return algorithm_class(settings)(
        "MlpPolicy",
        walkers,
        buffer_size=settings.buffer_size,
        learning_starts=settings.learning_starts,
        train_freq=(settings.rollout, "step"),
        gradient_steps=settings.epochs,
        policy_kwargs={**network, "net_arch": layers},
        **common,
    )


def algorithm_class(settings: Settings) -> Any:
    module = "sb3_contrib" if settings.algorithm == "tqc" else "stable_baselines3"
    return getattr(importlib.import_module(module), settings.algorithm.upper())


def schedule(settings: Settings) -> Any:
    """Returns the learning rate as a function of the fraction of steps that remains."""
    begin, end = settings.learning_rate
    return lambda left: end + (begin - end) * max(left, 0.0)


def set_exploration(settings: Settings, model: Any, steps: int) -> None:
    """Sets PPO's noise by its linear schedule. Does nothing if the noise is learnt, as in SAC."""
    if settings.algorithm != "ppo" or settings.log_std is None:
        return
    begin, end = settings.log_std
    parameter = model.policy.log_std
    parameter.requires_grad_(False)
    parameter.data.fill_(begin + (end - begin) * min(steps / settings.steps, 1.0))


def actor_layers(model: Any) -> list[nn.Linear]:
    """Returns the linear layers of the actor, from observation to action."""
    policy = model.policy
    if hasattr(policy, "mlp_extractor"):
        parts = [*policy.mlp_extractor.policy_net, policy.action_net]
    else:
        parts = [*policy.actor.latent_pi, policy.actor.mu]
    return [part for part in parts if isinstance(part, nn.Linear)]


def actor_arrays(model: Any) -> list[np.ndarray[Any, np.dtype[np.float32]]]:
    """Returns copies of the weight and bias of each of the actor's layers in turn."""
    with torch.no_grad():
        return [
            tensor.numpy().copy()
            for layer in actor_layers(model)
            for tensor in (layer.weight, layer.bias)
        ]


def to_policy(
    env_id: str,
    settings: Settings,
    walkers: NormalizedVecEnv,
    arrays: list[np.ndarray[Any, np.dtype[np.float32]]],
    steps: int,
) -> PolicyFile:
    """Returns a policy of the network `arrays` and the present observation statistics."""
    statistics = walkers.observation_statistics
    return PolicyFile(
        env_id=env_id,
        parameters={name: str(value) for name, value in settings.parameters.items()},
        activation=settings.activation,
        output="clip" if settings.algorithm == "ppo" else "tanh",
        mean=statistics.mean.copy(),
        deviation=np.sqrt(statistics.var + EPSILON),
        low=walkers.action_space.low,
        high=walkers.action_space.high,
        layers=list(zip(arrays[::2], arrays[1::2])),
        notes={
            "algorithm": settings.algorithm,
            "steps": str(steps),
            "seed": str(settings.seed),
            "settings": settings.hash(),
        },
    )


def save_model(model: Any, folder: Path) -> None:
    """Saves networks, optimisers and the replay buffer, if any."""
    model.save(folder / "model.zip", exclude=["lr_schedule", "learning_rate", "clip_range"])
    if model.__dict__.get("replay_buffer") is not None:
        model.save_replay_buffer(folder / "buffer.pkl")


def load_model(model: Any, folder: Path) -> None:
    """Loads the files of `save_model` into a new learner with the same settings."""
    model.set_parameters(folder / "model.zip", exact_match=True, device="cpu")
    if (folder / "buffer.pkl").exists():
        model.load_replay_buffer(folder / "buffer.pkl")
