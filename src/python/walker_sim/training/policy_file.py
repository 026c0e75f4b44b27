"""Writes a policy as a file: safetensors, with a header that says all that acting needs.

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
"""Normalised observations are clipped to plus and minus this, as Stable-Baselines3's VecNormalize
does; acting clips them so in src/policy/network.cpp."""
_TYPES: dict[str, np.dtype[Any]] = {"F32": np.dtype("<f4"), "F64": np.dtype("<f8")}


@dataclass
class PolicyFile:
    """A network of fully connected layers, between a normalisation and the action's limits.

    Parameters
    ----------
    env_id, parameters
        What it was trained on; parameters as texts by name.
    activation
        Of every layer but the last: tanh or relu.
    output
        clip: the last layer's values, clipped to the limits; tanh: their tanh, scaled to them.
    mean, deviation
        Of observations, float64, shape (observation size,).
    low, high
        The action's limits, float32, shape (action size,).
    layers
        Weight, float32, shape (outputs, inputs), and bias, shape (outputs,), of each.
    notes
        Further texts by name: settings' hash, steps, seed.
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
    """Returns the file's content."""
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
    """Writes the file in one go, so that a reader sees the old one or the new one."""
    unfinished = path.with_name(path.name + ".new")
    unfinished.write_bytes(to_bytes(policy))
    unfinished.replace(path)
