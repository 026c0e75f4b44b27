"""Walkers on a server, by this package's own client, which needs no ROS installation."""

from __future__ import annotations

import numbers
import sys
from types import FrameType
from typing import Any, Mapping, Sequence

import gymnasium
import gymnasium.envs.registration
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.arguments import to_count
from walker_sim.errors import ServerMismatch
from walker_sim.rendering import Pictures
from walker_sim.walkers import Batch, Colors, Depths, ServerAddress, Specification, State, Walkers
from walker_sim.worlds import World

ANY = -1
"""The limit is unspecified: any limit of the server is accepted."""
MAX_LINES = 20
MAX_VALUE_LENGTH = 200  # maximum length of a value in an error message


def limit_of_make(environment: type[gymnasium.Env]) -> int | None:
    """Returns the limit [steps] of the ``TimeLimit`` that the running `gymnasium.make` will add to
    an `environment` or an object of a derived class.

    Over ROS the server ends the episodes, so its limit must equal that of the caller's
    ``TimeLimit``. But `make` uses ``max_episode_steps`` for its wrapper alone: it passes the limit
    neither to the constructor nor to the specification that it stores in the environment. The limit
    is only in the locals of `make`'s frame, whose names are the same since Gymnasium 0.29. If
    another version renames them, the result is None.

    Returns 0 for no limit; `ANY` if `make` copies an environment by its own specification
    (``env.unwrapped.spec.make()``), which has no wrappers and so no limit; None if `make` does not
    construct the environment.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code is not gymnasium.envs.registration.make.__code__:
        frame = frame.f_back
    if frame is None:
        return None
    known = frame.f_locals
    creator = known.get("env_creator")
    if not (isinstance(creator, type) and issubclass(creator, environment)):
        return None  # another environment, which contains a walker
    limit = known.get("max_episode_steps")
    specification: Any = known.get("env_spec")
    if limit is None and specification is not None:
        limit = specification.max_episode_steps
        # make() sets order_enforce to False in the specification that it stores in an environment.
        is_own = known.get("id") is specification and not getattr(
            specification, "order_enforce", True
        )
        if limit is None and is_own:
            return ANY
    return 0 if limit in (None, -1) else limit


def differences(
    wanted: Specification, found: Specification, takes_any_limit: bool = False
) -> list[str]:
    """Returns the differences from the expected server, one per line, truncated to MAX_LINES."""
    pairs: dict[str, tuple[Any, Any]] = {
        name: (wanted[name], found[name])
        for name in ("id", "mode", "num_envs", "autoreset_mode")
        if name in wanted
    }
    if wanted["id"] == found["id"]:  # another id implies other parameters
        ours, theirs = wanted["parameters"], found["parameters"]
        for name in {**ours, **theirs}:
            pairs[name] = (ours.get(name, "absent"), theirs.get(name, "absent"))
        if takes_any_limit:
            del pairs["max_episode_steps"]
    lines = [
        f"{shown(name)} is {shown(there)} there; must be {shown(here)}"
        for name, (here, there) in pairs.items()
        if here != there
    ]
    return lines[:MAX_LINES] + [f"and {len(lines) - MAX_LINES} more"] * (len(lines) > MAX_LINES)


def shown(value: Any) -> str:
    """Returns a server's value for an error message, escaped and truncated."""
    text = str(value)
    fit = text if text.isprintable() else repr(text)
    return fit if len(fit) <= MAX_VALUE_LENGTH else f"{fit[:MAX_VALUE_LENGTH]}..."


