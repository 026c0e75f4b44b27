"""A walker as a Gymnasium environment."""

from __future__ import annotations

import copy
from typing import Any, Mapping, cast

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import ArrayLike, NDArray

from walker_sim.arguments import refuse_unknown, to_action, to_coordinates
from walker_sim.making import make_single
from walker_sim.registration import without_namespace
from walker_sim.rendering import ALL_MODES, Picture, Pictures, metadata_of, split_keywords
from walker_sim.walkers import ServerAddress, State, attributes_of, by_name, spaces_of
from walker_sim.worlds import AnyWorld, World, to_world


class WalkerEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """Gymnasium environment of one walker, with the results of Gymnasium's own to the bit.

    Copies, pickles and `get_state` carry the whole state: a copy continues like its original, to
    the bit. Threads may share an environment; its calls are serialized.

    Parameters
    ----------
    env_id
        Gymnasium's id, e.g. ``BipedalWalker-v3``, with or without the prefix ``walker_sim/``.
        ``gymnasium.make`` fills it in.
    transport
        ``inprocess``, or ``ros``: a server in lock-step on a ROS master.
    server
        Over ROS: the server's node name.
    master_uri
        Over ROS: empty stands for ``ROS_MASTER_URI``, or ``http://localhost:11311`` if that is
        unset.
    timeout
        Over ROS: timeout of each call [s of wall time].
    spin_us
        Over ROS: longest time to poll for an answer before the call blocks, 0 to 1000 [us]; 0:
        none; None: twenty times what waking a thread costs on this machine, 50 to 1000 us. A call
        polls only while recent answers came within that time.
    max_episode_steps
        Step on which an episode is truncated. In process, None, -1 and 0 leave truncation to
        Gymnasium's ``TimeLimit``. Over ROS the server must have this limit (-1 and 0: none; None:
        the limit of `gymnasium.make`, or the id's own).
    render_mode
        ``human`` or ``rgb_array``; for Walker2d and Hopper also ``depth_array`` and
        ``rgbd_tuple``; None: no pictures, at no cost. See `render`.
    world
        World of the episodes: level, physics, disturbances, delays and noise. See `set_world`.
        None: Gymnasium's. Over ROS each reset requests it, and the server keeps it; None leaves
        the server's own.
    parameters
        Parameters of the environment, e.g. ``hardcore``, ``reuse_world``,
        ``forward_reward_weight``, and of its camera: ``width`` and ``height`` [pixels]; for
        Walker2d and Hopper also ``camera_id`` or ``camera_name``, ``max_geom`` and, in v5,
        ``default_camera_config``.

    Raises
    ------
    ValueError, TypeError
        If a parameter is invalid. Names the parameter, its value and what is allowed.
    walker_sim.ConnectionError, walker_sim.ServerMismatch
        Over ROS: if no server answers, or the server differs.
    """

    metadata: dict[str, Any] = {"render_modes": [*ALL_MODES]}  # noqa: RUF012  # Gymnasium's form

    def __init__(
        self,
        env_id: str,
        *,
        transport: str = "inprocess",
        server: str = "/walker_sim",
        master_uri: str = "",
        timeout: float = 10.0,
        spin_us: int | None = None,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        world: AnyWorld = None,
        **parameters: Any,
    ) -> None:
        self.env_id = env_id = without_namespace(env_id)
        # walker_sim.sb3_env_fns reads these to make the same walkers as one vector environment.
        self.keywords = {**parameters, "max_episode_steps": max_episode_steps}
        self.keywords.update(transport=transport, render_mode=render_mode)
        ranges = to_world(env_id, world)
        parameters, camera = split_keywords(env_id, parameters)
        refuse_unknown(WalkerEnv.__init__, env_id, parameters)
        self.render_mode = render_mode
        self._transport = transport
        address = ServerAddress(transport, server, master_uri, timeout, spin_us)
        self._walkers = make_single(WalkerEnv, env_id, address, max_episode_steps, parameters)
        if world is not None:
            self._walkers.set_world([0], [ranges])
        specification = self._walkers.specification
        self._pictures = Pictures(env_id, parameters, render_mode, camera, specification["dt"])
        self._is_closed = False
        self.observation_space, self.action_space = spaces_of(specification)
        self.metadata = metadata_of(specification)
        self._action_shape = self.action_space.shape
        self._info_names = specification["info_names"]
        self._observation_size = len(specification["observation_low"])
        self._observation_dtype = np.dtype(specification["observation_dtype"])

    @property
    def dt(self) -> float:
        """Simulation time of one step [s]."""
        return float(self._walkers.specification["dt"])

    @property
    def hardcore(self) -> bool:
        """BipedalWalker: whether the terrain has stumps, stairs and pits."""
        return self._constant("hardcore")  # type: ignore[no-any-return]

    @property
    def observation_structure(self) -> dict[str, int]:
        """Walker2d-v5, Hopper-v5: numbers of skipped positions, positions and velocities."""
        return self._constant("observation_structure")  # type: ignore[no-any-return]

    @property
    def world(self) -> World:
        """World of the resets to come: (low, high) or ``{"log": (low, high)}`` by parameter name;
        empty: Gymnasium's."""
        return self._walkers.worlds()[0]

    def set_world(self, world: AnyWorld) -> None:
        """Sets the world from the next reset on.

        Parameters
        ----------
        world
            A mapping of parameters to numbers, or to pairs (low, high) from which each episode
            draws uniformly, e.g. ``{"gravity": -5, "push_interval": (1, 3)}``, or to
            ``{"log": (low, high)}``, whose logarithm it draws uniformly; or that as a text of
            YAML; or a preset's name, e.g. ``"moon"``; or the path of a YAML file. Parameters that
            are absent have Gymnasium's values. None: Gymnasium's world.

        Raises
        ------
        ValueError, TypeError
            If the walker cannot apply the world. Names the parameter, its value and what is
            allowed. Nothing has changed.
        """
        self._walkers.set_world([0], [to_world(self.env_id, world)])

    @property
    def is_healthy(self) -> bool:
        """Walker2d, Hopper, in process: whether height and angles are in their healthy ranges.
        Raises `ResetNeeded` before the first reset."""
        return self._walkers.is_healthy

    def control_cost(self, action: ArrayLike) -> Any:
        """Walker2d, Hopper: returns the cost that an action subtracts from the reward."""
        weight = self._walkers.specification["parameters"].get("ctrl_cost_weight")
        if weight is None:
            raise AttributeError(f"control_cost: {self.env_id} has no such method")
        return float(weight) * np.sum(np.square(action))  # in the action's precision, as Gymnasium

    @property
    def np_random(self) -> np.random.Generator:
        """Generator of terrain and noise. Not available over ROS, where the server has it."""
        self._require_own_generator()
        return super().np_random

    @np_random.setter
    def np_random(self, value: np.random.Generator) -> None:
        self._require_own_generator()
        self._np_random = value
        self._np_random_seed = -1  # unknown, as in Gymnasium

    def _require_own_generator(self) -> None:
        if self._transport == "ros":
            raise AttributeError(
                'np_random: over ROS there is none; only with transport="inprocess"'
            )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begins an episode.

        Parameters
        ----------
        seed
            Determines the episode completely, except with ``reuse_world``; None: the generator
            continues.
        options
            ``world``: the world of this and the following episodes, as for `set_world`. Other
            options are ignored, as by Gymnasium's walkers.

        Returns
        -------
        observation
            Shape of `observation_space`.
        info
            Floats by name; in a world also ``world``, what the episode has drawn: floats by name,
            and ranges of what changes within it. As a world, with the same seed, this repeats the
            episode to the bit.

        Raises
        ------
        gymnasium.error.Error
            If the seed is negative or not a Python integer.
        ValueError, TypeError
            If the walker cannot apply the world. The present episode and world are unchanged.
        """
        has_world = isinstance(options, Mapping) and "world" in options
        world = to_world(self.env_id, options["world"]) if options and has_world else None
        super().reset(seed=seed)
        observation, info = state = self._new_state()
        self._walkers.reset_single(seed, super().np_random, state, world)
        self._is_closed = False
        self._pictures.begin(self._walkers.drawer(0))
        infos = by_name(self._info_names, info.tolist())
        (drawn,) = self._walkers.episode_worlds([0])
        if drawn:
            infos["world"] = drawn
        return observation, infos

    def step(self, action: NDArray[Any]) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Advances the world by `dt`.

        Parameters
        ----------
        action
            Shape of `action_space`, unitless, clipped to the bounds as Gymnasium clips it.

        Returns
        -------
        observation, reward, terminated, truncated, info
            As in Gymnasium. ``info["error"]`` is present only if the engine had to end the episode.

        Raises
        ------
        walker_sim.InvalidAction
            If the action has the wrong shape or a non-finite value. The state is unchanged.
        walker_sim.ResetNeeded
            If there is no running episode.
        gymnasium.error.ClosedEnvironmentError
            After `close`, until the next reset.
        """
        self._require_open("step")
        values = to_action(action, self._action_shape)
        observation, info = state = self._new_state()
        reward, terminated, truncated, error = self._walkers.step_single(values, state)
        infos = by_name(self._info_names, info.tolist())
        if error:
            infos["error"] = error
        elif self.render_mode == "human":
            self._pictures.follow(self._walkers.drawer(0))
        return observation, reward, terminated, truncated, infos

    def render(self) -> Picture | None:
        """Draws the present state, without effect on later steps.

        Returns
        -------
        rgb_array
            uint8, shape (height, width, 3), rows from top to bottom.
        depth_array
            float32, shape (height, width): OpenGL's depth buffer, from 0 (near) to 1 (far).
        rgbd_tuple
            Both.
        human, None
            None. With ``human``, each reset and step also updates the window, in real time: slow
            drawing drops pictures, never steps. Without a render mode a warning is logged.

        Raises
        ------
        walker_sim.ResetNeeded
            Before the first reset, or after the engine had to end the episode.
        gymnasium.error.ClosedEnvironmentError
            After `close`, until the next reset.
        gymnasium.error.DependencyNotInstalled, RuntimeError
            If pygame, or a library that draws the picture, is missing. Names what to install.
        """
        self._require_open("render")
        return self._pictures.render(self._walkers.drawer(0))

    def get_state(self) -> bytes:
        """Returns the whole state, also within an episode, in a time independent of its length.

        The state includes `np_random` and the worlds of the present and of later episodes (over
        ROS only of the present one), but no wrappers: Gymnasium's ``TimeLimit`` keeps its own step
        count. `copy.deepcopy` also copies wrappers.

        Returns
        -------
        ``bytes`` for `set_state`, in this or another process. Over ROS they are the server's record
        of the episode, which grows with it; `set_state` lets the server replay it.

        Raises
        ------
        ValueError
            If `np_random` is not on PCG64.
        gymnasium.error.ClosedEnvironmentError
            After `close`, until the next reset.
        """
        self._require_open("get_state")
        return self._walkers.get_state(self._np_random)

    def set_state(self, state: bytes | ArrayLike, qvel: ArrayLike | None = None) -> None:
        """Restores a state, to the bit and independently of the walker's past.

        Parameters
        ----------
        state
            Result of `get_state`, or an element of `WalkerVectorEnv.get_state`, of any walker with
            the same id, parameters and engine. If `qvel` is given (Walker2d and Hopper):
            MuJoCo's positions ``qpos`` [m, rad], as for Gymnasium's ``set_state``.
        qvel
            MuJoCo's velocities [m/s, rad/s]. The present episode continues from there.

        Raises
        ------
        ValueError, TypeError
            If the state is of another kind of walker or is damaged, or if `qpos` or `qvel` has a
            wrong size or a number that is not finite. Names the difference. The present state is
            unchanged.
        walker_sim.ResetNeeded, RuntimeError
            If `qvel` is given before the first reset or after a failure of the engine, or for
            BipedalWalker.
        """
        if qvel is not None:
            self._require_open("set_state")
            self._walkers.set_coordinates(
                to_coordinates("qpos", state), to_coordinates("qvel", qvel)
            )
            return
        random = self._walkers.set_state(cast(bytes, state))
        if self._transport != "ros":
            self._np_random = random
            self._np_random_seed = None if random is None else -1  # unknown, as after setting it
        self._is_closed = False

    def __copy__(self) -> WalkerEnv:
        """Returns a deep copy: two environments must not drive one walker."""
        return copy.deepcopy(self)

    def close(self) -> None:
        """Ends the episode and closes the connection and the window, if any. Idempotent.

        The next reset reopens the environment: Gymnasium's walkers also work after `close`, and
        environment checkers rely on it.
        """
        if self._transport == "ros":
            self._walkers.close()
        self._pictures.close()
        self._is_closed = True

    def _constant(self, name: str) -> Any:
        attributes = attributes_of(self._walkers.specification)
        if name not in attributes:
            raise AttributeError(f"{name}: {self.env_id} has no such attribute")
        return attributes[name]

    def _require_open(self, call: str) -> None:
        if self._is_closed:
            raise ClosedEnvironmentError(f"{call}: the environment has been closed; reset first")

    def _new_state(self) -> State:
        return (
            np.empty(self._observation_size, self._observation_dtype),
            np.empty(len(self._info_names)),
        )
