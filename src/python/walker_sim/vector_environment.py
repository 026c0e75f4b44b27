"""Many walkers as a Gymnasium vector environment."""

from __future__ import annotations

from typing import Any, Dict, Optional, Sequence, Union

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from walker_sim.spaces import action_space_of, observation_space_of
from walker_sim.transport import TRANSPORTS, Batch, Walkers

Seeds = Union[None, int, Sequence[Optional[int]]]
Infos = Dict[str, Any]


def make_walkers(
    env_id: str,
    num_envs: int,
    transport: str,
    server: str,
    master_uri: str,
    timeout: float,
    num_threads: int,
    batch_size: int,
    autoreset_mode: str,
    parameters: dict[str, Any],
) -> Walkers:
    """The walkers, here or on a server; the server's are compared with what is asked for."""
    if transport == "inprocess":
        from walker_sim.in_process import InProcessWalkers

        return InProcessWalkers(
            env_id, parameters, num_envs, num_threads, autoreset_mode, batch_size
        )
    if transport == "ros":
        from walker_sim.over_ros import RemoteWalkers

        return RemoteWalkers(
            env_id, parameters, num_envs, autoreset_mode, server, master_uri, timeout
        )
    raise ValueError(f"transport = {transport!r}: must be one of {', '.join(TRANSPORTS)}")


class WalkerVectorEnv(VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """As many walkers as one likes, stepped together by threads, in Gymnasium's terms."""

    def __init__(
        self,
        env_id: str,
        num_envs: int = 1,
        *,
        transport: str = "inprocess",
        server: str = "/walker_sim",
        master_uri: str = "",
        timeout: float = 10.0,
        num_threads: int = 0,
        batch_size: int = 0,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        if render_mode is not None:
            raise ValueError(
                f"render_mode = {render_mode!r}: there is no rendering yet; must be None"
            )
        self.render_mode = None
        mode = self._to_mode(autoreset_mode)
        if max_episode_steps is not None:
            parameters["max_episode_steps"] = max(max_episode_steps, 0)
        self._walkers = make_walkers(
            *(env_id, num_envs, transport, server, master_uri, timeout),
            *(num_threads, batch_size, mode.name.lower(), parameters),
        )
        specification = self._walkers.specification
        self.num_envs = num_envs
        self.autoreset_mode = mode
        self.single_observation_space = observation_space_of(specification)
        self.single_action_space = action_space_of(specification)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.metadata = {
            "render_modes": [],
            "render_fps": round(1 / specification["dt"]),
            "autoreset_mode": mode,
        }
        self._info_names: list[str] = specification["info_names"]

    @staticmethod
    def _to_mode(given: str | AutoresetMode) -> AutoresetMode:
        """Gymnasium's enum, its value (NextStep) or its name (next_step)."""
        if isinstance(given, AutoresetMode):
            return given
        for mode in AutoresetMode:
            if given in (mode.value, mode.name.lower()):
                return mode
        raise ValueError(f"autoreset_mode = {given!r}: must be next_step, same_step or disabled")

    def reset(
        self, *, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], Infos]:
        """Begins episodes: of all, or of those that ``options["reset_mask"]`` names."""
        if seed is None:
            seeds: list[int | None] = []
        elif isinstance(seed, int):
            seeds = [seed + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        observations, info = self._walkers.reset([], seeds)
        return observations, self._to_infos(info)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], Infos]:
        """Steps all walkers."""
        batch: Batch = self._walkers.step(np.ascontiguousarray(actions, np.float64))
        infos = self._to_infos(batch.info)
        return (batch.observations, batch.rewards, batch.terminated, batch.truncated, infos)

    def _to_infos(self, info: NDArray[np.float64]) -> Infos:
        infos: Infos = {}
        for name, column in zip(self._info_names, info.T):
            is_there = ~np.isnan(column)
            if is_there.any():
                infos[name] = np.where(is_there, column, 0.0)
                infos[f"_{name}"] = is_there
        return infos

    def close_extras(self, **kwargs: Any) -> None:
        self._walkers.close()
