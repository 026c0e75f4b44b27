"""Reads trained models of Stable-Baselines3 and ONNX as fully connected layers."""

from __future__ import annotations

import importlib
import json
import pickle
import zipfile
from dataclasses import dataclass
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
    """Layers from a normalised observation to an action; `act` is the original model."""

    layers: list[tuple[Array, Array]]
    activation: str
    output: str  # clip or tanh, as in PolicyFile
    act: Callable[[Array], Array]
    notes: dict[str, str]

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
    if model.sizes != sizes:
        raise ModelError(
            f"takes {model.sizes[0]} observations and gives {model.sizes[1]} actions; {env_id} has"
            f" {sizes[0]} and {sizes[1]}"
        )
    mean, deviation = np.zeros(sizes[0]), np.ones(sizes[0])
    if normalization is not None:
        mean, deviation = _read_normalization(normalization, sizes[0])
    return PolicyFile(
        env_id=env_id,
        parameters={},
        activation=model.activation,
        output=model.output,
        mean=mean,
        deviation=deviation,
        low=np.array(specification["action_low"], np.float32),
        high=np.array(specification["action_high"], np.float32),
        layers=model.layers,
        notes=model.notes,
    )


def sb3_algorithm(data: dict[str, Any]) -> tuple[str, str]:
    """Returns package and class of the algorithm that saved a model.

    The file names the policy class, not the algorithm. Most algorithms have a policy class in a
    module of their own name. PPO and A2C share one in ``common``: a file with clip_range is PPO's.
    To act, A2C is equivalent.
    """
    home = str(data["policy_class"]["__module__"])
    package, _, rest = home.partition(".")
    algorithm = rest.partition(".")[0]
    if package in ("stable_baselines3", "sb3_contrib") and algorithm not in ("", "common"):
        return package, {"tqc": "TQC", "crossq": "CrossQ"}.get(algorithm, algorithm.upper())
    return "stable_baselines3", "PPO" if "clip_range" in data else "A2C"


def read_sb3(path: Path) -> Model:
    """Reads a file of PPO, A2C, SAC or TQC; ModelError if it is another file or its network is
    unsupported, ImportError without the library that saved it."""
    try:
        with zipfile.ZipFile(path) as file:
            data = json.loads(file.read("data"))
        package, name = sb3_algorithm(data)
    except OSError:
        raise
    except Exception as error:  # damaged archives raise many types
        raise ModelError(f"no model that Stable-Baselines3 has saved: {error}") from error
    if name not in ("PPO", "A2C", "SAC", "TQC"):
        raise ModelError(f"of {name}; must be of PPO, A2C, SAC or TQC")
    algorithm = getattr(importlib.import_module(package), name)
    try:
        model = algorithm.load(path, device="cpu")
    except Exception as error:
        raise ModelError(f"{package} does not load it: {error}") from error
    policy = model.policy
    if name in ("PPO", "A2C"):
        parts = [*policy.mlp_extractor.policy_net, policy.action_net]
    else:
        parts = [*policy.actor.latent_pi, policy.actor.mu]
    layers, activation = _torch_layers(parts)
    output = "clip" if name in ("PPO", "A2C") else "tanh"
    if getattr(policy, "squash_output", False):
        output = "tanh"

    def act(observations: Array) -> Array:
        actions: Array = model.predict(observations, deterministic=True)[0]
        return actions

    return Model(layers, activation, output, act, {"algorithm": name.lower()})


def _torch_layers(parts: list[Any]) -> tuple[list[tuple[Array, Array]], str]:
    layers: list[tuple[Array, Array]] = []
    activations = set()
    for part in parts:
        kind = type(part).__name__
        if kind == "Linear":
            bias = part.bias.detach().numpy()
            layers.append((part.weight.detach().numpy().copy(), bias.copy()))
        elif kind in ("Tanh", "ReLU"):
            activations.add(kind.lower())
        else:
            raise ModelError(f"has a layer {kind}; must be Linear, Tanh or ReLU")
    return layers, _only(activations)


def _only(activations: set[str]) -> str:
    if len(activations) > 1:
        raise ModelError("has tanh and relu; must have one of them")
    return activations.pop() if activations else "tanh"


