"""Walkers as a Gymnasium vector environment."""

from __future__ import annotations

import copy
from typing import Any, Callable, Mapping, Sequence, Tuple, cast

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from walker_sim import _core, arguments
from walker_sim.in_process import InProcessWalkers
from walker_sim.making import make_walkers
from walker_sim.registration import without_namespace
from walker_sim.rendering import Draw, Picture, Pictures, metadata_of, split_keywords
from walker_sim.vector_infos import Infos, add_errors, add_finals, add_worlds, to_infos
from walker_sim.walkers import Batch, ServerAddress, attributes_of, spaces_of
from walker_sim.worlds import AnyWorlds, World, to_worlds

try:
    from gymnasium.vector import AutoresetMode
except ImportError as error:
    raise ImportError(
        f"WalkerVectorEnv needs Gymnasium 1.1 or later; this is {gymnasium.__version__}"
    ) from error

Outcome = Tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], Infos]
"""Observations, rewards, terminated, truncated, infos."""


class WalkerVectorEnv(VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """Vector environment whose walkers are stepped together by threads.

    Results equal those of Gymnasium's ``SyncVectorEnv`` of the same single walkers, to the bit. All
    returned arrays are new and owned by the caller. Copies and pickles carry the whole states of
    all walkers, as `get_state` does.

    Parameters
    ----------
    env_id, transport, server, master_uri, timeout, spin_us, parameters
        As for `WalkerEnv`.
    num_envs
        Number of walkers, at least 1.
    num_threads
        In process: number of threads, including the caller's; 0: one per processor. Results do not
        depend on it.
    batch_size
        In process: number of walkers that `recv` waits for; 0: all.
    autoreset_mode
        ``next_step``, ``same_step`` or ``disabled``, or Gymnasium's enumeration.
    max_episode_steps
        Step on which an episode is truncated; None: the id's limit; -1 or 0: no limit.
    render_mode
        As for `WalkerEnv`. ``human`` shows the first walker.
    world
        As for `WalkerEnv`; or a sequence with one world per walker.

    Raises
    ------
    ValueError, TypeError, walker_sim.ConnectionError, walker_sim.ServerMismatch
        As `WalkerEnv`.
    """

    def __init__(
        self,
        env_id: str,
        num_envs: int = 1,
        *,
        transport: str = "inprocess",
        server: str = "/walker_sim",
        master_uri: str = "",
        timeout: float = 10.0,
        spin_us: int | None = None,
        num_threads: int = 0,
        batch_size: int = 0,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        world: AnyWorlds = None,
        **parameters: Any,
    ) -> None:
        self.closed = True  # if the constructor raises, close() has nothing to do
        env_id = without_namespace(env_id)
        parameters, camera = split_keywords(env_id, parameters)
        arguments.refuse_unknown(WalkerVectorEnv.__init__, env_id, parameters)
        self.render_mode = render_mode
        self.autoreset_mode = arguments.to_mode(autoreset_mode)
        if max_episode_steps is not None:
            parameters["max_episode_steps"] = 0 if max_episode_steps == -1 else max_episode_steps
        self.num_envs = arguments.to_count("num_envs", num_envs, 1)
        self._env_id = env_id
        worlds = to_worlds(env_id, world, self.num_envs)
        self._walkers = make_walkers(
            *(env_id, self.num_envs, self.autoreset_mode.name.lower(), parameters),
            ServerAddress(transport, server, master_uri, timeout, spin_us),
            arguments.to_count("num_threads", num_threads, 0),
            arguments.to_count("batch_size", batch_size, 0),
        )
        if world is not None:
            self._walkers.set_world([], worlds)
        specification = self._walkers.specification
        self._pictures = Pictures(env_id, parameters, render_mode, camera, specification["dt"])
        self.closed = False
        self.single_observation_space, self.single_action_space = spaces_of(specification)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {**metadata_of(specification), "autoreset_mode": self.autoreset_mode}
        self._info_names: list[str] = specification["info_names"]
        self._action_size = len(specification["action_low"])

    @property
    def dt(self) -> float:
        """Simulation time of one step [s]."""
        return float(self._walkers.specification["dt"])

    @property
    def num_threads(self) -> int:
        """In process: number of stepping threads, including the caller's."""
        return self._pool("num_threads").num_threads

    @property
    def batch_size(self) -> int:
        """In process: number of walkers that `recv` waits for."""
        return self._pool("batch_size").batch_size

    @property  # type: ignore[override]
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """In process: copies of the walkers' generators of terrain and noise, one per walker.

        Setting it copies the caller's generators into the walkers.
        """
        return self._pool("np_random").generators()

    @np_random.setter  # type: ignore[override]
    def np_random(self, value: Sequence[np.random.Generator]) -> None:
        pool = self._pool("np_random")
        if len(value) != self.num_envs:
            raise ValueError(f"np_random has {len(value)} generators; must have {self.num_envs}")
        pool.set_generators(value)

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """In process: the last seed of each generator; -1: unknown."""
        return self._pool("np_random_seed").seeds()

    @property
    def world(self) -> tuple[World, ...]:
        """The worlds of the walkers' resets to come, as `WalkerEnv.world`."""
        return self._walkers.worlds()

    def set_world(self, world: AnyWorlds, indices: ArrayLike | None = None) -> None:
        """Sets the worlds of walkers from each one's next reset on, also within an autoreset.

        Parameters
        ----------
        world
            One world for all of these walkers, as for `WalkerEnv.set_world`, or a sequence with one
            for each of them.
        indices
            Distinct indices of the walkers; None: all.

        Raises
        ------
        ValueError, TypeError
            If a walker cannot apply its world, or the number of worlds or an index is wrong. No
            world has changed.
        RuntimeError
            If one of the walkers is in flight, i.e. between `send` and `recv`.
        """
        self._require_open("set_world")
        environments = arguments.to_indices("indices", indices, self.num_envs)
        worlds = to_worlds(self._env_id, world, len(environments))
        if environments:  # the core takes none for all
            self._walkers.set_world(environments, worlds)

    def reset(
        self, *, seed: arguments.Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], Infos]:
        """Begins episodes.

        Parameters
        ----------
        seed
            The first walker's seed, from which the others' count upwards; or a sequence with one
            seed per walker, in which None lets the generator continue.
        options
            ``reset_mask``, shape (num_envs,), bool: the walkers to reset, by default all.
            ``world``: the world of these walkers' present and following episodes, or a sequence
            with one for each of all walkers, of which the others' are not applied. Other options
            are ignored, as by Gymnasium's walkers.

        Returns
        -------
        observations
            Shape (num_envs, observation size); for a walker that was not reset, its last one.
        infos
            Infos of the walkers that were reset. ``infos["world"]``, present if any of them has a
            world, has what they have drawn: arrays by name. ``infos["error"]`` is present only if
            an engine failed: that walker has no episode and its observation is zeros; the others
            are not affected. In ``next_step`` and ``same_step`` its next step is another reset; in
            ``disabled`` its next step raises `ResetNeeded`.

        Raises
        ------
        ValueError, TypeError, gymnasium.error.Error
            If the seeds, the mask or the worlds have the wrong size or type, a seed is negative, or
            a walker cannot apply its world. All states are unchanged.
        """
        self._require_open("reset")
        seeds = arguments.to_seeds(seed, self.num_envs)
        mask, listed = np.ones(self.num_envs, np.bool_), []  # an empty list: all
        if not isinstance(options, (Mapping, type(None))):
            raise TypeError(f"options = {_core.shown(options)}: must be a dictionary, or None")
        if options is not None and "reset_mask" in options:
            mask = arguments.to_mask(options["reset_mask"], self.num_envs)
            listed = np.flatnonzero(mask).tolist()
            seeds = [seeds[i] for i in listed] if seeds else []
        chosen = listed or [*range(self.num_envs)]
        worlds: list[World] = []
        if options is not None and "world" in options:
            worlds = to_worlds(self._env_id, options["world"], self.num_envs)
            if len(worlds) > 1:
                worlds = [worlds[i] for i in chosen]
        observations, info = self._walkers.reset(listed, seeds, worlds)
        if mask[0]:
            self._show_first(self._pictures.begin)
        infos = to_infos(self._info_names, info, mask)
        drawn = zip(chosen, self._walkers.episode_worlds(chosen))
        add_worlds(infos, self.num_envs, {i: values for i, values in drawn if values})
        add_errors(infos, mask, range(self.num_envs), self._walkers.reset_error)
        return observations, infos

    def step(self, actions: ArrayLike, env_id: ArrayLike | None = None) -> Outcome:
        """Advances n walkers by `dt`, or resets those whose autoreset is due.

        Parameters
        ----------
        actions
            Shape (n, action size), unitless, clipped to the bounds as Gymnasium clips them. Arrays,
            lists or tensors; contiguous float32 and float64 are not copied.
        env_id
            In process: indices of the n walkers to step; None: all. The others do not change. If
            `batch_size` is below `num_envs`, this is a `send` followed by a `recv`, as in EnvPool.

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            Shapes (n, observation size) and (n,), in the order of `env_id`, which is then in
            ``infos["env_id"]``. ``infos["world"]`` is present if this step has begun an episode in
            a world, as after `reset`. ``infos["error"]`` is present only if an engine had to end an
            episode or failed at an autoreset. After a failed autoreset the new episode has ended at
            once, its observation is zeros, and the next step is another reset. In ``same_step`` the
            error of an episode is in ``final_info``, that of the following reset in ``infos``.

        Raises
        ------
        walker_sim.InvalidAction
            If the actions have the wrong shape or a non-finite value. All states are unchanged.
        walker_sim.ResetNeeded
            If a walker has no running episode. All states are unchanged.
        ValueError, TypeError
            If an index is out of range or repeated. All states are unchanged.
        AttributeError
            If `env_id` is given over ROS.
        """
        self._require_open("step")
        if env_id is not None:
            return self._step_some(actions, env_id)
        batch = self._walkers.step(arguments.to_actions(actions, self.num_envs, self._action_size))
        return self._to_outcome(batch, range(self.num_envs))

    def async_reset(self, *, seed: arguments.Seeds = None) -> None:
        """In process: starts to reset all walkers and returns at once; `recv` returns their rows.
        `seed` is as for `reset`."""
        self._pool("async_reset").send_resets([], arguments.to_seeds(seed, self.num_envs))

    def send(self, actions: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """In process: starts to step n walkers and returns at once; `recv` returns their rows.

        Parameters
        ----------
        actions
            Shape (n, action size), as for `step`.
        env_ids
            Indices of the walkers, none of which is in flight, i.e. between `send` and `recv`;
            None: all.

        Raises
        ------
        walker_sim.InvalidAction, walker_sim.ResetNeeded, ValueError, TypeError
            As for `step`.
        RuntimeError
            If a walker is in flight. All states are unchanged.
        """
        pool = self._pool("send")
        environments = arguments.to_indices("env_ids", env_ids, self.num_envs)
        pool.send(arguments.to_actions(actions, len(environments), self._action_size), environments)

    def recv(self) -> Outcome:
        """In process: blocks until `batch_size` walkers in flight have arrived.

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            As for `step`, in the order of arrival; ``infos["env_id"]``, shape (batch_size,), has
            the walkers' indices.

        Raises
        ------
        RuntimeError
            If fewer walkers are in flight.
        """
        return self._to_outcome_of_some(*self._pool("recv").recv())

    def render(self) -> tuple[Picture, ...] | None:
        """Returns one picture per walker, as `WalkerEnv.render` does and with the same errors; None
        with ``human`` or without a render mode."""
        self._require_open("render")
        draw = self._walkers.drawer
        if self.render_mode is None:
            self._pictures.render(draw(0))  # warns
            return None
        if self.render_mode == "human":
            self._show_first(self._pictures.show)
            return None
        return tuple(cast(Picture, self._pictures.render(draw(i))) for i in range(self.num_envs))

    def get_state(self, indices: ArrayLike | None = None) -> list[bytes]:
        """In process: returns the whole states of the walkers `indices` (None: all), as
        `WalkerEnv.get_state` does. RuntimeError if one of them is in flight."""
        pool = self._pool("get_state")
        return pool.get_states(arguments.to_indices("indices", indices, self.num_envs))

    def set_state(self, states: Sequence[bytes], indices: ArrayLike | None = None) -> None:
        """In process: restores the states of walkers, to the bit and independently of their past.

        Parameters
        ----------
        states
            One state per walker, of any walkers with the same id, parameters and engine.
        indices
            Distinct indices of the walkers; None: all.

        Raises
        ------
        ValueError, TypeError
            If a state is of another kind of walker or is damaged. Names the walker and the
            difference. All states are unchanged.
        RuntimeError
            If walkers are in flight.
        """
        pool = self._pool("set_state")
        pool.set_states(arguments.to_indices("indices", indices, self.num_envs), states)

    def __copy__(self) -> WalkerVectorEnv:
        """Returns a deep copy: two environments must not drive the same walkers."""
        return copy.deepcopy(self)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Returns an attribute of each walker: ``np_random``, ``np_random_seed``, ``world``, its
        spaces, ``render_mode``, ``dt``, or a constant attribute of `walker_sim.WalkerEnv`."""
        if name in ("np_random", "np_random_seed", "world"):
            return tuple(getattr(self, name))
        shared = {
            "action_space": self.single_action_space,
            "dt": self.dt,
            "observation_space": self.single_observation_space,
            "render_mode": self.render_mode,
            **attributes_of(self._walkers.specification),
        }
        if name not in shared:
            raise AttributeError(
                f"{name}: the walkers have no such attribute; must be one of np_random, "
                f"np_random_seed, world, {', '.join(shared)}"
            )
        return (shared[name],) * self.num_envs

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """As `get_attr`: the walkers are not environment objects, so they have no methods."""
        if args or kwargs:
            raise AttributeError(f"{name}: the walkers have no methods that can be called")
        return self.get_attr(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets ``np_random``, the only settable attribute."""
        if name != "np_random":
            raise AttributeError(f"{name}: cannot be set; must be np_random")
        self.np_random = values

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the threads or closes the connection; closes the window, if any."""
        self._walkers.close()
        self._pictures.close()

    def _show_first(self, show: Callable[[Draw], None]) -> None:
        """Shows the first walker in the window, if any, unless its engine has failed."""
        if self.render_mode != "human" or self._walkers.reset_error(0):
            return
        if self.autoreset_mode is AutoresetMode.SAME_STEP or not self._walkers.error(0):
            show(self._walkers.drawer(0))

    def _require_open(self, call: str) -> None:
        if self.closed:
            raise ClosedEnvironmentError(f"{call}: this environment was closed")

    def _pool(self, name: str) -> InProcessWalkers:
        self._require_open(name)
        return self._walkers.pool(name)

    def _step_some(self, actions: ArrayLike, env_id: ArrayLike) -> Outcome:
        pool = self._pool("env_id")
        if pool.batch_size < self.num_envs:
            self.send(actions, env_id)
            return self.recv()
        environments = arguments.to_indices("env_id", env_id, self.num_envs)
        values = arguments.to_actions(actions, len(environments), self._action_size)
        return self._to_outcome_of_some(pool.step_some(values, environments), environments)

    def _to_outcome_of_some(self, batch: Batch, environments: list[int]) -> Outcome:
        """As `_to_outcome`, with ``infos["env_id"]``."""
        outcome = self._to_outcome(batch, environments)
        outcome[4]["env_id"] = np.array(environments, np.int32)
        return outcome

    def _to_outcome(self, batch: Batch, environments: Sequence[int]) -> Outcome:
        """Returns the result of `step` and `recv`; row i belongs to `environments[i]`."""
        infos = to_infos(self._info_names, batch.info)
        ended = batch.terminated | batch.truncated
        if np.count_nonzero(ended):
            self._add_ends(infos, ended, environments)
        add_worlds(infos, len(ended), self._walkers.drawn_worlds(environments))
        if 0 in environments:
            self._show_first(self._pictures.follow)
        return batch.observations, batch.rewards, batch.terminated, batch.truncated, infos

    def _add_ends(
        self, infos: Infos, ended: NDArray[np.bool_], environments: Sequence[int]
    ) -> None:
        """Adds final observations and infos, and the errors of steps and autoresets."""
        error, reset_error = self._walkers.error, self._walkers.reset_error
        if self.autoreset_mode is not AutoresetMode.SAME_STEP:
            add_errors(infos, ended, environments, lambda i: error(i) or reset_error(i))
            return
        observations, info = self._walkers.final_rows(len(ended))
        last = to_infos(self._info_names, info, ended)
        add_finals(infos, ended, observations, last)
        add_errors(last, ended, environments, error)
        add_errors(infos, ended, environments, reset_error)
