"""Settings of a training: reading and checking YAML files, and their hash."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Mapping

ALGORITHMS = ("ppo", "sac", "tqc")
ACTIVATIONS = ("tanh", "relu")


class SettingsError(ValueError):
    """A setting is invalid. The message names it, its value and what is allowed."""


@dataclass(frozen=True)
class Settings:
    """Settings of one training, each a line of the file. docs/training.md describes them."""

    algorithm: str = "ppo"
    steps: int = 10_000_000
    """Total number of steps of all walkers."""
    seed: int = 0
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """Parameters of the environment by name."""
    num_envs: int = 256
    rollout: int = 64
    """Steps of each walker between two updates (PPO) or learning phases (SAC, TQC)."""
    batch_size: int = 4096
    epochs: int = 6
    """PPO: epochs over each rollout. SAC, TQC: gradient steps after each rollout."""
    learning_rate: tuple[float, float] = (7e-4, 5e-5)
    """Values at the beginning and at the end, linear in between."""
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    entropy: float = 0.0
    layers: tuple[int, ...] = (64, 64)
    activation: str = "tanh"
    log_std: tuple[float, float] | None = (-0.5, -2.0)
    """PPO: logarithm of the exploration noise's standard deviation at the beginning and at the end,
    linear between; None: learnt, from -0.5."""
    least_reward: float | None = None
    """Lower bound of the learner's rewards, e.g. -25 in place of a fall's -100; None: no bound.
    Reported returns have no bound."""
    action_delay: float = 0.0
    """Probability per step that a walker gets the learner's previous action instead of the new."""
    average_updates: int = 1
    """The evaluated and saved policy is the mean of the networks after this many latest updates."""
    buffer_size: int = 1_000_000
    """SAC, TQC: size of the replay buffer [steps]."""
    learning_starts: int = 10_000
    """SAC, TQC: initial steps with random actions."""
    evaluate_every: int = 1_000_000
    """Steps between two evaluations, on seeds that the training never uses."""
    evaluation_episodes: int = 100
    changes: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    """Maps a number of steps to values of gamma and least_reward that apply from there on."""

    def at(self, steps: int) -> Settings:
        """Returns the settings with all `changes` up to this number of steps."""
        changed: dict[str, Any] = {}
        for begin in sorted(self.changes):
            if begin <= steps:
                changed.update(self.changes[begin])
        return dataclasses.replace(self, **changed)

    def hash(self) -> str:
        """Returns the SHA-256 of the settings, independent of the file's order and layout."""
        text = json.dumps(as_plain(self), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


CHANGEABLE = ("gamma", "least_reward")


def read_settings(path: Path) -> Settings:
    """Reads a YAML file. A SettingsError names the file, the setting and what is allowed."""
    import yaml

    try:
        given = yaml.safe_load(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise SettingsError(f"{path}: no YAML: nested too deep") from error
    except (
        yaml.YAMLError,
        ValueError,
    ) as error:  # ValueError: not UTF-8, or a date such as 2026-13-01
        raise SettingsError(f"{path}: no YAML: {error}") from error
    if not isinstance(given, dict):
        raise SettingsError(f"{path}: must be a mapping of settings")
    try:
        return settings_from(given)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from error


def write_settings(settings: Settings, path: Path) -> None:
    import yaml

    text = yaml.safe_dump(as_plain(settings), sort_keys=False, default_flow_style=None)
    path.write_text(text, encoding="utf-8")


def as_plain(settings: Settings) -> dict[str, Any]:
    """Converts settings to the types of YAML and JSON."""
    plain = dataclasses.asdict(settings)
    for name in ("learning_rate", "layers", "log_std"):
        plain[name] = None if plain[name] is None else list(plain[name])
    plain["changes"] = {int(step): dict(change) for step, change in plain["changes"].items()}
    return plain


def settings_from(given: Mapping[str, Any]) -> Settings:
    """Checks a file's content and returns it as settings, missing ones with their defaults."""
    known = {item.name: item for item in dataclasses.fields(Settings)}
    values: dict[str, Any] = {}
    for name, value in given.items():
        if name not in known:
            raise SettingsError(f"{name}: unknown; must be one of {', '.join(known)}")
        values[name] = _checked(str(name), value)
    return Settings(**values)


_WHOLE = {
    "steps": 1,
    "seed": 0,
    "num_envs": 1,
    "rollout": 1,
    "batch_size": 2,
    "epochs": 1,
    "average_updates": 1,
    "buffer_size": 1,
    "learning_starts": 0,
    "evaluate_every": 1,
    "evaluation_episodes": 1,
}
_WITHIN = {
    "gamma": (0.0, 1.0),
    "gae_lambda": (0.0, 1.0),
    "clip_range": (0.0, 1.0),
    "entropy": (0.0, 1.0),
    "action_delay": (0.0, 1.0),
}


def _checked(name: str, value: Any) -> Any:
    if name in _WHOLE:
        return _whole(name, value, _WHOLE[name])
    if name in _WITHIN:
        low, high = _WITHIN[name]
        return _number(name, value, low, high)
    if name in ("algorithm", "activation"):
        allowed = ALGORITHMS if name == "algorithm" else ACTIVATIONS
        if value not in allowed:
            raise SettingsError(f"{name} = {value!r}: must be one of {', '.join(allowed)}")
        return value
    if name == "least_reward":
        return None if value is None else _number(name, value, -math.inf, 0)
    if name == "learning_rate":
        return _pair(name, value, 0, 1)
    if name == "log_std":
        return None if value is None else _pair(name, value, -20, 2)
    if name == "layers":
        if not isinstance(value, (list, tuple)) or not 1 <= len(value) <= 8:
            raise SettingsError(f"{name} = {value!r}: must be a list of 1 to 8 whole numbers")
        return tuple(_whole(name, size, 1, 4096) for size in value)
    if not isinstance(value, dict):
        raise SettingsError(f"{name} = {value!r}: must be a mapping")
    return _changes(value) if name == "changes" else _parameters(value)


def _parameters(value: Mapping[Any, Any]) -> dict[str, Any]:
    for name, given in value.items():
        elements = given if isinstance(given, (list, tuple)) else ()
        is_known = isinstance(given, (bool, int, float, str, list, tuple))
        if not (is_known and all(isinstance(element, (int, float)) for element in elements)):
            raise SettingsError(
                f"parameters: {name} = {given!r}: must be true or false, a number, a text or a "
                "list of numbers"
            )
    return {str(name): given for name, given in value.items()}


def _changes(value: Mapping[Any, Any]) -> dict[int, dict[str, Any]]:
    changes: dict[int, dict[str, Any]] = {}
    for step, change in value.items():
        if not isinstance(change, dict):
            raise SettingsError(f"changes: at {step!r} is {change!r}; must be a mapping")
        for name in change:
            if name not in CHANGEABLE:
                raise SettingsError(f"changes: {name!r}: must be one of {', '.join(CHANGEABLE)}")
        changes[_whole("changes", step, 1)] = {
            name: _checked(name, changed) for name, changed in change.items()
        }
    return changes


def _whole(name: str, value: Any, least: int, most: int = 2**40) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise SettingsError(f"{name} = {value!r}: must be a whole number from {least} to {most}")
    return value


def _number(name: str, value: Any, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise SettingsError(f"{name} = {value!r}: must be a number from {low:g} to {high:g}")
    return float(value)


def _pair(name: str, value: Any, low: float, high: float) -> tuple[float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise SettingsError(
            f"{name} = {value!r}: must be two numbers, at the beginning and the end"
        )
    return _number(name, value[0], low, high), _number(name, value[1], low, high)
