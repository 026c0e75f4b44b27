"""Writes a policy as a safetensors file, whose header has all metadata that acting needs.

docs/policies.md documents the format. `walker_sim._core.Policy` reads it and acts.
"""

from __future__ import annotations

import json
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.files import replace_file

FORMAT = "walker_sim policy 1"
OWN_METADATA = ("format", "id", "parameters", "activation", "output", "layers")
OBSERVATION_CLIP = 10.0
"""Normalised observations are clipped to plus and minus this value, the default of
Stable-Baselines3's VecNormalize. src/policy/network.cpp does the same."""


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
    """Returns the file's content, the same bytes for the same policy: the safetensors package
    would write the metadata in random order."""
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
    end = 0
    for name, tensor in tensors.items():
        begin, end = end, end + tensor.nbytes
        header[name] = {
            "dtype": f"F{8 * tensor.itemsize}",
            "shape": list(tensor.shape),
            "data_offsets": [begin, end],
        }
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return b"".join(
        [struct.pack("<Q", len(text)), text, *(tensor.tobytes() for tensor in tensors.values())]
    )


def read_policy(path: Path) -> PolicyFile:
    """Reads a policy that `walker_sim._core.Policy` has accepted or `write_policy` has written.

    ValueError if it is another file.
    """
    _core.Policy(os.fsencode(path))  # names what is wrong with a file; the lines below trust it
    content = path.read_bytes()
    (size,) = struct.unpack_from("<Q", content)
    header = json.loads(content[8 : 8 + size])
    metadata = header.pop("__metadata__")
    tensors = {
        name: np.frombuffer(
            content[8 + size + entry["data_offsets"][0] : 8 + size + entry["data_offsets"][1]],
            {"F64": "<f8", "F32": "<f4"}[entry["dtype"]],
        ).reshape(entry["shape"])
        for name, entry in header.items()
    }
    layers = [
        (tensors[f"layers.{i}.weight"], tensors[f"layers.{i}.bias"])
        for i in range(int(metadata["layers"]))
    ]
    return PolicyFile(
        env_id=metadata["id"],
        parameters=json.loads(metadata.get("parameters", "{}")),
        activation=metadata["activation"],
        output=metadata["output"],
        mean=tensors["observation.mean"],
        deviation=tensors["observation.deviation"],
        low=tensors["action.low"],
        high=tensors["action.high"],
        layers=layers,
        notes={name: text for name, text in metadata.items() if name not in OWN_METADATA},
    )


def write_policy(policy: PolicyFile, path: Path) -> None:
    replace_file(path, to_bytes(policy))
