"""Reads trained models of Stable-Baselines3 as fully connected layers."""

from __future__ import annotations

import importlib
import json
import pickle
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from walker_sim.training.policy_file import OBSERVATION_CLIP, PolicyFile

Array = NDArray[np.float32]


class ModelError(ValueError):
    """The model cannot be converted; the message has the reason."""


@dataclass
class Model:
    """Layers from a normalised observation to an action; `act` is the original model.

    Parameters
    ----------
    layers, activation, output, notes
        As in `PolicyFile`.
    act
        Takes normalised observations, or observations if there is a `normalization`.
    normalization
        Mean and deviation of observations, if the model contains them.
    limits
        Lower and upper limits of actions, infinite where the model has none; None: the
        environment's.
    env_id, parameters
        The environment of the training, if the model names it.
    history
        As in `PolicyFile`; None: the latest observations alone, as VecFrameStack stacks them.
    """

    layers: list[tuple[Array, Array]]
    activation: str
    output: str
    act: Callable[[NDArray[Any]], NDArray[Any]]
    notes: dict[str, str]
    normalization: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    limits: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    env_id: str = ""
    parameters: dict[str, str] = field(default_factory=dict)
    history: tuple[int, int] | None = None

    @property
    def sizes(self) -> tuple[int, int]:
        """Sizes of observations and actions."""
        return self.layers[0][0].shape[1], self.layers[-1][0].shape[0]


