"""Policies, by the text of --policy."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import zipfile
from pathlib import Path
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.actions import to_action
from walker_sim.commands.episodes import Policy
from walker_sim.commands.options import InputError
from walker_sim.errors import InvalidAction
from walker_sim.files import package_file
from walker_sim.training.models import ModelError, read_vec_normalize, sb3_algorithm
from walker_sim.transport import Specification

Policies = Callable[[int], Policy]
"""Returns the policy of one episode, given its seed."""

POLICY_HELP = """\
POLICY is one of
  heuristic        Gymnasium's for BipedalWalker, a linear gait for Walker2d (default)
  random           uniform between the action's bounds, drawn anew from each episode's seed
  zero             no torque
  shipped          the trained network that comes along for ID
  FILE.safetensors a trained network, of `train` or `convert`
  FILE.zip         a model that Stable-Baselines3 (or its contrib) has saved; acts
                   deterministically. Such a file can run code: open none that you do not trust
  MODULE:FUNCTION  called as FUNCTION(observation), one observation of shape (observation size,)
                   at a time, gives an action of shape (action size,), which is rounded to
                   float32; where it is a class, each episode has an instance of its own
"""


class PolicyFailed(Exception):
    """The user's policy raised, which is then the cause of this error, or its action is invalid."""


def make_policies(
    text: str,
    env_id: str,
    parameters: dict[str, Any],
    specification: Specification,
    normalization: Path | None = None,
) -> Policies:
    """Makes the policies that `text` names; see POLICY_HELP.

    Parameters
    ----------
    normalization
        `VecNormalize` file of a model of Stable-Baselines3; None: observations are not normalised.

    Raises
    ------
    InputError
        If there is no such policy, or it does not fit. Names the policy and what is allowed.
    """
    size = len(specification["action_low"])
    if normalization is not None and not text.endswith(".zip"):
        raise InputError(f"--normalization {normalization}: only for --policy FILE.zip")
    if text == "zero":
        return lambda seed: lambda observation: np.zeros(size, np.float32)
    if text in ("heuristic", "random"):
        return _core_policies(text, env_id, parameters, size)
    if text == "shipped":
        return _network_policies(str(shipped_policy(env_id)), env_id, parameters, size)
    if text.endswith(".safetensors"):
        return _network_policies(text, env_id, parameters, size)
    if text.endswith(".zip"):
        return _sb3_policies(text, specification, normalization)
    if ":" in text:
        return _function_policies(text, size)
    raise InputError(
        f"--policy {text}: must be heuristic, random, zero, shipped, FILE.safetensors, FILE.zip or"
        " MODULE:FUNCTION"
    )


def shipped_policy(env_id: str) -> Path:
    """Returns the policy file that ships with the package; InputError if there is none."""
    path = package_file(f"assets/policies/{env_id}.safetensors")
    if path is None:
        raise InputError(f"--policy shipped: no policy comes with {env_id}; `train` makes one")
    return path


def _core_policies(name: str, env_id: str, parameters: dict[str, Any], size: int) -> Policies:
    def policy_of(seed: int) -> Policy:
        return _acting(_core.Agent(name, env_id, parameters, seed), size)

    try:
        policy_of(0)
    except ValueError as error:
        raise InputError(f"--policy {name}: {error}") from error
    return policy_of


def _network_policies(path: str, env_id: str, parameters: dict[str, Any], size: int) -> Policies:
    """Makes one policy for all episodes: a network has no state."""
    try:
        network = _core.Policy(os.fsencode(path))
        network.check(env_id, parameters)
    except ValueError as error:
        raise InputError(f"--{error}") from error  # the error begins with "policy FILE"
    policy = _acting(network, size)

    def act(observation: NDArray[Any]) -> NDArray[Any]:
        action = policy(observation)
        if not np.isfinite(action).all():  # large weights overflow
            raise PolicyFailed(f"--policy {path}: action = {action}: must be finite")
        return action

    return lambda seed: act


def _acting(policy: _core.Agent | _core.Policy, size: int) -> Policy:
    action = np.empty(size)

    def act(observation: NDArray[Any]) -> NDArray[Any]:
        policy.act(np.ascontiguousarray(observation, np.float64), action)
        return action

    return act


def checked_action(given: Any, size: int) -> NDArray[np.float32]:
    """Converts the result of a user's function to a finite action, or raises InvalidAction."""
    action = to_action(given, (size,)).astype(np.float32)
    if not np.isfinite(action).all():
        raise InvalidAction(f"action = {given!r}: must be finite")
    return action


def _function_policies(text: str, size: int) -> Policies:
    module, _, name = text.partition(":")
    try:
        target: Any = importlib.import_module(module)
        for part in name.split("."):
            target = getattr(target, part)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"--policy {text}: {error}") from error
    if not callable(target):
        raise InputError(f"--policy {text}: must be a function or a class, is {target!r}")

    def policy_of(seed: int) -> Policy:
        function = target() if isinstance(target, type) else target

        def act(observation: NDArray[Any]) -> NDArray[Any]:
            try:
                given = function(observation)
            except Exception as error:
                raise PolicyFailed(f"{text} failed in the episode of seed {seed}") from error
            try:
                return checked_action(given, size)
            except InvalidAction as error:
                raise PolicyFailed(f"--policy {text}, seed {seed}: {error}") from None

        return act

    return policy_of


def policy_text(options: argparse.Namespace) -> str:
    beside = f" with {options.normalization}" if options.normalization else ""
    return f"{options.policy}{beside}"


def _sb3_policies(text: str, specification: Specification, normalization: Path | None) -> Policies:
    try:
        with zipfile.ZipFile(text) as file:
            data = json.loads(file.read("data"))
        module, name = sb3_algorithm(data)
    except Exception as error:  # damaged archives raise many types
        raise InputError(
            f"--policy {text}: no model that Stable-Baselines3 has saved: {error}"
        ) from error
    try:
        algorithm = getattr(importlib.import_module(module), name)
        torch = importlib.import_module("torch")
    except (ImportError, AttributeError) as error:
        package = module.replace("_", "-")
        raise InputError(
            f"--policy {text}: needs {module}: pip install {package} ({error})"
        ) from error
    # With one observation at a time, more threads would only wait for each other.
    torch.set_num_threads(1)
    try:
        model = algorithm.load(text, device="cpu")
    except Exception as error:
        raise InputError(f"--policy {text}: {module} does not load it: {error}") from error
    wanted = (len(specification["observation_low"]),), (len(specification["action_low"]),)
    found = model.observation_space.shape, model.action_space.shape
    if found != wanted:
        raise InputError(
            f"--policy {text}: observations and actions have shapes {found[0]} and {found[1]}; "
            f"must be {wanted[0]} and {wanted[1]}, as {specification['id']} has them"
        )

    normalize = _normalizer(normalization, wanted[0])

    def act(observation: NDArray[Any]) -> NDArray[Any]:
        action: NDArray[Any] = model.predict(normalize(observation), deterministic=True)[0]
        return action

    return lambda seed: act


def _normalizer(
    path: Path | None, shape: tuple[int, ...]
) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Returns the `VecNormalize` file's `normalize_obs`; without a file, the identity."""
    if path is None:
        return lambda observation: observation
    try:
        statistics = read_vec_normalize(path)
        found = statistics.obs_rms.mean.shape if statistics.norm_obs else shape
    except (ModelError, AttributeError) as error:
        raise InputError(f"--normalization {path}: {error}") from error
    if found != shape:
        raise InputError(f"--normalization {path}: has shape {found}; must be {shape}")
    return statistics.normalize_obs  # type: ignore[no-any-return]
