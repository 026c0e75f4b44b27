"""Walkers as a `VecEnv` of Stable-Baselines3, which takes no Gymnasium vector environment."""

from __future__ import annotations

import copy
from typing import Any, Callable, Dict, List, Sequence

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common import vec_env
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from walker_sim.arguments import refuse_unknown, to_actions, to_count, to_indices
from walker_sim.making import make_walkers
from walker_sim.registration import NAMESPACE, without_namespace
from walker_sim.rendering import Draw, Pictures, metadata_of, split_keywords
from walker_sim.sb3_env_fns import EnvFns, VecEnvSpec, spec_of
from walker_sim.walkers import ServerAddress, attributes_of, by_name, spaces_of
from walker_sim.worlds import AnyWorld, AnyWorlds, to_world, to_worlds

Infos = List[Dict[str, Any]]


class VecEnv(vec_env.VecEnv):
    """Stable-Baselines3 vector environment whose walkers are stepped together by threads.

    A step that ends an episode also begins the next. `VecMonitor`, `VecNormalize` and the other
    wrappers go around this environment. In process, copies and pickles carry the whole states of
    all walkers.

    Parameters
    ----------
    env_id
        Gymnasium's id, e.g. ``BipedalWalker-v3``, with or without the prefix ``walker_sim/``. Or
        the functions that Stable-Baselines3's ``make_vec_env(ID, n, vec_env_cls=VecEnv)`` passes:
        each makes one walker in process, all are alike, and the only wrapper is `Monitor`, whose
        infos and files are preserved. The functions then determine all other arguments but
        `num_threads`.
    num_envs
        Number of walkers, at least 1.
    transport
        ``inprocess``, or ``ros``: a server in lock-step with ``autoreset_mode`` same_step.
    server, master_uri, timeout, spin_us, num_threads, max_episode_steps, parameters
        As for `walker_sim.WalkerVectorEnv`.
    render_mode
        ``rgb_array``, ``human`` (a window shows the first walker) or None.
    world
        As for `walker_sim.WalkerVectorEnv`.

    Attributes
    ----------
    reset_infos
        Info of each walker's last reset, floats by name; in a world also ``world``, what the
        episode has drawn, as for `walker_sim.WalkerEnv`. ``error`` is present only if the engine
        failed: that walker's observation is zeros, and its next step is another reset.

    Raises
    ------
    ValueError, TypeError, walker_sim.ConnectionError, walker_sim.ServerMismatch
        As `walker_sim.WalkerEnv`.
    """

    def __init__(
        self,
        env_id: str | EnvFns,
        num_envs: int = 1,
        *,
        transport: str = "inprocess",
        server: str = "/walker_sim",
        master_uri: str = "",
        timeout: float = 10.0,
        spin_us: int | None = None,
        num_threads: int = 0,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        world: AnyWorlds = None,
        **parameters: Any,
    ) -> None:
        made: VecEnvSpec | None = None
        if not isinstance(env_id, str):
            others = {**parameters, "render_mode": render_mode, "transport": transport}
            others["world"] = world
            others.update(max_episode_steps=max_episode_steps, num_envs=num_envs)
            others.update(server=server, master_uri=master_uri, timeout=timeout, spin_us=spin_us)
            made = spec_of(env_id, others)
            env_id, num_envs, parameters = made.env_id, made.num_envs, dict(made.parameters)
            max_episode_steps, render_mode = made.max_episode_steps, made.render_mode
            world = made.worlds
        self._env_id = env_id = without_namespace(env_id)
        parameters, camera = split_keywords(env_id, parameters)
        refuse_unknown(VecEnv.__init__, env_id, parameters)
        num_envs = to_count("num_envs", num_envs, 1)
        num_threads = to_count("num_threads", num_threads, 0)
        worlds = to_worlds(env_id, world, num_envs)
        if max_episode_steps is not None:
            parameters["max_episode_steps"] = 0 if max_episode_steps == -1 else max_episode_steps
        address = ServerAddress(transport, server, master_uri, timeout, spin_us)
        self._walkers = make_walkers(
            env_id, num_envs, "same_step", parameters, address, num_threads
        )
        if world is not None:
            self._walkers.set_world([], worlds)
        specification = self._walkers.specification
        self._pictures = Pictures(
            *(env_id, parameters, render_mode, camera, specification["dt"]), ("human", "rgb_array")
        )
        self.spec = gymnasium.registry.get(f"{NAMESPACE}/{env_id}")
        self._info_names: list[str] = specification["info_names"]
        self._parameter_names = frozenset(specification["parameters"])
        self._action_size = len(specification["action_low"])
        self._actions: NDArray[np.float64] | None = None
        self._is_closed = False
        self._failed: set[int] = set()  # walkers whose last reset failed
        observation_space, action_space = made.spaces if made else spaces_of(specification)
        # A single walker's attributes, for `get_attr`. The base class's constructor reads some.
        shared = {
            "action_space": action_space,
            "observation_space": observation_space,
            "render_mode": render_mode,
            "metadata": metadata_of(specification),
            "spec": self.spec,
            "dt": specification["dt"],
            **attributes_of(specification),
        }
        self._attributes: Infos = [dict(shared) for _ in range(num_envs)]
        self._feeds = made.feeds if made else []
        for attributes, feed in zip(self._attributes, self._feeds):
            attributes.update(feed.methods())
        super().__init__(num_envs, observation_space, action_space)
        # VecVideoRecorder reads it from here.
        self.metadata["render_fps"] = shared["metadata"]["render_fps"]

    def reset(self) -> NDArray[Any]:
        """Begins an episode of each walker, with the seeds set by `seed` since the last reset, and
        with the option ``world`` of `set_options`, as for `WalkerEnv.reset`.

        Returns
        -------
        Observations, shape (num_envs, observation size).
        """
        self._check_open()
        worlds = {i: given["world"] for i, given in enumerate(self._options) if "world" in given}
        self.set_world([*worlds.values()], [*worlds])
        self._actions = None
        observations, info = self._walkers.reset([], self._seeds)
        self.reset_infos = self._to_dicts(info)
        self._complete_reset_infos([*range(self.num_envs)])
        self._reset_seeds()
        self._reset_options()
        for feed in self._feeds:
            feed.reset()
        self._show_first(self._pictures.begin)
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Stores actions for `step_wait`; `InvalidAction` if not shape (num_envs, action size)."""
        self._actions = to_actions(actions, self.num_envs, self._action_size)

    def step_wait(self) -> tuple[NDArray[Any], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Advances each world by `dt`.

        Returns
        -------
        observations
            Shape (num_envs, observation size); for an episode that ended, the next one's first.
        rewards, dones
            Shape (num_envs,).
        infos
            One per walker: ``TimeLimit.truncated``; the walker's floats by name;
            ``terminal_observation`` if the episode ended; ``error`` if the engine had to end it.

        Raises
        ------
        walker_sim.InvalidAction
            If an action has a non-finite value. All states are unchanged.
        walker_sim.ResetNeeded
            Before the first reset.
        RuntimeError
            If `step_async` was not called, or after `close`.
        """
        self._check_open()
        if self._actions is None:
            raise RuntimeError("step_wait without actions; call step_async first")
        actions, self._actions = self._actions, None
        batch = self._walkers.step(actions)
        dones = batch.terminated | batch.truncated
        infos = self._to_dicts(batch.info)
        self._take_final_rows(np.flatnonzero(dones).tolist(), infos)
        for i in sorted(self._failed):
            if not dones[i]:  # this step was the walker's reset
                self.reset_infos[i] = dict(infos[i])
                self._complete_reset_infos([i])
        is_cut_off = batch.truncated & ~batch.terminated
        for info, flag in zip(infos, is_cut_off.tolist()):
            info["TimeLimit.truncated"] = flag
        for feed, reward, terminated, truncated, info in zip(
            self._feeds, batch.rewards, batch.terminated, batch.truncated, infos
        ):
            feed.step(float(reward), bool(terminated), bool(truncated), info)
            if terminated or truncated:
                feed.reset()
        self._show_first(self._pictures.follow)
        return batch.observations, batch.rewards.astype(np.float32), dones, infos

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Returns one picture per walker, shape (height, width, 3); None without rgb_array."""
        self._check_open()
        if self.render_mode != "rgb_array":
            return [None] * self.num_envs
        return [self._pictures.colors(self._walkers.drawer(i)) for i in range(self.num_envs)]

    def render(self, mode: str | None = None) -> NDArray[np.uint8] | None:
        """Returns the walkers' pictures as a mosaic, or updates the window in mode human."""
        if self.render_mode != "human" or mode not in (None, "human"):
            picture: NDArray[np.uint8] | None = super().render(mode)
            return picture
        self._check_open()
        self._show_first(self._pictures.show)
        return None

    def close(self) -> None:
        """Ends the threads or closes the connection; closes the window, if any."""
        if not self._is_closed:
            self._is_closed = True
            self._walkers.close()
            self._pictures.close()
            for feed in self._feeds:
                feed.monitor.close()

    def set_world(self, world: AnyWorlds, indices: VecEnvIndices = None) -> None:
        """Sets the worlds of walkers from each one's next reset on, as
        `walker_sim.WalkerVectorEnv.set_world`."""
        self._check_open()
        environments = self._to_indices(indices)
        worlds = to_worlds(self._env_id, world, len(environments))
        if environments:  # the core takes none for all
            self._walkers.set_world(environments, worlds)

    def get_state(self, indices: VecEnvIndices = None) -> list[bytes]:
        """In process: returns the whole states of walkers, as `WalkerVectorEnv.get_state`."""
        self._check_open()
        return self._walkers.pool("get_state").get_states(self._to_indices(indices))

    def set_state(self, states: Sequence[bytes], indices: VecEnvIndices = None) -> None:
        """In process: restores the states of walkers, as `WalkerVectorEnv.set_state`."""
        self._check_open()
        environments = self._to_indices(indices)
        self._walkers.pool("set_state").set_states(environments, states)
        for i in environments:
            self._record_failure(i)

    def __copy__(self) -> VecEnv:
        """Returns a deep copy: two environments must not drive the same walkers."""
        return copy.deepcopy(self)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Returns an attribute of walkers: spaces, metadata, spec, dt, world, or a value of
        `set_attr`."""
        if attr_name == "world":
            worlds = self._walkers.worlds()
            return [worlds[i] for i in self._get_indices(indices)]
        try:
            return [self._attributes[i][attr_name] for i in self._get_indices(indices)]
        except KeyError:
            names = ", ".join([*self._attributes[0], "world"])
            raise AttributeError(
                f"a walker has no attribute {attr_name!r}; must be one of {names}"
            ) from None

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Stores a value for `get_attr`. The parameters of a walker cannot be set."""
        if attr_name in self._parameter_names:
            raise AttributeError(
                f"{attr_name} cannot be set to {value!r}: a walker's parameters are fixed when it"
                " is made"
            )
        if attr_name == "world":
            raise AttributeError("world: cannot be set by set_attr; call set_world")
        for i in self._get_indices(indices):
            self._attributes[i][attr_name] = value

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Calls a `Monitor`'s getter or a function stored by `set_attr`; or ``set_world`` with one
        world for all of these walkers; or, in process, ``get_state``, or ``set_state`` with one
        state for all of these walkers."""
        if method_name not in self._attributes[0]:
            if method_name == "get_state":
                return self.get_state(indices, *method_args, **method_kwargs)
            if method_name == "set_state":
                return self._set_one_state(indices, *method_args, **method_kwargs)
            if method_name == "set_world":
                return self._set_one_world(indices, *method_args, **method_kwargs)
        methods = self.get_attr(method_name, indices)
        return [method(*method_args, **method_kwargs) for method in methods]

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],
        indices: VecEnvIndices = None,
    ) -> list[bool]:
        """Returns whether the wrapper is the `Monitor` of ``make_vec_env``; there is no other."""
        has = bool(self._feeds) and issubclass(Monitor, wrapper_class)
        return [has for _ in self._get_indices(indices)]

    def _take_final_rows(self, ended: list[int], infos: Infos) -> None:
        """Moves the infos of new episodes to `reset_infos`; puts the final infos into `infos`."""
        if not ended:
            return
        observations, info = self._walkers.final_rows(self.num_envs)
        for i, final in zip(ended, self._to_dicts(info[ended])):
            final["terminal_observation"] = observations[i]
            error = self._walkers.error(i)
            if error:
                final["error"] = error
            self.reset_infos[i], infos[i] = infos[i], final
        self._complete_reset_infos(ended)

    def _complete_reset_infos(self, begun: list[int]) -> None:
        """Adds what these walkers have drawn from their worlds, and their engines' errors."""
        for i, drawn in zip(begun, self._walkers.episode_worlds(begun)):
            if drawn:
                self.reset_infos[i]["world"] = drawn
            error = self._record_failure(i)
            if error:
                self.reset_infos[i]["error"] = error

    def _record_failure(self, walker: int) -> str:
        """Records whether a walker's last reset failed. Returns the engine's error, if so."""
        error = self._walkers.reset_error(walker)
        (self._failed.add if error else self._failed.discard)(walker)
        return error

    def _to_dicts(self, info: NDArray[np.float64]) -> Infos:
        """Returns each row as a dictionary, without absent values, which are NaN."""
        if np.isnan(info).any():
            return [by_name(self._info_names, row) for row in info.tolist()]
        return [dict(zip(self._info_names, row)) for row in info.tolist()]

    def _show_first(self, show: Callable[[Draw], None]) -> None:
        if self.render_mode == "human" and not self._walkers.reset_error(0):
            show(self._walkers.drawer(0))

    def _set_one_state(self, indices: VecEnvIndices, state: bytes) -> list[None]:
        chosen = self._to_indices(indices)
        self.set_state([state] * len(chosen), chosen)
        return [None] * len(chosen)

    def _set_one_world(self, indices: VecEnvIndices, world: AnyWorld) -> list[None]:
        chosen = self._to_indices(indices)
        self.set_world(to_world(self._env_id, world), chosen)
        return [None] * len(chosen)

    def _to_indices(self, indices: VecEnvIndices) -> list[int]:
        return to_indices("indices", self._get_indices(indices), self.num_envs)

    def _check_open(self) -> None:
        if self._is_closed:
            raise RuntimeError("this VecEnv is closed")
