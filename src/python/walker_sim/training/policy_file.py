"""Writes a policy as a safetensors file, whose header has all metadata that acting needs.

docs/policies.md documents the format. `walker_sim._core.Policy` reads it and acts.
"""

from __future__ import annotations

import json
import os
import struct
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Mapping

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.files import replace_file

FORMAT = "walker_sim policy 1"
HISTORY = ("history.observations", "history.actions")
NO_HISTORY = (1, 0)
OWN_METADATA = ("format", "id", "parameters", "activation", "output", "layers", *HISTORY)
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
        Mean and standard deviation of the input, float64, shape (input size,).
    low, high
        Limits of the action, float32, shape (action size,).
    layers
        Weight, shape (outputs, inputs), and bias, shape (outputs,), of each layer, float32.
    notes
        Further metadata, texts by name: e.g. the settings' hash, steps, seed.
    history
        Numbers of latest observations and of latest actions in the input, which is the observations
        and then the actions, each from the oldest to the newest; zeros before the first step.
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
    history: tuple[int, int] = NO_HISTORY


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
            **history_notes(policy),
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
        history=history_of(metadata),
    )


def history_notes(policy: PolicyFile) -> dict[str, str]:
    """Returns the metadata of a history; empty without one."""
    return {} if policy.history == NO_HISTORY else dict(zip(HISTORY, map(str, policy.history)))


def history_of(metadata: Mapping[str, str]) -> tuple[int, int]:
    observations, actions = (
        int(metadata.get(name, absent)) for name, absent in zip(HISTORY, NO_HISTORY)
    )
    return observations, actions


def with_history(policy: PolicyFile, history: tuple[int, int]) -> PolicyFile:
    """Returns a policy with a longer history, and weights of zero for the added inputs.

    ValueError if the history would be shorter.
    """
    if any(own > wanted for own, wanted in zip(policy.history, history)):
        raise ValueError(
            f"history = {list(history)}: must be at least {list(policy.history)}, which the policy "
            "to start from has"
        )
    sizes = observation_size(policy), len(policy.low)
    begins = np.cumsum([0, sizes[0] * policy.history[0]])  # of the observations and the actions

    def extended(values: NDArray[Any], padding: NDArray[Any]) -> NDArray[Any]:
        """Puts padding, one observation and one action wide, before each part of the input."""
        parts = []
        for begin, own, wanted, pad in zip(
            begins, policy.history, history, np.split(padding, [sizes[0]], axis=-1)
        ):
            parts += [pad] * (wanted - own)
            parts.append(values[..., begin : begin + own * pad.shape[-1]])
        return np.concatenate(parts, axis=-1)

    newest = slice(begins[1] - sizes[0], begins[1])
    unit = np.ones(sizes[1])
    (weight, bias), *others = policy.layers
    return replace(
        policy,
        mean=extended(policy.mean, np.concatenate([policy.mean[newest], 0 * unit])),
        deviation=extended(policy.deviation, np.concatenate([policy.deviation[newest], unit])),
        layers=[(extended(weight, np.zeros((len(bias), sum(sizes)), np.float32)), bias), *others],
        history=history,
    )


def with_lidar(policy: PolicyFile, rays: int) -> PolicyFile:
    """Returns a policy whose observations have the lidar at their ends, with weights of zero for
    it. Its fractions of the range, 0 to 1, are normalised to -1 to 1."""
    ends = observation_size(policy) * np.arange(1, policy.history[0] + 1)
    places = np.repeat(ends, rays)
    (weight, bias), *others = policy.layers
    return replace(
        policy,
        mean=np.insert(policy.mean, places, 0.5),
        deviation=np.insert(policy.deviation, places, 0.5),
        layers=[(np.insert(weight, places, 0, axis=1), bias), *others],
    )


def observation_size(policy: PolicyFile) -> int:
    observations, actions = policy.history
    return (len(policy.mean) - actions * len(policy.low)) // observations


def write_policy(policy: PolicyFile, path: Path) -> None:
    replace_file(path, to_bytes(policy))
