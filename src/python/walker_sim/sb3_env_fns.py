"""Support of Stable-Baselines3's ``make_vec_env``, which passes functions to a vector environment.

Each function makes one walker, with a `Monitor` around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Iterable, Mapping, Sequence

import gymnasium
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor

from walker_sim import _core
from walker_sim.environment import WalkerEnv
from walker_sim.worlds import World

EnvFns = Sequence[Callable[[], gymnasium.Env]]


class ReplayEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """Environment under a `Monitor` that returns the outcomes of a walker stepped elsewhere."""

    def __init__(self, walker: gymnasium.Env) -> None:
        for name in ("observation_space", "action_space", "metadata", "render_mode", "spec"):
            setattr(self, name, getattr(walker, name))
        self.outcome: Any = None

    def reset(self, **_: Any) -> Any:
        return self.outcome

    def step(self, _: Any) -> Any:
        return self.outcome


class MonitorFeed:
    """Passes a walker's outcomes to its `Monitor`, which adds to infos and writes files."""

    def __init__(self, monitor: Monitor) -> None:
        self.monitor, self._replay = monitor, ReplayEnv(monitor.env)
        monitor.env = self._replay

    def reset(self) -> None:
        self._replay.outcome = None, {}
        self.monitor.reset()

    def step(self, reward: float, terminated: bool, truncated: bool, info: dict[str, Any]) -> None:
        """Passes a step. If it ends the episode, the `Monitor` adds ``episode`` to `info`."""
        self._replay.outcome = None, reward, terminated, truncated, info
        self.monitor.step(None)

    def methods(self) -> dict[str, Any]:
        """Returns the `Monitor`'s getters by name, for `VecEnv.env_method`."""
        names = ("total_steps", "episode_rewards", "episode_lengths", "episode_times")
        return {f"get_{name}": getattr(self.monitor, f"get_{name}") for name in names}


@dataclass
class VecEnvSpec:
    """Arguments of a vector environment whose walkers equal those that the functions make."""

    env_id: str
    num_envs: int
    parameters: dict[str, Any]
    max_episode_steps: int  # -1: no limit
    render_mode: str | None
    worlds: list[World]  # one per walker
    spaces: tuple[gymnasium.Space[Any], gymnasium.Space[Any]]  # observations, actions
    feeds: list[MonitorFeed]  # one per walker, or none


def spec_of(env_fns: EnvFns, others: Mapping[str, Any]) -> VecEnvSpec:
    """Calls the functions, inspects the walkers that they make, and closes them. `others`, the
    further keywords of the vector environment, must have their defaults.

    Raises
    ------
    TypeError
        If an environment is not a walker of this package, or has a wrapper that cannot be around a
        single walker of a vector environment.
    ValueError
        If the walkers differ or are on a server, or `others` sets what the functions determine.
    """
    makers: list[Any] = [*env_fns] if isinstance(env_fns, Iterable) else [None]
    if not all(callable(make) for make in makers):
        shown = _core.shown(env_fns)
        raise TypeError(f"environment {shown}: must be an id, or functions, one for each walker")
    if not makers:
        raise ValueError("environment []: must be an id, or functions, one for each walker")
    made = [_unwrap(make()) for make in makers]
    defaults = {
        "num_envs": (1, len(made)),
        "transport": ("inprocess",),
        "server": ("/walker_sim",),
        "master_uri": ("",),
        "timeout": (10.0,),
        "spin_us": (None,),
    }
    for name, value in others.items():
        if value not in defaults.get(name, (None,)):
            raise ValueError(
                f"{name} = {value!r}: determined by the functions that make the walkers"
            )
    texts = [f"{walker.env_id} with {keywords}" for walker, _, keywords in made]
    for index, text in enumerate(texts):
        if text != texts[0]:
            raise ValueError(f"environment {index}: {text}; must equal the first one, {texts[0]}")
    for walker, _, _ in made:
        walker.close()
    monitors = [monitor for _, monitor, _ in made if monitor]
    if len(monitors) not in (0, len(made)):
        raise ValueError(f"{len(monitors)} of {len(made)} walkers have a Monitor; must be all")
    walker, _, parameters = made[0]
    if parameters.pop("transport") != "inprocess":
        raise ValueError(
            "transport = 'ros': one server has all of the walkers; make them by "
            'VecEnv(ID, NUM_ENVS, transport="ros")'
        )
    return VecEnvSpec(
        walker.env_id,
        len(made),
        max_episode_steps=parameters.pop("max_episode_steps"),
        render_mode=parameters.pop("render_mode"),
        parameters=parameters,
        worlds=[walker.world for walker, _, _ in made],
        spaces=(walker.observation_space, walker.action_space),
        feeds=[MonitorFeed(monitor) for monitor in monitors],
    )


def _unwrap(environment: Any) -> tuple[WalkerEnv, Monitor | None, dict[str, Any]]:
    """Returns the walker inside the wrappers, its `Monitor`, and its keywords and time limit."""
    limits: list[int | None] = []
    monitor = None
    while isinstance(environment, gymnasium.Wrapper):
        if isinstance(environment, Monitor):
            monitor = environment
        elif isinstance(environment, TimeLimit):
            limits.append(environment._max_episode_steps)
        elif not isinstance(environment, (OrderEnforcing, PassiveEnvChecker)):
            raise TypeError(
                f"{type(environment).__name__}: walkers that are stepped together cannot have this "
                "wrapper around each of them; must be Monitor. Put one of Stable-Baselines3's "
                "VecEnvWrapper around all, or take its DummyVecEnv"
            )
        environment = environment.env
    if not isinstance(environment, WalkerEnv):
        raise TypeError(f"{type(environment).__name__}: must be a walker of walker_sim")
    keywords = dict(environment.keywords)
    limits.append(keywords["max_episode_steps"])
    keywords["max_episode_steps"] = min((one for one in limits if one), default=-1)
    return environment, monitor, keywords
