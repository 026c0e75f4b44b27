"""Settings of a training: their checks, their stages and their hash."""

from __future__ import annotations

import copy
import dataclasses
import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, Sequence

from walker_sim import _core
from walker_sim.training.curve import COLUMNS
from walker_sim.training.mixture import Part
from walker_sim.worlds import Range, World, read_world

EVOLUTIONARY = ("es", "cma")
"""Algorithms that compare whole episodes of networks; they need neither torch nor gradients."""

LEARNING = ("ppo", "sac", "tqc")
"""Algorithms of Stable-Baselines3, which learn from single steps."""

CONTINUING = ("ppo", *EVOLUTIONARY)
"""Algorithms that can start from a policy."""

LAYERS, ACTIVATION = (64, 64), "tanh"

Check = Callable[[str, Any], Any]
"""Returns the value of a setting, given its name and content; SettingsError if invalid."""


class SettingsError(ValueError):
    """A setting is invalid. The message names it, its value and what is allowed."""


def _require(is_allowed: bool, name: str, value: Any, what: str) -> None:
    if not is_allowed:
        raise SettingsError(f"{name} = {value!r}: must be {what}")


def _number(low: float, high: float, kind: type[float] = float) -> Check:
    what = "whole number" if kind is int else "number"

    def check(name: str, value: Any) -> float:
        is_number = isinstance(value, (int, kind)) and not isinstance(value, bool)
        is_allowed = is_number and low <= value <= high
        _require(is_allowed, name, value, f"a {what} from {low} to {high}")
        return kind(value)

    return check


def _whole(low: int, high: int = 2**40) -> Check:
    return _number(low, high, int)


def _pair(low: float, high: float) -> Check:
    def check(name: str, value: Any) -> tuple[float, ...]:
        is_pair = isinstance(value, (list, tuple)) and len(value) == 2
        _require(is_pair, name, value, "two numbers, at the beginning and the end")
        return tuple(_number(low, high)(name, each) for each in value)

    return check


def _one_of(*allowed: str) -> Check:
    def check(name: str, value: Any) -> str:
        _require(value in allowed, name, value, f"one of {', '.join(allowed)}")
        return str(value)

    return check


