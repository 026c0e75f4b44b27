"""Many walkers as a Gymnasium vector environment."""

from __future__ import annotations

import copy
from typing import Any, Callable, Mapping, Sequence, Tuple

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from walker_sim import _core
from walker_sim.actions import to_actions
from walker_sim.attributes import attributes_of
from walker_sim.in_process import InProcessWalkers
from walker_sim.keywords import refuse_unknown, to_count, to_indices
from walker_sim.registration import without_namespace
from walker_sim.rendering import (
    Draw,
    Picture,
    Pictures,
    metadata_of,
    split_keywords,
    warn_of_no_mode,
)
from walker_sim.transport import Batch, Place, make_walkers, spaces_of
from walker_sim.vector_arguments import (
    AutoresetMode,
    Seeds,
    checked_mask,
    to_mode,
    to_seeds,
)
from walker_sim.vector_infos import Infos, add_errors, add_finals, to_infos

Outcome = Tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], Infos]
"""Observations, rewards, terminated, truncated, infos."""


class WalkerVectorEnv(VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """As many walkers as one likes, stepped together by threads, in Gymnasium's terms.

    What it gives is what Gymnasium's ``SyncVectorEnv`` of as many single walkers gives, to the bit.
    All arrays are new: the caller may keep and change them. Copies and pickles carry the whole
    states of all walkers, as `get_state` does.

    Parameters
    ----------
    env_id
        As Gymnasium has it, e.g. ``BipedalWalker-v3``, with or without ``walker_sim/`` before it.
        ``gymnasium.make_vec`` fills it in.
    num_envs
        How many walkers, at least 1.
    transport
        ``inprocess``, or ``ros``: a server in lock-step on a ROS master.
    server
        Over ROS: the server's node name.
    master_uri
        Over ROS: empty stands for ``ROS_MASTER_URI``, or ``http://localhost:11311``.
    timeout
        Over ROS: of each call [s of wall time].
    num_threads
        In process, the caller's among them; 0: one for each processor. Results do not depend on it.
    batch_size
        In process: how many walkers `recv` waits for; 0: all.
    autoreset_mode
        ``next_step``, ``same_step`` or ``disabled``, or Gymnasium's enumeration.
    max_episode_steps
        On which step an episode is truncated; None: the id's own limit; -1 or 0: never.
    render_mode
        As `WalkerEnv`. ``human`` shows the first walker.
    parameters
        The environment's own and its camera's, as `WalkerEnv`.

    Raises
    ------
    ValueError, TypeError
        Naming the parameter, its value and what is allowed.
    walker_sim.ConnectionError, walker_sim.ServerMismatch
        Over ROS.
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
        num_threads: int = 0,
        batch_size: int = 0,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        self.closed = True  # until there is something to close
        env_id = without_namespace(env_id)
        parameters, camera = split_keywords(env_id, parameters)
        refuse_unknown(WalkerVectorEnv.__init__, env_id, parameters)
        self.render_mode = render_mode
        self.autoreset_mode = to_mode(autoreset_mode)
        if max_episode_steps is not None:
            parameters["max_episode_steps"] = 0 if max_episode_steps == -1 else max_episode_steps
        self.num_envs = to_count("num_envs", num_envs, 1)
        self._walkers = make_walkers(
            *(env_id, self.num_envs, self.autoreset_mode.name.lower(), parameters),
            Place(transport, server, master_uri, timeout),
            to_count("num_threads", num_threads, 0),
            to_count("batch_size", batch_size, 0),
        )
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
        """In process: those that step, the caller's among them."""
        return self._pool("num_threads").num_threads

    @property
    def batch_size(self) -> int:
        """In process: how many walkers `recv` waits for."""
        return self._pool("batch_size").batch_size

    @property  # type: ignore[override]
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """In process: copies of the generators that terrain and noise come from, one for each
        walker. Setting it puts generators of the caller's in their place, also as copies."""
        return self._pool("np_random").generators()

    @np_random.setter  # type: ignore[override]
    def np_random(self, value: Sequence[np.random.Generator]) -> None:
        pool = self._pool("np_random")
        if len(value) != self.num_envs:
            raise ValueError(f"np_random has {len(value)} generators; must have {self.num_envs}")
        pool.set_generators(value)

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """In process: what the generators were last seeded with; -1: not known."""
        return self._pool("np_random_seed").seeds()

    def reset(
        self, *, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], Infos]:
        """Begins episodes.

        Parameters
        ----------
        seed
            Of the first walker, the others' being the next numbers; or one for each, None where the
            generator is to continue.
        options
            ``reset_mask``, shape (num_envs,), bool: the walkers that are reset, by default all.
            Others are ignored, as Gymnasium's walkers do.

        Returns
        -------
        observations
            Shape (num_envs, observation size); of a walker that is not reset its last one.
        infos
            Of those that are reset. ``infos["error"]`` only where the engine failed: that walker
            has no episode and an observation of zeros, the others are as ever. In ``next_step`` and
            ``same_step`` its next step is its next reset, in ``disabled`` a step is refused.

        Raises
        ------
        ValueError, TypeError, gymnasium.error.Error
            For seeds or a mask of the wrong size or type. Nothing has moved.
        """
        self._need_open("reset")
        seeds = to_seeds(seed, self.num_envs)
        mask, chosen = np.ones(self.num_envs, np.bool_), []
        if not isinstance(options, (Mapping, type(None))):
            raise TypeError(f"options = {_core.shown(options)}: must be a dictionary, or None")
        if options is not None and "reset_mask" in options:
            mask = checked_mask(options["reset_mask"], self.num_envs)
            chosen = np.flatnonzero(mask).tolist()
            seeds = [seeds[i] for i in chosen] if seeds else []
        observations, info = self._walkers.reset(chosen, seeds)
        if mask[0]:
            self._show_first(self._pictures.begin)
        infos = to_infos(self._info_names, info, mask)
        add_errors(infos, mask, self._walkers.reset_error)
        return observations, infos

    def step(self, actions: ArrayLike, env_id: ArrayLike | None = None) -> Outcome:
        """Advances all walkers by `dt`, or some; resets those of them whose autoreset is due.

        Parameters
        ----------
        actions
            Shape (number of these, action size), unitless; beyond the bounds limited as Gymnasium
            limits them. Arrays, lists, tensors: float32 and float64 are read where they are.
        env_id
            In process: which, numbers from 0; None: all. The others stay as they are. With a
            `batch_size` below `num_envs` it is, as in EnvPool, a `send` of these and a `recv` of
            those that arrive first.

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            Shapes (number of these, observation size) and (number of these,), in the order of
            `env_id`, which is ``infos["env_id"]`` then. ``infos["error"]`` only where the
            simulation had to end an episode, or failed at an autoreset: then the new episode has
            ended at once, with an observation of zeros, and the next step is another reset. In
            ``same_step`` the error of an episode stands in ``final_info``, that of the reset after
            it here.

        Raises
        ------
        walker_sim.InvalidAction
            For a wrong shape, or a value that is not finite. Nothing has moved.
        walker_sim.ResetNeeded
            Where a walker has no running episode. Nothing has moved.
        ValueError, TypeError, AttributeError
            For a walker that is none or listed twice, and for `env_id` over ROS. Nothing has moved.
        """
        self._need_open("step")
        if env_id is not None:
            return self._step_some(actions, env_id)
        batch = self._walkers.step(to_actions(actions, self.num_envs, self._action_size))
        return self._to_outcome(batch, range(self.num_envs))

    def async_reset(self, *, seed: Seeds = None) -> None:
        """In process: begins to reset all walkers and returns at once; `recv` gives their rows.

        Parameters
        ----------
        seed
            As `reset`.
        """
        self._pool("async_reset").send_resets([], to_seeds(seed, self.num_envs))

    def send(self, actions: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """In process: begins to step some walkers and returns at once; `recv` gives their rows.

        Parameters
        ----------
        actions
            Shape (number of these, action size), as for `step`.
        env_ids
            Which, numbers from 0, none of them under way; None: all.

        Raises
        ------
        walker_sim.InvalidAction, walker_sim.ResetNeeded
            As `step`.
        ValueError, TypeError, RuntimeError
            For a walker that is none, listed twice, or under way. Nothing has moved.
        """
        pool = self._pool("send")
        environments = to_indices("env_ids", env_ids, self.num_envs)
        pool.send(to_actions(actions, len(environments), self._action_size), environments)

    def recv(self) -> Outcome:
        """In process: waits for as many walkers as `batch_size`, those that arrive first.

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            As `step`, in the order of arrival; ``infos["env_id"]``, shape (batch_size,), says whose
            rows these are.

        Raises
        ------
        RuntimeError
            When fewer are under way.
        """
        return self._to_outcome_of(*self._pool("recv").recv())

    def render(self) -> tuple[Picture, ...] | None:
        """Draws what the walkers show now, one after the other.

        Returns
        -------
        A picture of each as `WalkerEnv.render` gives it; None with ``human`` and without a mode.

        Raises
        ------
        walker_sim.ResetNeeded, gymnasium.error.DependencyNotInstalled, RuntimeError
            As `WalkerEnv.render`.
        """
        self._need_open("render")
        if self.render_mode is None:
            warn_of_no_mode(self.spec.id if self.spec else self._walkers.specification["id"])
            return None
        if self.render_mode == "human":
            self._show_first(self._pictures.show)
            return None
        return tuple(self._pictures.take(self._walkers.drawer(i)) for i in range(self.num_envs))

    def get_state(self, indices: ArrayLike | None = None) -> list[bytes]:
        """In process: the whole states of walkers, each as `WalkerEnv.get_state` gives it.

        Parameters
        ----------
        indices
            Which, numbers from 0; None: all.

        Raises
        ------
        RuntimeError
            For a walker that is under way.
        """
        pool = self._pool("get_state")
        return pool.get_states(to_indices("indices", indices, self.num_envs))

    def set_state(self, states: Sequence[bytes], indices: ArrayLike | None = None) -> None:
        """In process: walkers go on from states, to the bit, whatever went before.

        Parameters
        ----------
        states
            One for each, of any walkers of the same id, parameters and engine.
        indices
            Which walkers, numbers from 0, each once; None: all.

        Raises
        ------
        ValueError, TypeError
            Naming the walker and what its state is of instead, or what of it is damaged. Nothing
            has changed.
        RuntimeError
            While some are under way.
        """
        pool = self._pool("set_state")
        pool.set_states(to_indices("indices", indices, self.num_envs), states)

    def __copy__(self) -> WalkerVectorEnv:
        """As `copy.deepcopy`: two environments must not drive the same walkers."""
        return copy.deepcopy(self)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """What each walker has as a single environment: ``np_random``, ``np_random_seed``, its
        spaces, ``render_mode``, ``dt``, and of `walker_sim.WalkerEnv` what never changes."""
        if name in ("np_random", "np_random_seed"):
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
                f"np_random_seed, {', '.join(shared)}"
            )
        return (shared[name],) * self.num_envs

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """As `get_attr`: there are no environment objects whose methods could be called."""
        if args or kwargs:
            raise AttributeError(f"{name}: the walkers have no methods that can be called")
        return self.get_attr(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets ``np_random``, which is all that can be set."""
        if name != "np_random":
            raise AttributeError(f"{name}: cannot be set; must be np_random")
        self.np_random = values

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the threads, or lets go of the connection; closes the window, if there is one."""
        self._walkers.close()
        self._pictures.close()

    def _show_first(self, show: Callable[[Draw], None]) -> None:
        """In the window, if there is one, unless the engine has failed and there is nothing."""
        if self.render_mode != "human" or self._walkers.reset_error(0):
            return
        if self.autoreset_mode is AutoresetMode.SAME_STEP or not self._walkers.error(0):
            show(self._walkers.drawer(0))

    def _need_open(self, call: str) -> None:
        if self.closed:
            raise ClosedEnvironmentError(f"{call}: this environment was closed")

    def _pool(self, name: str) -> InProcessWalkers:
        """The walkers, for what only those in this process have."""
        self._need_open(name)
        return self._walkers.pool(name)

    def _step_some(self, actions: ArrayLike, env_id: ArrayLike) -> Outcome:
        pool = self._pool("env_id")
        if pool.batch_size < self.num_envs:
            self.send(actions, env_id)
            return self.recv()
        environments = to_indices("env_id", env_id, self.num_envs)
        batch = pool.step_some(
            to_actions(actions, len(environments), self._action_size), environments
        )
        return self._to_outcome_of(batch, environments)

    def _to_outcome_of(self, batch: Batch, environments: list[int]) -> Outcome:
        """With whose rows these are in the infos."""
        outcome = self._to_outcome(batch, environments)
        outcome[4]["env_id"] = np.array(environments, np.int32)
        return outcome

    def _to_outcome(self, batch: Batch, environments: Sequence[int]) -> Outcome:
        """What `step` and `recv` return. `environments`: whose rows these are."""
        infos = to_infos(self._info_names, batch.info)
        ended = batch.terminated | batch.truncated
        if np.count_nonzero(ended):
            self._add_ends(infos, ended, environments)
        if 0 in environments:
            self._show_first(self._pictures.follow)
        return batch.observations, batch.rewards, batch.terminated, batch.truncated, infos

    def _add_ends(
        self, infos: Infos, ended: NDArray[np.bool_], environments: Sequence[int]
    ) -> None:
        """What is said where an episode has ended, in the infos of its last step, and where the
        next could not begin."""

        def error(row: int) -> str:
            return self._walkers.error(environments[row])

        def reset_error(row: int) -> str:
            return self._walkers.reset_error(environments[row])

        if self.autoreset_mode is not AutoresetMode.SAME_STEP:
            add_errors(infos, ended, lambda row: error(row) or reset_error(row))
            return
        observations, info = self._walkers.final_rows(len(ended))
        last = to_infos(self._info_names, info, ended)
        add_finals(infos, ended, observations, last)
        add_errors(last, ended, error)
        add_errors(infos, ended, reset_error)
