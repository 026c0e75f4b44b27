"""The policy from which a training starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping, Tuple

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.training.policy_file import PolicyFile, read_policy, to_bytes

HIDDEN_SCALE = 0.3  # of what a linear policy becomes in tanh units, where they are nearly linear

Layers = List[Tuple[NDArray[np.float32], NDArray[np.float32]]]


def read_start(start: str | Path, env_id: str, parameters: Mapping[str, Any]) -> PolicyFile:
    """Reads the policy that `start` names: a file, ``shipped``, or an id for its shipped one.
    ValueError if it does not fit the environment."""
    own = env_id if start == "shipped" else start
    policy = read_policy(shipped_policy(str(own)) if own in _core.ids() else Path(own))
    _core.Policy.from_bytes("start", to_bytes(policy)).check(env_id, dict(parameters))
    return policy


def fitted(start: PolicyFile | None, sizes: list[int], random: np.random.Generator) -> Layers:
    """Returns layers of these sizes, from observation to action. They act as `start` does, which
    has layers of these sizes or is linear; without it, actions are zero."""
    if start is not None:
        own = [start.layers[0][0].shape[1], *(len(bias) for _, bias in start.layers)]
        if own == sizes:
            return start.layers
        if len(own) > 2 or len(sizes) != 3 or sizes[1] < sizes[2] or start.activation != "tanh":
            raise ValueError(
                f"layers = {sizes[1:-1]}: must be {own[1:-1]} as the policy to start from has "
                "them, or, if that is linear, one layer with at least a unit for each action"
            )
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        weight = random.standard_normal((outputs, inputs)) / np.sqrt(inputs)
        layers.append((weight.astype(np.float32), np.zeros(outputs, np.float32)))
    layers[-1][0][:] = 0
    if start is not None:
        # The first units compute the linear actions; the others do not act yet.
        (weight, bias), (last, _) = layers
        count = sizes[-1]
        weight[:count] = HIDDEN_SCALE * start.layers[0][0]
        bias[:count] = HIDDEN_SCALE * start.layers[0][1]
        last[:, :count] = np.eye(count) / HIDDEN_SCALE
    return layers