def _optional(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def _flag(name: str, value: Any) -> bool:
    _require(isinstance(value, bool), name, value, "true or false")
    return bool(value)


def _layers(name: str, value: Any) -> tuple[int, ...]:
    is_list = isinstance(value, (list, tuple)) and len(value) <= 8
    _require(is_list, name, value, "a list of 0 to 8 whole numbers")
    return tuple(_whole(1, 4096)(name, size) for size in value)


def _history(name: str, value: Any) -> tuple[int, int]:
    is_pair = isinstance(value, (list, tuple)) and len(value) == 2
    _require(is_pair, name, value, "two whole numbers, of observations and of actions")
    return _whole(1, 1000)(name, value[0]), _whole(0, 1000)(name, value[1])


def _mapping(name: str, value: Any) -> dict[Any, Any]:
    _require(isinstance(value, dict), name, value, "a mapping")
    return dict(value)


def _parameters(name: str, value: Any) -> dict[str, Any]:
    for parameter, given in _mapping(name, value).items():
        elements = given if isinstance(given, (list, tuple)) else [given]
        is_numbers = all(isinstance(element, (int, float)) for element in elements)
        what = "true or false, a number, a text or a list of numbers"
        _require(is_numbers or isinstance(given, str), f"{name}: {parameter}", given, what)
    return {str(parameter): given for parameter, given in value.items()}


def _world(name: str, value: Any) -> World:
    try:
        return read_world(value)
    except (TypeError, ValueError) as error:
        raise SettingsError(f"{name}: {error}") from error


def _worlds(name: str, value: Any) -> World | list[dict[str, Any]]:
    """Checks one world, or a list with the fields of a `Part` for each."""
    if not isinstance(value, (list, tuple)):
        return _world(name, value)
    _require(len(value) > 0, name, value, "a world, or a list of worlds")
    parts: list[dict[str, Any]] = []
    for index, given in enumerate(value):
        where = f"{name}: {index + 1}"
        part = given if isinstance(given, Mapping) and "world" in given else {"world": given}
        for key in part:
            if key not in Part._fields:
                known = ", ".join(Part._fields)
                raise SettingsError(f"{where}: {key}: unknown; must be one of {known}")
        world = _world(where, part["world"])
        preset = part["world"] if isinstance(part["world"], str) else ""
        default = _core.world_text(world) if "{" in preset or not preset else preset
        world_name = _text(f"{where}: name", part.get("name", default))
        _require(
            world_name not in COLUMNS and world_name not in (each["name"] for each in parts),
            f"{where}: name",
            world_name,
            f"another than those of the worlds before and than {', '.join(COLUMNS)}",
        )
        weight = _whole(0, 100)(f"{where}: weight", part.get("weight", 1))
        parts.append({"name": world_name, "world": world, "weight": weight})
    weights = [part["weight"] for part in parts]
    _require(any(weights), f"{name}: weights", weights, "more than 0 for at least one world")
    return parts


def _curriculum(name: str, value: Any) -> dict[str, Any]:
    checks = {"thresholds": _pair(-math.inf, math.inf), "moves": _whole(1), "episodes": _whole(1)}
    given = _mapping(name, value)
    for key in given:
        if key not in checks:
            raise SettingsError(f"{name}: {key}: unknown; must be one of {', '.join(checks)}")
    if "thresholds" not in given:
        raise SettingsError(f"{name} = {value!r}: must have thresholds: [LOW, HIGH]")
    checked = {key: checks[key](f"{name}: {key}", each) for key, each in given.items()}
    low, high = checked["thresholds"]
    _require(low <= high, f"{name}: thresholds", [low, high], "a lower and an upper one")
    return {"moves": 10, "episodes": 32, **checked}


def _changes(name: str, value: Any) -> dict[int, dict[str, Any]]:
    changes: dict[int, dict[str, Any]] = {}
    for step, change in _mapping(name, value).items():
        for setting in _mapping(f"{name}: {step!r}", change):
            if setting not in CHANGEABLE:
                raise SettingsError(f"{name}: {setting!r}: must be one of {', '.join(CHANGEABLE)}")
        changes[_whole(1)(name, step)] = {
            setting: CHANGEABLE[setting](setting, changed) for setting, changed in change.items()
        }
    return changes


def _text(name: str, value: Any) -> str:
    _require(isinstance(value, str) and value != "", name, value, "a text")
    return str(value)


def _stages(name: str, value: Any) -> list[dict[str, Any]]:
    _require(isinstance(value, (list, tuple)), name, value, "a list of mappings")
    stages = []
    for index, stage in enumerate(value):
        where = f"{name}: {index + 1}"
        for shared in ("stages", "seed"):
            if shared in _mapping(where, stage):
                raise SettingsError(f"{where}: {shared}: must be the same in all stages")
        try:
            stages.append(_checked(stage))
        except SettingsError as error:
            raise SettingsError(f"{where}: {error}") from error
    return stages


CHANGEABLE = {"gamma": _number(0, 1), "least_reward": _optional(_number(-math.inf, 0))}


def _setting(default: Any, check: Check, *algorithms: str) -> Any:
    """Returns a dataclass field with this default, whose values from a file are checked, and which
    applies to these algorithms; none: to all."""
    metadata = {"check": check, "algorithms": algorithms}
    return field(default_factory=lambda: copy.copy(default), metadata=metadata)


@dataclass(frozen=True)
class Settings:
    """Settings of one training, each a line of the file. docs/training.md describes them."""

    algorithm: str = _setting("ppo", _one_of(*LEARNING, *EVOLUTIONARY))
    steps: int = _setting(10_000_000, _whole(1))
    """Total number of steps of all walkers."""
    seed: int = _setting(0, _whole(0, 2**32 - 1))
    parameters: Mapping[str, Any] = _setting({}, _parameters)
    """Parameters of the environment by name."""
    world: Mapping[str, Range] | Sequence[Mapping[str, Any]] = _setting({}, _worlds)
    """World in which the policy is trained and evaluated, or a list of worlds, see `mixture`."""
    keep_best_by: str = _setting("mean", _one_of("mean", "min"))
    """Which number of an evaluation in several worlds decides the policy that is kept: the mean or
    the minimum of their mean returns."""
    curriculum: Mapping[str, Any] | None = _setting(None, _optional(_curriculum))
    """How the ranges of the training's world grow, see `training.curriculum`; None: they apply from
    the beginning."""
    start: str | None = _setting(None, _optional(_text))
    """PPO, ES and CMA: policy to start from, a file, `shipped`, or an id for its shipped one; None:
    that of the stage before, or else a new network."""
    num_envs: int = _setting(256, _whole(1), *LEARNING)
    rollout: int = _setting(64, _whole(1), *LEARNING)
    """Steps of each walker between two updates (PPO) or learning phases (SAC, TQC)."""
    batch_size: int = _setting(4096, _whole(2), *LEARNING)
    epochs: int = _setting(6, _whole(1), *LEARNING)
    """PPO: epochs over each rollout. SAC, TQC: gradient steps after each rollout."""
    learning_rate: tuple[float, float] = _setting((7e-4, 5e-5), _pair(0, 1), *LEARNING, "es")
    """Values at the beginning and at the end, linear in between."""
    gamma: float = _setting(0.99, CHANGEABLE["gamma"], *LEARNING)
    gae_lambda: float = _setting(0.95, _number(0, 1), "ppo")
    clip_range: float = _setting(0.2, _number(0, 1), "ppo")
    entropy: float = _setting(0.0, _number(0, 1), "ppo")
    value_steps: int = _setting(0, _whole(0), "ppo")
    """Number of first steps in which only the value network learns: a policy to start from would
    lose what it can do to advantages that are not yet known."""
    layers: tuple[int, ...] | None = _setting(None, _optional(_layers))
    """Sizes of the hidden layers; None: [64, 64], or those of the policy to start from."""
    activation: str | None = _setting(None, _optional(_one_of("tanh", "relu")))
    """None: tanh, or that of the policy to start from."""
    history: tuple[int, int] | None = _setting(None, _optional(_history))
    """Numbers of latest observations and of latest actions that the policy acts on; None: [1, 0],
    the present observation, or those of the policy to start from."""
    log_std: tuple[float, float] | None = _setting((-0.5, -2.0), _optional(_pair(-20, 2)), "ppo")
    """Logarithm of the exploration noise's standard deviation at the beginning and at the end,
    linear between; None: learnt, from -0.5."""
    least_reward: float | None = _setting(None, CHANGEABLE["least_reward"], *LEARNING)
    """Lower bound of the learner's rewards, e.g. -25 in place of a fall's -100; None: no bound.
    Reported returns have no bound."""
    action_delay: float = _setting(0.0, _number(0, 1), *LEARNING)
    """Probability per step that a walker gets the learner's previous action instead of the new."""
    average_updates: int = _setting(1, _whole(1))
    """The evaluated and saved policy is the mean of the networks after this many latest updates."""
    population: int = _setting(128, _whole(2), *EVOLUTIONARY)
    """Networks that are compared in each update; ES: pairs, so that it is even."""
    episodes: int = _setting(1, _whole(1), *EVOLUTIONARY)
    """Episodes of each network in an update."""
    sigma: tuple[float, float] = _setting((0.01, 0.01), _pair(1e-6, 10), *EVOLUTIONARY)
    """ES: standard deviation of the noise on the parameters at the beginning and at the end, linear
    in between. CMA: the first one only, from where it adapts itself."""
    common_seeds: bool = _setting(True, _flag, "es")
    """Whether all networks of an update play the same seeds; else each pair has its own."""
    max_difference: float | None = _setting(None, _optional(_number(0, math.inf)), "es")
    """Each pair counts by its difference, limited to this, so that falls count in proportion;
    None: by its ranks in the population."""
    deviation_weight: float = _setting(0.0, _number(0, 100), *EVOLUTIONARY)
    """A network is worth its mean return minus this times its standard deviation."""
    start_weight: float = _setting(0.0, _number(0, 1), *EVOLUTIONARY)
    """Weight that the network at the stage's beginning has in the evaluated and saved
    policy, beside the mean of the latest ones."""
    buffer_size: int = _setting(1_000_000, _whole(1), "sac", "tqc")
    """Size of the replay buffer [steps]."""
    learning_starts: int = _setting(10_000, _whole(0), "sac", "tqc")
    """Initial steps with random actions."""
    evaluate_every: int = _setting(1_000_000, _whole(1))
    """Steps between two evaluations, on seeds that the training never uses."""
    evaluation_episodes: int = _setting(100, _whole(1))
    changes: Mapping[int, Mapping[str, Any]] = _setting({}, _changes, *LEARNING)
    """Maps a number of steps to values of gamma and least_reward that apply from there on."""
    stages: Sequence[Mapping[str, Any]] = _setting([], _stages)
    """Stages that follow this one, each with the settings that differ from the stage before. All
    are evaluated with the last one's parameters and world."""

    @property
    def num_stages(self) -> int:
        return 1 + len(self.stages)

    @property
    def mixture(self) -> list[Part]:
        """The worlds of training and evaluation."""
        if isinstance(self.world, Mapping):
            return [Part("", dict(self.world), 1)]
        return [Part(**part) for part in self.world]

    def stage(self, index: int) -> Settings:
        """Returns the settings of one stage, without `stages`."""
        settings = dataclasses.replace(self, stages=[])
        for changes in self.stages[:index]:
            settings = dataclasses.replace(settings, **{"start": None, **changes})
        return settings

    def steps_before(self, index: int) -> int:
        """Returns the number of steps of all stages before this one."""
        return sum(self.stage(before).steps for before in range(index))

    def at(self, steps: int) -> Settings:
        """Returns the settings with all `changes` up to this number of steps."""
        changed: dict[str, Any] = {}
        for begin in sorted(self.changes):
            if begin <= steps:
                changed.update(self.changes[begin])
        return dataclasses.replace(self, **changed)

    def hash(self) -> str:
        """Returns the SHA-256 of the settings, independent of the file's order and layout."""
        fields = dataclasses.asdict(self)
        fields["activation"] = self.activation or ACTIVATION
        # Policies from before there were these settings keep their hashes.
        for name in _LATER:
            if fields[name] == getattr(Settings(), name):
                del fields[name]
        text = json.dumps(fields, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


_LATER = (
    *("world", "curriculum", "stages", "start", "population", "episodes", "sigma", "common_seeds"),
    *("max_difference", "deviation_weight", "start_weight"),
    *("keep_best_by", "history", "value_steps"),
)


def settings_from(given: Mapping[str, Any]) -> Settings:
    """Checks a file's content and returns it as settings, missing ones with their defaults."""
    settings = Settings(**_checked(given))
    stages = [settings.stage(index) for index in range(settings.num_stages)]
    _refuse_unused(stages)
    for index, stage in enumerate(stages):
        where, before = f"stages: {index}: " if index > 0 else "", stages[max(index - 1, 0)]
        if stage.curriculum and len(stage.mixture) > 1:
            raise SettingsError(
                f"{where}curriculum = {dict(stage.curriculum)}: must be null, because "
                f"world lists {len(stage.mixture)} worlds"
            )
        if stage.algorithm == "es" and stage.population % 2 != 0:
            raise SettingsError(f"{where}population = {stage.population}: must be even, for pairs")
        if (index > 0 or stage.start is not None) and stage.algorithm not in CONTINUING:
            what = where or f"start = {stage.start!r}: "
            raise SettingsError(
                f"{what}algorithm = {stage.algorithm!r}: must be one of "
                f"{', '.join(CONTINUING)}, which continue with a policy"
            )
        if stage.start is not None or index == 0:
            continue
        if any(a > b for a, b in zip(before.history or (), stage.history or ())):
            raise SettingsError(
                f"{where}history = {list(stage.history or ())}: must be at least "
                f"{list(before.history or ())} as in the stage before"
            )
        if stage.algorithm == "ppo" and settings.algorithm in ("sac", "tqc"):
            raise SettingsError(
                f"{where}algorithm = 'ppo': must be one of {', '.join(EVOLUTIONARY)}, because "
                f"{settings.algorithm}'s actions are squashed by tanh"
            )
        if stage.activation != before.activation:
            raise SettingsError(
                f"{where}activation = {stage.activation!r}: must be left out, because the policy "
                "of the stage before has its own"
            )
        if None in (before.layers, stage.layers) or before.layers == stage.layers:
            continue
        if before.layers or len(stage.layers or ()) != 1:
            raise SettingsError(
                f"{where}layers = {list(stage.layers or ())}: must be {list(before.layers or ())} "
                "as in the stage before, or one layer after none"
            )
    return settings


def _refuse_unused(stages: Sequence[Settings]) -> None:
    """Refuses settings that have an effect on no stage."""
    default, algorithms = Settings(), {stage.algorithm for stage in stages}
    for item in dataclasses.fields(Settings):
        used_by, name = item.metadata["algorithms"], item.name
        values = (getattr(stage, name) for stage in stages)
        changed = [value for value in values if value != getattr(default, name)]
        if changed and used_by and algorithms.isdisjoint(used_by):
            raise SettingsError(
                f"{name} = {changed[0]!r}: must be left out, because only {', '.join(used_by)} "
                f"{'has' if len(used_by) == 1 else 'have'} it"
            )


def _checked(given: Mapping[str, Any]) -> dict[str, Any]:
    known = {item.name: item for item in dataclasses.fields(Settings)}
    values: dict[str, Any] = {}
    for name, value in given.items():
        if name not in known:
            raise SettingsError(f"{name}: unknown; must be one of {', '.join(known)}")
        values[name] = known[name].metadata["check"](name, value)
    return values