def to_policy(
    model: Model, env_id: str, specification: dict[str, Any], normalization: Path | None
) -> PolicyFile:
    """Makes a policy of a model, and of a `VecNormalize` file if there is one; ModelError if the
    sizes or the normalisation do not fit the environment."""
    sizes = len(specification["observation_low"]), len(specification["action_low"])
    history = model.history or (max(model.sizes[0] // sizes[0], 1), 0)
    if model.sizes != (history[0] * sizes[0] + history[1] * sizes[1], sizes[1]):
        raise ModelError(
            f"takes {model.sizes[0]} observations and gives {model.sizes[1]} actions; {env_id} has"
            f" {sizes[0]} and {sizes[1]}"
        )
    inputs = model.sizes[0]
    mean, deviation = model.normalization or (np.zeros(inputs), np.ones(inputs))
    if normalization is not None:
        if model.normalization is not None:
            raise ModelError(
                f"normalises observations itself: --normalization {normalization} is not allowed"
            )
        statistics = read_vec_normalize(normalization, inputs)
        if not statistics.norm_obs:
            raise ModelError(f"--normalization {normalization}: does not normalise observations")
        if statistics.clip_obs != OBSERVATION_CLIP:
            raise ModelError(
                f"--normalization {normalization}: clips at {statistics.clip_obs}; must be"
                f" {OBSERVATION_CLIP:g}"
            )
        mean = statistics.obs_rms.mean
        deviation = np.sqrt(statistics.obs_rms.var + statistics.epsilon)
    low, high = (np.array(specification[f"action_{end}"], np.float64) for end in ("low", "high"))
    if model.limits is not None:
        low, high = (np.where(np.isinf(a), b, a) for a, b in zip(model.limits, (low, high)))
    return PolicyFile(
        env_id=env_id,
        parameters=model.parameters,
        activation=model.activation,
        output=model.output,
        mean=mean,
        deviation=deviation,
        low=low.astype(np.float32),
        high=high.astype(np.float32),
        layers=model.layers,
        notes=model.notes,
        history=history,
    )


def load_sb3(path: Path) -> tuple[str, Any]:
    """Loads a model that Stable-Baselines3 or its contrib has saved. Returns its class and itself.

    The file names the policy class, not the algorithm. Most algorithms have a policy class in a
    module of their own name. PPO, A2C and TRPO share one in ``common``: a file with clip_range is
    PPO's. To act, the others are equivalent. A class of the user's own is taken for one of these;
    if it keeps a state, `predict` returns it.

    Raises
    ------
    ModelError
        If it is another file, or cannot be loaded.
    ImportError
        If the library that saved it is not installed.
    """
    try:
        with zipfile.ZipFile(path) as file:
            data = json.loads(file.read("data"))
        module = str(data["policy_class"]["__module__"])
    except Exception as error:  # damaged archives raise many types
        raise ModelError(f"not a model saved by Stable-Baselines3: {error}") from error
    package, _, rest = module.partition(".")
    algorithm = rest.partition(".")[0]
    if module == "sb3_contrib.common.recurrent.policies":
        name = "RecurrentPPO"
    elif package == "sb3_contrib" and algorithm in ("", "common"):  # of MaskablePPO, or unknown
        raise ModelError(f"has a policy class of {module}, which is not supported")
    elif package in ("stable_baselines3", "sb3_contrib") and algorithm not in ("", "common"):
        name = {"crossq": "CrossQ"}.get(algorithm, algorithm.upper())
    else:
        package, name = "stable_baselines3", "PPO" if "clip_range" in data else "A2C"
    try:
        loader = getattr(importlib.import_module(package), name)
    except (ImportError, AttributeError) as error:
        raise ImportError(
            f"needs {package}: pip install {package.replace('_', '-')} ({error})"
        ) from error
    try:
        return name, loader.load(str(path), device="cpu")
    except Exception as error:
        raise ModelError(f"{package} does not load it: {error}") from error


def actor_layers(policy: Any) -> list[Any]:
    """Returns the modules of an actor of Stable-Baselines3, from observation to action."""
    if hasattr(policy, "mlp_extractor"):
        return [*policy.mlp_extractor.policy_net, policy.action_net]
    return [*policy.actor.latent_pi, policy.actor.mu]


def read_sb3(path: Path) -> Model:
    """Reads a file of PPO, A2C, SAC or TQC. Raises as `load_sb3`, and ModelError if the algorithm
    or a layer is unsupported."""
    name, model = load_sb3(path)
    if name not in ("PPO", "A2C", "SAC", "TQC"):
        raise ModelError(f"of {name}; must be of PPO, A2C, SAC or TQC")
    if model.predict(model.observation_space.sample())[1] is not None:
        raise ModelError("is recurrent; a policy file has no recurrent state")
    layers: list[tuple[Array, Array]] = []
    activations = set()
    for part in actor_layers(model.policy):
        kind = type(part).__name__
        if kind == "Linear":
            layers.append((part.weight.detach().numpy(), part.bias.detach().numpy()))
        elif kind in ("Tanh", "ReLU"):
            activations.add(kind.lower())
        else:
            raise ModelError(f"has a layer {kind}; must be Linear, Tanh or ReLU")
    is_squashed = name in ("SAC", "TQC") or getattr(model.policy, "squash_output", False)

    def act(observations: Array) -> Array:
        actions: Array = model.predict(observations, deterministic=True)[0]
        return actions

    output = "tanh" if is_squashed else "clip"
    return Model(layers, _only(activations), output, act, {"algorithm": name.lower()})


def _only(activations: set[str]) -> str:
    if len(activations) > 1:
        raise ModelError("has tanh and relu; must have one of them")
    return activations.pop() if activations else "tanh"


def read_vec_normalize(path: Path, size: int) -> Any:
    """Reads a file of `VecNormalize.save`; ModelError for any other file or observation size."""
    try:
        with path.open("rb") as file:
            normalization = pickle.load(file)
    except Exception as error:  # unpickling can raise any type
        raise ModelError(f"--normalization {path}: not a VecNormalize: {error}") from error
    if not hasattr(normalization, "normalize_obs"):
        kind = type(normalization).__name__
        raise ModelError(f"--normalization {path}: not a VecNormalize, but {kind}")
    shape = normalization.obs_rms.mean.shape if normalization.norm_obs else (size,)
    if shape != (size,):
        raise ModelError(f"--normalization {path}: has shape {shape}; must be ({size},)")
    return normalization
