"""Attributes of Gymnasium's own walkers that wrappers and learners read."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray


def attributes_of(specification: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the constant attributes: ``hardcore`` of BipedalWalker, ``observation_structure`` of
    Walker2d-v5 and Hopper-v5."""
    parameters = specification["parameters"]
    attributes: dict[str, Any] = {}
    if "hardcore" in parameters:
        attributes["hardcore"] = parameters["hardcore"] == "true"
    if "frame_skip" in parameters:  # v5
        skipped = int(parameters["exclude_current_positions_from_observation"] == "true")
        size = (len(specification["observation_low"]) + skipped) // 2  # slides and hinges: nq = nv
        attributes["observation_structure"] = {
            "skipped_qpos": skipped,
            "qpos": size - skipped,
            "qvel": size,
        }
    return attributes


def attribute_of(specification: Mapping[str, Any], name: str) -> Any:
    """Returns one of `attributes_of`; AttributeError for any other."""
    attributes = attributes_of(specification)
    if name not in attributes:
        raise AttributeError(f"{name}: {specification['id']} has no such attribute")
    return attributes[name]


def control_cost_of(specification: Mapping[str, Any], action: ArrayLike) -> Any:
    """Returns the cost that Gymnasium subtracts from the reward, in the action's precision."""
    weight = specification["parameters"].get("ctrl_cost_weight")
    if weight is None:
        raise AttributeError(f"control_cost: {specification['id']} has no such method")
    return float(weight) * np.sum(np.square(action))


def to_coordinates(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Returns generalized positions or velocities as float64; ValueError if not shape (n,)."""
    coordinates = np.ascontiguousarray(values, np.float64)
    if np.ndim(values) != 1:
        raise ValueError(f"{name} has the shape {np.shape(values)}; must be one-dimensional")
    return coordinates
