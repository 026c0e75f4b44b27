"""Makes Stable-Baselines3's algorithms from settings, and policy files from them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from walker_sim.training.models import actor_layers
from walker_sim.training.policy_file import PolicyFile
from walker_sim.training.settings import Settings

INITIAL_LOG_STD = -0.5  # of learnt noise


def make_learner(settings: Settings, walkers: VecNormalize) -> Any:
    first_rate, last_rate = settings.learning_rate
    network: dict[str, Any] = {
        "activation_fn": {"tanh": nn.Tanh, "relu": nn.ReLU}[settings.activation],
        "net_arch": list(settings.layers),
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
    package = "sb3_contrib" if settings.algorithm == "tqc" else "stable_baselines3"
    algorithm: Any = getattr(importlib.import_module(package), settings.algorithm.upper())
    return algorithm(
        "MlpPolicy",
        walkers,
        # of the fraction of steps that remains, which a resumed training exceeds
        learning_rate=lambda left: last_rate + (first_rate - last_rate) * max(left, 0.0),
        gamma=settings.gamma,
        batch_size=settings.batch_size,
        seed=settings.seed,
        device="cpu",
        policy_kwargs=network,
        **own,
    )


def set_exploration(settings: Settings, model: Any, steps: int) -> None:
    """Sets PPO's noise by its linear schedule. Does nothing if the noise is learnt, as in SAC."""
    if settings.algorithm != "ppo" or settings.log_std is None:
        return
    begin, end = settings.log_std
    parameter = model.policy.log_std
    parameter.requires_grad_(False)
    parameter.data.fill_(begin + (end - begin) * min(steps / settings.steps, 1.0))


def actor_arrays(model: Any) -> list[NDArray[np.float32]]:
    """Returns copies of the weight and bias of each of the actor's layers in turn."""
    return [
        tensor.detach().numpy().copy()
        for layer in actor_layers(model.policy)
        if isinstance(layer, nn.Linear)
        for tensor in (layer.weight, layer.bias)
    ]


def to_policy(
    env_id: str,
    settings: Settings,
    walkers: VecNormalize,
    arrays: list[NDArray[np.float32]],
    steps: int,
) -> PolicyFile:
    """Returns a policy of the network `arrays` and the present observation statistics."""
    return PolicyFile(
        env_id=env_id,
        parameters={name: str(value) for name, value in settings.parameters.items()},
        activation=settings.activation,
        output="clip" if settings.algorithm == "ppo" else "tanh",
        mean=walkers.obs_rms.mean,
        deviation=np.sqrt(walkers.obs_rms.var + walkers.epsilon),
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
