"""Policies, by the text of --policy."""

from __future__ import annotations

import argparse
import functools
import importlib
import os
from pathlib import Path
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.arguments import to_action
from walker_sim.commands.episodes import Policy
from walker_sim.commands.options import InputError
from walker_sim.errors import InvalidAction
from walker_sim.files import package_file
from walker_sim.training.models import ModelError, load_sb3, read_vec_normalize
from walker_sim.walkers import Specification

Policies = Callable[[int], Policy]
"""Returns the policy of one episode, given its seed."""

POLICY_HELP = """\
POLICY is one of
  heuristic        Gymnasium's for BipedalWalker, a linear gait for Walker2d and Hopper (default)
  random           uniform between the action's bounds, from a generator with the episode's seed
  zero             zero actions
  shipped          the trained network that the package includes for ID
  robust           likewise, trained in many worlds (BipedalWalker-v3, Walker2d-v5, Hopper-v5)
  FILE.safetensors a trained network, written by `train` or `convert`
  FILE.zip         a model saved by Stable-Baselines3 or its contrib, which acts deterministically;
                   RecurrentPPO's memory begins anew with each episode. Opening such a file can run
                   code: use only files that you trust
  MODULE:FUNCTION  called as FUNCTION(observation) with one observation of shape (observation
                   size,); returns an action of shape (action size,), which is rounded to float32.
                   A class is instantiated for each episode
"""


class PolicyFailed(Exception):
    """The user's policy raised, which is then the cause of this error, or its action is invalid."""


def make_policies(
    options: argparse.Namespace,
    env_id: str,
    parameters: dict[str, Any],
    specification: Specification,
) -> Policies:
    """Makes the policies that --policy and --normalization name; see POLICY_HELP.

    An InputError names a policy that does not exist or fit, and what is allowed.
    """
    text, normalization = options.policy, options.normalization
    size = len(specification["action_low"])
    network = find_network(options, env_id, parameters)
    if network is not None:
        return policies_of(network, text)
    if text == "zero":
        return lambda seed: lambda observation: np.zeros(size, np.float32)
    if text in ("heuristic", "random"):
        return _agents(text, env_id, parameters, size)
    if text.endswith(".zip"):
        return _sb3_model(text, specification, normalization)
    if ":" in text:
        return _user_functions(text, size)
    raise InputError(
        f"--policy {text}: must be heuristic, random, zero, shipped, robust, FILE.safetensors,"
        " FILE.zip or MODULE:FUNCTION"
    )


def policy_text(options: argparse.Namespace) -> str:
    """Returns the text that names the policy in titles and files."""
    beside = f" with {options.normalization}" if options.normalization else ""
    return f"{options.policy}{beside}"


def shipped_policy(env_id: str, kind: str = "shipped") -> Path:
    """Returns the policy file that ships with the package, `kind` shipped or robust; InputError if
    the package has no such file."""
    name = env_id if kind == "shipped" else f"{env_id}-{kind}"
    path = package_file(f"assets/policies/{name}.safetensors")
    if path is None:
        raise InputError(f"--policy {kind}: there is none for {env_id}; `train` makes one")
    return path


def has_policy(env_id: str, kind: str) -> bool:
    """Whether the package has such a policy file, `kind` shipped or robust."""
    try:
        shipped_policy(env_id, kind)
    except InputError:
        return False
    return True


def acting(agent: _core.Agent | _core.Policy, size: int) -> Policy:
    """Returns a function for one episode that returns the core's actions, all in the same array."""
    action = np.empty(size)
    compute = agent.act
    if isinstance(agent, _core.Policy):
        compute = functools.partial(agent.act_next, _core.PolicyInput(agent))

    def act(observation: NDArray[Any]) -> NDArray[Any]:
        compute(np.ascontiguousarray(observation, np.float64), action)
        return action

    return act


def _agents(name: str, env_id: str, parameters: dict[str, Any], size: int) -> Policies:
    def policy_of(seed: int) -> Policy:
        return acting(_core.Agent(name, env_id, parameters, seed), size)

    try:
        policy_of(0)
    except ValueError as error:
        raise InputError(f"--policy {name}: {error}") from error
    return policy_of


def find_network(
    options: argparse.Namespace, env_id: str, parameters: dict[str, Any]
) -> _core.Policy | None:
    """Reads the network that --policy names; None if it names another kind of policy. An InputError
    names a file that is not a policy or does not fit, or a --normalization that is of no use."""
    text = options.policy
    if options.normalization is not None and not text.endswith(".zip"):
        raise InputError(f"--normalization {options.normalization}: only for --policy FILE.zip")
    path = str(shipped_policy(env_id, text)) if text in ("shipped", "robust") else text
    if not path.endswith(".safetensors"):
        return None
    try:
        network = _core.Policy(os.fsencode(path))
        network.check(env_id, parameters)
    except ValueError as error:
        raise InputError(f"--{error}") from error  # the error begins with "policy FILE"
    return network


def policies_of(network: _core.Policy, text: str) -> Policies:
    """Returns the policies of a network; `text` names it in errors."""

    def policy_of(seed: int) -> Policy:
        policy = acting(network, network.action_size)

        def act(observation: NDArray[Any]) -> NDArray[Any]:
            action = policy(observation)
            if not np.isfinite(action).all():  # large weights overflow
                raise PolicyFailed(f"--policy {text}: action = {action}: must be finite")
            return action

        return act

    return policy_of


def _user_functions(text: str, size: int) -> Policies:
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
                action = to_action(given, (size,)).astype(np.float32)
                if not np.isfinite(action).all():
                    raise InvalidAction(f"action = {given!r}: must be finite")
            except InvalidAction as error:
                raise PolicyFailed(f"--policy {text}, seed {seed}: {error}") from None
            return action

        return act

    return policy_of


def _sb3_model(text: str, specification: Specification, normalization: Path | None) -> Policies:
    try:
        _, model = load_sb3(Path(text))
    except (ModelError, ImportError) as error:
        raise InputError(f"--policy {text}: {error}") from error
    # With one observation at a time, more threads would only wait for each other.
    importlib.import_module("torch").set_num_threads(1)
    sizes = len(specification["observation_low"]), len(specification["action_low"])
    found = model.observation_space.shape, model.action_space.shape
    if found != ((sizes[0],), (sizes[1],)):
        raise InputError(
            f"--policy {text}: observations and actions have shapes {found[0]} and {found[1]}; "
            f"must be ({sizes[0]},) and ({sizes[1]},), as {specification['id']} has them"
        )
    statistics: Any = None
    if normalization is not None:
        try:
            statistics = read_vec_normalize(normalization, sizes[0])
        except ModelError as error:
            raise InputError(str(error)) from error

    def policy_of(seed: int) -> Policy:
        memory: dict[str, Any] = {}  # of a recurrent network, from the episode's last step

        def act(observation: NDArray[Any]) -> NDArray[Any]:
            if statistics is not None:
                observation = statistics.normalize_obs(observation)
            action: NDArray[Any]
            action, state = model.predict(observation, deterministic=True, **memory)
            if state is not None:
                memory["state"] = state
            return action

        return act

    return policy_of