def read_vec_normalize(path: Path) -> Any:
    """Reads a file of `VecNormalize.save`; ModelError for any other file."""
    try:
        with path.open("rb") as file:
            found = pickle.load(file)
    except Exception as error:  # unpickling can raise any type
        raise ModelError(f"no VecNormalize: {error}") from error
    if not hasattr(found, "normalize_obs"):
        raise ModelError(f"no VecNormalize, but {type(found).__name__}")
    return found


def _read_normalization(path: Path, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    try:
        normalize = read_vec_normalize(path)
        statistics, epsilon = normalize.obs_rms, normalize.epsilon
        clip, is_used = normalize.clip_obs, normalize.norm_obs
        mean, variance = np.array(statistics.mean), np.array(statistics.var)
    except (ModelError, AttributeError) as error:
        raise ModelError(f"--normalization {path}: {error}") from error
    if mean.shape != (size,):
        raise ModelError(f"--normalization {path}: has shape {mean.shape}; must be ({size},)")
    if not is_used:
        raise ModelError(f"--normalization {path}: it does not normalise observations")
    if clip != OBSERVATION_CLIP:
        raise ModelError(f"--normalization {path}: clips at {clip}; must be {OBSERVATION_CLIP:g}")
    return mean, np.sqrt(variance + epsilon)


def read_onnx(path: Path) -> Model:
    """Reads an ONNX graph of fully connected layers; ModelError if it is another file or graph,
    ImportError without onnx."""
    onnx: Any = importlib.import_module("onnx")
    try:
        graph = onnx.load(str(path)).graph
    except Exception as error:  # protobuf raises several types
        raise ModelError(f"no ONNX: {error}") from error
    values = {each.name: onnx.numpy_helper.to_array(each) for each in graph.initializer}
    layers: list[tuple[Array, Array]] = []
    kinds: list[str] = []
    for node in graph.node:
        kind = node.op_type
        constants = [values[name] for name in node.input if name in values]
        if kind == "Constant":
            values[node.output[0]] = onnx.numpy_helper.to_array(node.attribute[0].t)
        elif kind == "Gemm":
            layers.append(_gemm(onnx, node, constants))
        elif kind == "MatMul" and len(constants) == 1:
            weight = np.asarray(constants[0], np.float32).T
            layers.append((weight, np.zeros(len(weight), np.float32)))
        elif kind == "Add" and len(constants) == 1 and layers:
            weight, bias = layers[-1]
            layers[-1] = weight, bias + np.asarray(constants[0], np.float32)
        elif kind in ("Tanh", "Relu"):
            kinds.append(kind.lower())
        elif kind not in ("Identity", "Flatten"):
            raise ModelError(f"has a node {kind}; must be Gemm, MatMul, Add, Tanh or Relu")
    if not layers or len(kinds) not in (len(layers) - 1, len(layers)):
        raise ModelError(f"has {len(layers)} layers and {len(kinds)} activations")
    output = "tanh" if len(kinds) == len(layers) else "clip"
    if output == "tanh" and kinds.pop() != "tanh":
        raise ModelError("ends in Relu; must end in a layer or Tanh")

    def act(observations: Array) -> Array:
        reference: Any = importlib.import_module("onnx.reference")
        runner = reference.ReferenceEvaluator(str(path))
        (actions,) = runner.run(None, {graph.input[0].name: observations})
        result: Array = np.clip(actions, -1, 1)
        return result

    return Model(layers, _only(set(kinds)), output, act, {"algorithm": "onnx"})


def _gemm(onnx: Any, node: Any, constants: list[Any]) -> tuple[Array, Array]:
    settings = {each.name: onnx.helper.get_attribute_value(each) for each in node.attribute}
    if settings.get("alpha", 1) != 1 or settings.get("beta", 1) != 1 or settings.get("transA", 0):
        raise ModelError("has a Gemm with alpha, beta or transA")
    if not constants:
        raise ModelError("has a Gemm without a constant weight")
    weight = np.asarray(constants[0], np.float32)
    if not settings.get("transB", 0):
        weight = weight.T
    bias = np.zeros(len(weight), np.float32)
    if len(constants) > 1:
        bias = bias + np.asarray(constants[1], np.float32)
    return np.ascontiguousarray(weight), bias