class RemoteWalkers(Walkers):
    """All walkers of a server, which is compared with the expected one at each connect. A copy is
    another connection to the server.

    The server must be in lock-step and have this id, these parameters, `num_envs` walkers and the
    values `required` in its specification. `takes_any_limit` allows any ``max_episode_steps``.
    A server that was restarted gets the worlds of this connection again.
    """

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        address: ServerAddress,
        num_envs: int = 1,
        takes_any_limit: bool = False,
        **required: str,
    ) -> None:
        for name, value in (("server", address.server), ("master_uri", address.master_uri)):
            if not isinstance(value, str):
                raise TypeError(f"{name} = {_core.shown(value)}: must be a str")
            if not value.isprintable():
                raise ValueError(f"{name} = {_core.shown(value)}: must be a printable text")
        timeout_text = f"timeout = {_core.shown(address.timeout)}: must be a number of seconds"
        if not isinstance(address.timeout, numbers.Real):
            raise TypeError(timeout_text)
        try:
            timeout = float(address.timeout)
        except OverflowError:
            raise ValueError(f"{timeout_text}, as a float") from None
        self._required: Specification = {"mode": "lockstep", "num_envs": num_envs, **required}
        self._takes_any_limit: bool = takes_any_limit
        spin_us = -1 if address.spin_us is None else to_count("spin_us", address.spin_us, 0)
        self._options: tuple[str, dict[str, Any], str, str, float, int]
        self._options = (
            *(env_id, dict(parameters), address.server, address.master_uri, timeout, spin_us),
        )
        self._is_single: bool = "autoreset_mode" not in required
        self._worlds: dict[int, World] = {}  # by environment; absent: the server's own
        self._client: _core.Client | None = None
        client = self.open()
        server = client.server_specification
        computed = {key: shown(server[key]) for key in ("engine", "engine_version")}
        super().__init__({**client.specification, **computed}, num_envs)
        # The latest rows, for `reset` of some walkers.
        self._observations: NDArray[Any] = np.zeros((num_envs, self._size), self._dtype)
        self._info: NDArray[np.float64] = np.zeros((num_envs, self._num_infos))

    def open(self) -> _core.Client:
        """Returns the client for a reset; connects if it is closed or its connection was lost.

        Raises ConnectionError if no server answers, ServerMismatch if it differs from the expected.
        """
        if self._client is None or self._client.is_lost:
            client = _core.Client(*self._options)
            wanted = {**client.specification, **self._required}
            lines = differences(wanted, client.server_specification, self._takes_any_limit)
            if lines:
                raise ServerMismatch(f"the server {self._options[2]}: " + "; ".join(lines))
            self._client = client
            if self._worlds and not self._is_single:  # also for resets by the server itself
                client.set_world([*self._worlds], [*self._worlds.values()])
        return self._client

    @property
    def client(self) -> _core.Client:
        """The client for all calls but a reset. If the connection was lost, its calls raise."""
        if self._client is None:
            raise ClosedEnvironmentError("the connection to the server has been closed")
        return self._client

    def close(self) -> None:
        """Closes the connection. Idempotent."""
        self._client = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_client": None, "is_open": self._client is not None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        is_open = state.pop("is_open")
        self.__dict__.update(state)
        if is_open:
            self.open()

    @property
    def _driver(self) -> _core.Client:
        return self.client

    def reset_single(
        self, seed: int | None, random: np.random.Generator, state: State, world: World | None
    ) -> None:
        if world is None:
            world = self._worlds.get(0)
        self.open().reset(seed, *state, world)
        if world is not None:
            self._worlds[0] = world

    def get_state(self, random: np.random.Generator | None) -> bytes:
        return self.client.snapshot()

    def set_state(self, state: bytes) -> np.random.Generator | None:
        """Lets the server replay a record."""
        self.open().restore(state)
        return None

    @property
    def is_healthy(self) -> bool:
        raise AttributeError(
            'is_healthy: not over ROS; only with transport="inprocess". Over ROS '
            "a step returns terminated"
        )

    def reset(
        self, environments: list[int], seeds: Sequence[int | None], worlds: Sequence[World] = ()
    ) -> State:
        chosen = environments or list(range(self.num_envs))
        observations, info = self._new_rows(len(chosen))
        client = self.open()
        if not worlds and all(i in self._worlds for i in chosen):
            worlds = [self._worlds[i] for i in chosen]
        client.reset_batch(environments, seeds, observations, info, worlds)
        if worlds:
            self._keep_worlds(environments, worlds)
        self._observations[chosen], self._info[chosen] = observations, info
        return self._observations.copy(), self._info.copy()

    def step(self, actions: NDArray[Any]) -> Batch:
        batch = super().step(actions)
        self._observations, self._info = batch.observations.copy(), batch.info.copy()
        return batch

    def set_world(self, environments: list[int], worlds: Sequence[World]) -> None:
        if self._is_single:  # each reset requests it
            self.open().check_worlds(worlds)
        else:
            self.open().set_world(environments, worlds)
        self._keep_worlds(environments, worlds)

    def _keep_worlds(self, environments: list[int], worlds: Sequence[World]) -> None:
        chosen = environments or range(self.num_envs)
        each = worlds if len(worlds) == len(chosen) else [*worlds] * len(chosen)
        self._worlds.update(zip(chosen, each))

    def worlds(self) -> tuple[World, ...]:
        """Unless another client has set them: those of this connection, or else the server's when
        this one connected."""
        servers: World = self.client.server_specification["world"]
        return tuple(self._worlds.get(i, servers) for i in range(self.num_envs))

    def render(self, environment: int, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        self.client.render(environment, pictures.camera_parameters, rgb, depth)
