"""Walkers on a server, through this package's own client: no ROS installation is needed."""

from __future__ import annotations

from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.errors import ConnectionError, RequestRefused, ResetNeeded, ServerMismatch
from walker_sim.transport import Batch, Specification


def differences(wanted: Specification, found: Specification) -> list[str]:
    """What a server has otherwise than it should have, a line each."""
    lines = []

    def compare(name: str, here: Any, there: Any) -> None:
        if here != there:
            lines.append(f"{name} is {there} there; must be {here}")

    compare("id", wanted["id"], found["id"])
    if lines:
        return lines  # the rest would follow from that
    names = dict.fromkeys([*wanted["parameters"], *found["parameters"]])
    for name in names:
        here = wanted["parameters"].get(name, "(absent)")
        compare(f"parameter {name}", here, found["parameters"].get(name, "(absent)"))
    for name in ("num_envs", "autoreset_mode", "mode"):
        if name in wanted:
            compare(name, wanted[name], found[name])
    return lines


class Connection:
    """A client of a server that is what it should be, also after it was started again."""

    def __init__(self, wanted: Specification, server: str, master_uri: str, timeout: float) -> None:
        self.wanted = wanted
        self._options = (server, master_uri, timeout)
        self._connect()

    def _connect(self) -> None:
        self.client = _core.Client(*self._options)
        found = self.client.specification()
        lines = differences(self.wanted, found)
        if lines:
            raise ServerMismatch(f"the server {self._options[0]}: " + "; ".join(lines))
        self.is_lost = False

    def begin(self) -> None:
        """Before a reset: connects anew where the connection was lost."""
        if self.is_lost:
            self._connect()

    def check(self) -> None:
        """Before a step, which needs the episode that went with a lost connection."""
        if self.is_lost:
            raise ResetNeeded("step: the connection to the server was lost; reset first")

    def close(self) -> None:
        self.is_lost = True
        del self.client

    def __getstate__(self) -> tuple[Any, ...]:
        return (self.wanted, *self._options)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.wanted = state[0]
        self._options = state[1:]
        self._connect()


class RemoteWalker:
    """The one walker of a server in lock-step. A copy is another connection to it."""

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        max_episode_steps: int | None,
        server: str,
        master_uri: str,
        timeout: float,
    ) -> None:
        limit = {} if max_episode_steps is None else {"max_episode_steps": max_episode_steps}
        self.specification: Specification = _core.Environment(
            env_id, {**parameters, **limit}
        ).specification
        wanted = {**self.specification, "num_envs": 1, "mode": "lockstep"}
        self._connection = Connection(wanted, server, master_uri, timeout)

    def reset(
        self,
        seed: int | None,
        random: np.random.Generator,
        observation: NDArray[Any],
        info: NDArray[np.float64],
    ) -> None:
        """Without a seed the server's own generator continues."""
        self._connection.begin()
        try:
            self._connection.client.reset(seed, observation, info)
        except ConnectionError:
            self._connection.is_lost = True
            raise

    def step(
        self,
        action: NDArray[np.float64],
        observation: NDArray[Any],
        info: NDArray[np.float64],
    ) -> tuple[float, bool, bool, str]:
        self._connection.check()
        try:
            return self._connection.client.step(action, observation, info)
        except ConnectionError:
            self._connection.is_lost = True
            raise

    def close(self) -> None:
        self._connection.close()


class RemoteWalkers:
    """All walkers of a server."""

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        num_envs: int,
        autoreset_mode: str,
        server: str,
        master_uri: str,
        timeout: float,
    ) -> None:
        self.specification: Specification = _core.Environment(
            env_id, dict(parameters)
        ).specification
        wanted = {
            **self.specification,
            "num_envs": num_envs,
            "mode": "lockstep",
            "autoreset_mode": autoreset_mode,
        }
        self._connection = Connection(wanted, server, master_uri, timeout)
        self.num_envs = num_envs
        self._observation_size = len(self.specification["observation_low"])
        self._num_infos = len(self.specification["info_names"])
        self._dtype = np.dtype(self.specification["observation_dtype"])
        self._observations, self._info = self._rows(num_envs)

    def _rows(self, count: int) -> tuple[NDArray[Any], NDArray[np.float64]]:
        return (
            np.zeros((count, self._observation_size), self._dtype),
            np.zeros((count, self._num_infos)),
        )

    def reset(
        self, environments: list[int], seeds: Sequence[int | None]
    ) -> tuple[NDArray[Any], NDArray[np.float64]]:
        self._connection.begin()
        chosen = environments or list(range(self.num_envs))
        observations, info = self._rows(len(chosen))
        try:
            self._connection.client.reset_batch(environments, seeds, observations, info)
        except ConnectionError:
            self._connection.is_lost = True
            raise
        self._observations[chosen], self._info[chosen] = observations, info
        return self._observations.copy(), self._info.copy()

    def step(self, actions: NDArray[np.float64]) -> Batch:
        self._connection.check()
        observations, info = self._rows(self.num_envs)
        flags = np.zeros((2, self.num_envs), np.bool_)
        batch = Batch(observations, np.zeros(self.num_envs), flags[0], flags[1], info)
        try:
            self._connection.client.step_batch(actions, *batch)
        except ConnectionError:
            self._connection.is_lost = True
            raise
        self._observations = observations.copy()
        return batch

    def final_rows(self) -> tuple[NDArray[Any], NDArray[np.float64]]:
        observations, info = self._rows(self.num_envs)
        ended = self._connection.client.final_environments()
        some_observations, some_info = self._rows(len(ended))
        self._connection.client.final_rows(some_observations, some_info)
        observations[ended], info[ended] = some_observations, some_info
        return observations, info

    def error(self, environment: int) -> str:
        """A batch's answer does not say."""
        return ""

    def close(self) -> None:
        self._connection.close()


__all__ = ["RemoteWalker", "RemoteWalkers", "RequestRefused", "differences"]
