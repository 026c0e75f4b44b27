"""One walker as a Gymnasium environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from walker_sim.spaces import action_space_of, observation_space_of
from walker_sim.transport import TRANSPORTS, Walker


def make_walker(
    env_id: str,
    transport: str,
    server: str,
    master_uri: str,
    timeout: float,
    max_episode_steps: int | None,
    parameters: dict[str, Any],
) -> Walker:
    """The walker, here or on a server; the server's is compared with what is asked for."""
    if transport == "inprocess":
        from walker_sim.in_process import InProcessWalker

        return InProcessWalker(env_id, {**parameters, "max_episode_steps": max_episode_steps or 0})
    if transport == "ros":
        from walker_sim.over_ros import RemoteWalker

        return RemoteWalker(env_id, parameters, max_episode_steps, server, master_uri, timeout)
    raise ValueError(f"transport = {transport!r}: must be one of {', '.join(TRANSPORTS)}")


class WalkerEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """A walker with Gymnasium's spaces, rewards and bits.

    Parameters
    ----------
    env_id
        As Gymnasium has it, e.g. ``BipedalWalker-v3``. ``gymnasium.make`` fills it in.
    transport
        ``inprocess``, or ``ros``: a server in lock-step on a ROS master.
    server
        Over ROS: the server's node name.
    master_uri
        Over ROS: empty stands for ``ROS_MASTER_URI``, or ``http://localhost:11311``.
    timeout
        Over ROS: of each call [s of wall time].
    max_episode_steps
        On which step an episode is truncated. In process None and 0 leave that to Gymnasium's
        ``TimeLimit``; over ROS the server's limit must be the same.
    render_mode
        None: there is no rendering yet.
    parameters
        The environment's own, e.g. ``hardcore``, ``reuse_world``, ``forward_reward_weight``.

    Raises
    ------
    ValueError, TypeError
        Naming the parameter, its value and what is allowed.
    walker_sim.ConnectionError, walker_sim.ServerMismatch
        Over ROS.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  # Gymnasium's own form

    def __init__(
        self,
        env_id: str,
        *,
        transport: str = "inprocess",
        server: str = "/walker_sim",
        master_uri: str = "",
        timeout: float = 10.0,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        if render_mode is not None:
            raise ValueError(
                f"render_mode = {render_mode!r}: there is no rendering yet; must be None"
            )
        self.render_mode = None
        self._transport = transport
        self._walker = make_walker(
            env_id, transport, server, master_uri, timeout, max_episode_steps, parameters
        )
        specification = self._walker.specification
        self.observation_space = observation_space_of(specification)
        self.action_space = action_space_of(specification)
        self.metadata = {**self.metadata, "render_fps": round(1 / specification["dt"])}
        self._info_names = specification["info_names"]
        self._observation_size = len(specification["observation_low"])
        self._observation_dtype = np.dtype(specification["observation_dtype"])

    @property
    def dt(self) -> float:
        """Simulation time of one step [s]."""
        return float(self._walker.specification["dt"])

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begins an episode.

        Parameters
        ----------
        seed
            The episode depends on nothing else; None: the generator continues.
        options
            None are known, and any are ignored, as Gymnasium's walkers do.

        Returns
        -------
        observation
            Shape as `observation_space`.
        info
            Floats by name.
        """
        super().reset(seed=seed)
        observation, info = self._arrays()
        self._walker.reset(seed, self.np_random, observation, info)
        return observation, self._to_dict(info)

    def step(self, action: NDArray[Any]) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Advances the world by `dt`.

        Parameters
        ----------
        action
            Shape as `action_space`, unitless; beyond its bounds limited as Gymnasium limits it.

        Returns
        -------
        observation, reward, terminated, truncated, info
            As Gymnasium's; ``info["error"]`` only where the simulation had to end the episode.

        Raises
        ------
        walker_sim.InvalidAction
            For a wrong size, or a value that is not finite. Nothing has moved.
        walker_sim.ResetNeeded
            Without a running episode.
        """
        observation, info = self._arrays()
        reward, terminated, truncated, error = self._walker.step(
            np.ascontiguousarray(action, np.float64), observation, info
        )
        infos = self._to_dict(info)
        if error:
            infos["error"] = error
        return observation, reward, terminated, truncated, infos

    def close(self) -> None:
        """Lets go of the connection, if there is one."""
        self._walker.close()

    def _arrays(self) -> tuple[NDArray[Any], NDArray[np.float64]]:
        return (
            np.empty(self._observation_size, self._observation_dtype),
            np.empty(len(self._info_names)),
        )

    def _to_dict(self, info: NDArray[np.float64]) -> dict[str, Any]:
        """Without what is absent, which is NaN."""
        if not self._info_names:
            return {}
        pairs = zip(self._info_names, info.tolist())
        return {name: value for name, value in pairs if value == value}
