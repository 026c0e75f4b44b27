"""A policy as a file: safetensors, with a header that says all that acting needs.

docs/policies.md documents the format; include/walker_sim/policy.h reads it in C++.
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
does."""
_TYPES: dict[str, np.dtype[Any]] = {"F32": np.dtype("<f4"), "F64": np.dtype("<f8")}
_LARGEST_HEADER = 1 << 20
# What there is at places where something else belongs.
_WRONG = (AttributeError, LookupError, OverflowError, RecursionError, TypeError, ValueError)


class PolicyFileError(ValueError):
    """A file is no policy. The message names the file and what is wrong."""


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

    def act(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """Actions, shape (n, action size), for observations, shape (n, observation size)."""
        normal = (np.asarray(observations, np.float64) - self.mean) / self.deviation
        values = np.clip(normal, -OBSERVATION_CLIP, OBSERVATION_CLIP).astype(np.float32)
        for index, (weight, bias) in enumerate(self.layers):
            values = values @ weight.T + bias
            if index + 1 < len(self.layers):
                values = np.tanh(values) if self.activation == "tanh" else np.maximum(values, 0)
        if self.output == "tanh":
            half = (self.high - self.low) / 2
            values = self.low + half * (np.tanh(values) + 1)
        actions: NDArray[np.float32] = np.clip(values, self.low, self.high)
        return actions


def write_policy(policy: PolicyFile, path: Path) -> None:
    """Writes the file in one go, so that a reader sees the old one or the new one."""
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
    unfinished = path.with_name(path.name + ".new")
    unfinished.write_bytes(b"".join(parts))
    unfinished.replace(path)


def read_policy(path: Path) -> PolicyFile:
    """Reads a file that `write_policy` has written.

    Raises
    ------
    PolicyFileError
        Naming the file and what is wrong with it.
    OSError
        Where it cannot be read.
    """
    data = path.read_bytes()
    try:
        return _decode(data)
    except (*_WRONG, struct.error) as error:
        raise PolicyFileError(f"{path}: no policy: {error}") from error


def _decode(data: bytes) -> PolicyFile:
    (size,) = struct.unpack_from("<Q", data)
    if size > min(len(data) - 8, _LARGEST_HEADER):
        raise ValueError(f"its header has {size} bytes, the file {len(data)}")
    header = json.loads(data[8 : 8 + size])
    notes = dict(header.pop("__metadata__"))
    if notes.pop("format") != FORMAT:
        raise ValueError(f"its format is not {FORMAT!r}")
    values = data[8 + size :]
    tensors = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        flat = np.frombuffer(values[begin:end], _TYPES[entry["dtype"]])
        tensors[name] = flat.reshape(entry["shape"]).copy()
    layers = [
        (tensors[f"layers.{index}.weight"], tensors[f"layers.{index}.bias"])
        for index in range(int(notes.pop("layers")))
    ]
    return PolicyFile(
        env_id=notes.pop("id"),
        parameters=json.loads(notes.pop("parameters")),
        activation=notes.pop("activation"),
        output=notes.pop("output"),
        mean=tensors["observation.mean"],
        deviation=tensors["observation.deviation"],
        low=tensors["action.low"],
        high=tensors["action.high"],
        layers=layers,
        notes=notes,
    )
