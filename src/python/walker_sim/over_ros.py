"""Walkers on a server, by this package's own client, which needs no ROS installation."""

from __future__ import annotations

import numbers
from typing import Any, Mapping, Sequence

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.errors import ServerMismatch
from walker_sim.keywords import to_count
from walker_sim.rendering import Pictures
from walker_sim.transport import (
    Batch,
    Colors,
    Depths,
    ServerAddress,
    Specification,
    State,
    Walkers,
)

MAX_LINES = 20
MAX_VALUE_LENGTH = 200  # maximum length of a value in an error message


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


class Connection:
    """Connection to a server, which is compared with the expected one at each connect.

    The server's specification must have the values `required`, besides id and parameters.
    `takes_any_limit` allows any ``max_episode_steps``.
    """

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        required: Specification,
        address: ServerAddress,
        takes_any_limit: bool = False,
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
        self._required: Specification = required
        self._takes_any_limit: bool = takes_any_limit
        spin_us = to_count("spin_us", address.spin_us, 0)
        self._options: tuple[str, dict[str, Any], str, str, float, int]
        self._options = (
            *(env_id, dict(parameters), address.server, address.master_uri, timeout, spin_us),
        )
        self._client: _core.Client | None = None
        client = self.open()
        server = client.server_specification
        computed = {key: shown(server[key]) for key in ("engine", "engine_version")}
        self.specification: Specification = {**client.specification, **computed}

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


class RemoteWalker(Connection):
    """The only walker of a server in lock-step. A copy is another connection to the server."""

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        address: ServerAddress,
        takes_any_limit: bool = False,
    ) -> None:
        required = {"mode": "lockstep", "num_envs": 1}
        super().__init__(env_id, parameters, required, address, takes_any_limit)

    def reset(self, seed: int | None, random: np.random.Generator, state: State) -> None:
        """Begins an episode. Without a seed the server's generator continues; ignores `random`."""
        self.open().reset(seed, *state)

    def step(self, action: NDArray[Any], state: State) -> tuple[float, bool, bool, str]:
        return self.client.step(action, *state)

    def render(self, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        self.client.render(0, pictures.camera_parameters, rgb, depth)

    def get_state(self, random: np.random.Generator | None) -> bytes:
        """Returns the server's record of the episode; ignores `random`."""
        return self.client.snapshot()

    def set_state(self, state: bytes) -> np.random.Generator | None:
        """Lets the server replay a record. Returns None: the server has the generator."""
        self.open().restore(state)
        return None

    def set_coordinates(self, qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> None:
        raise AttributeError(
            'set_state(qpos, qvel): not over ROS; only with transport="inprocess". Over ROS '
            "set_state takes a result of get_state"
        )

    @property
    def is_healthy(self) -> bool:
        raise AttributeError(
            'is_healthy: not over ROS; only with transport="inprocess". Over ROS '
            "a step returns terminated"
        )


class RemoteWalkers(Connection, Walkers):
    """All walkers of a server in lock-step. A copy is another connection to the server."""

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        num_envs: int,
        autoreset_mode: str,
        address: ServerAddress,
    ) -> None:
        required = {"mode": "lockstep", "num_envs": num_envs, "autoreset_mode": autoreset_mode}
        Connection.__init__(self, env_id, parameters, required, address)
        Walkers.__init__(self, self.specification, num_envs)
        self._observations, self._info = self._new_rows(num_envs)  # latest, for reset() of some
        self._observations[:], self._info[:] = 0, 0

    @property
    def _driver(self) -> _core.Client:
        return self.client

    def reset(self, environments: list[int], seeds: Sequence[int | None]) -> State:
        chosen = environments or list(range(self.num_envs))
        observations, info = self._new_rows(len(chosen))
        self.open().reset_batch(environments, seeds, observations, info)
        self._observations[chosen], self._info[chosen] = observations, info
        return self._observations.copy(), self._info.copy()

    def step(self, actions: NDArray[Any]) -> Batch:
        batch = super().step(actions)
        self._observations, self._info = batch.observations.copy(), batch.info.copy()
        return batch

    def render(self, environment: int, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        self.client.render(environment, pictures.camera_parameters, rgb, depth)
