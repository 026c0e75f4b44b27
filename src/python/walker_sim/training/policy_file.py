"""Writes a policy as a safetensors file, whose header has all metadata that acting needs.

docs/policies.md documents the format. `walker_sim._core.Policy` reads it and acts.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = "walker_sim policy 1"
OBSERVATION_CLIP = 10.0
"""Normalised observations are clipped to plus and minus this value, the default of
Stable-Baselines3's VecNormalize. src/policy/network.cpp does the same."""
_TYPES: dict[str, np.dtype[Any]] = {"F32": np.dtype("<f4"), "F64": np.dtype("<f8")}


@dataclass
class PolicyFile:
    """Network of fully connected layers, with normalised observations and limited actions.

    Parameters
    ----------
    env_id, parameters
        Environment of the training; parameters map names to texts.
    activation
        Activation of every layer but the last: tanh or relu.
    output
        clip: clips the last layer's values to the action's limits; tanh: scales their tanh to them.
    mean, deviation
        Mean and standard deviation of observations, float64, shape (observation size,).
    low, high
        Limits of the action, float32, shape (action size,).
    layers
        Weight, shape (outputs, inputs), and bias, shape (outputs,), of each layer, float32.
    notes
        Further metadata, texts by name: e.g. the settings' hash, steps, seed.
    """

    env_id: str
    parameters: dict[str, str]
    activation: str
    output: str
    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    layers: list[tuple[NDArray[np.float32], NDArray[np.float32]]]
    notes: dict[str, str] = field(default_factory=dict)


def to_bytes(policy: PolicyFile) -> bytes:
    tensors: dict[str, NDArray[Any]] = {
        "observation.mean": policy.mean.astype("<f8"),
        "observation.deviation": policy.deviation.astype("<f8"),
        "action.low": policy.low.astype("<f4"),
        "action.high": policy.high.astype("<f4"),
    }
    for index, (weight, bias) in enumerate(policy.layers):
        tensors[f"layers.{index}.weight"] = weight.astype("<f4")
        tensors[f"layers.{index}.bias"] = bias.astype("<f4")
    header: dict[str, Any] = {
        "__metadata__": {
            "format": FORMAT,
            "id": policy.env_id,
            "parameters": json.dumps(policy.parameters, sort_keys=True),
            "activation": policy.activation,
            "output": policy.output,
            "layers": str(len(policy.layers)),
            **policy.notes,
        }
    }
    names = {dtype: name for name, dtype in _TYPES.items()}
    begin = 0
    for name, tensor in tensors.items():
        end = begin + tensor.nbytes
        header[name] = {
            "dtype": names[tensor.dtype],
            "shape": list(tensor.shape),
            "data_offsets": [begin, end],
        }
        begin = end
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    parts = [struct.pack("<Q", len(text)), text]
    parts += [np.ascontiguousarray(tensor).tobytes() for tensor in tensors.values()]
    return b"".join(parts)


def write_policy(policy: PolicyFile, path: Path) -> None:
    """Replaces the file atomically: a reader sees the old or the new content."""
    unfinished = path.with_name(path.name + ".new")
    unfinished.write_bytes(to_bytes(policy))
    unfinished.replace(path)
