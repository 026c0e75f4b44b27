"""Walkers in this process."""

from __future__ import annotations

from typing import Any, Mapping, Sequence, cast

import numpy as np
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.rendering import Pictures
from walker_sim.walkers import Batch, Colors, Depths, State, Walkers
from walker_sim.worlds import World

GeneratorState = Sequence[int]
"""PCG64's state and increment, each as its high and low 64 bits; has_uint32; uinteger."""


def generator_state_of(random: np.random.Generator) -> GeneratorState:
    """Returns a NumPy generator's state in the core's format; ValueError if it is not on PCG64."""
    state: Mapping[str, Any] = random.bit_generator.state
    if state["bit_generator"] != "PCG64":
        raise ValueError(f"np_random uses {state['bit_generator']}; must use PCG64")
    high_value, value = divmod(state["state"]["state"], 1 << 64)
    high_increment, increment = divmod(state["state"]["inc"], 1 << 64)
    buffered = state["has_uint32"], state["uinteger"]
    return (high_value, value, high_increment, increment, *buffered)


def set_generator_state(random: np.random.Generator, state: GeneratorState) -> None:
    """Sets a NumPy generator on PCG64 to a state in the core's format."""
    random.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": state[0] << 64 | state[1], "inc": state[2] << 64 | state[3]},
        "has_uint32": state[4],
        "uinteger": state[5],
    }


def generator_of(state: GeneratorState) -> np.random.Generator | None:
    """Returns a generator in this state; None if it is all zeros: there is no generator yet."""
    if not any(state):
        return None
    random = np.random.default_rng(0)
    set_generator_state(random, state)
    return random


class InProcessWalkers(Walkers):
    """A pool in this process. Copies and pickles carry the whole states of its walkers."""

    def __init__(
        self,
        env_id: str,
        parameters: Mapping[str, Any],
        num_envs: int = 1,
        num_threads: int = 1,
        autoreset_mode: str = "disabled",
        batch_size: int = 0,
    ) -> None:
        self._pool = _core.Pool(
            env_id, dict(parameters), num_envs, num_threads, autoreset_mode, batch_size
        )
        super().__init__(self._pool.specification, num_envs)
        self.num_threads = self._pool.num_threads
        self.batch_size = self._pool.batch_size
        self._seeds: list[int | None] = [None] * num_envs

    @property
    def _driver(self) -> _core.Pool:
        return self._pool

    def reset(
        self, environments: list[int], seeds: Sequence[int | None], worlds: Sequence[World] = ()
    ) -> State:
        if worlds:
            self.set_world(environments, worlds)
        self._seed(environments, seeds)
        rows = self._new_rows(self.num_envs)
        self._pool.reset(environments, *rows)
        return rows

    def reset_single(
        self, seed: int | None, random: np.random.Generator, state: State, world: World | None
    ) -> None:
        """The caller has already seeded `random`."""
        if world is not None:
            self.set_world([0], [world])
        with random.bit_generator.lock:  # NumPy's own draws take it too
            generator, error = self._pool.reset_single(generator_state_of(random), *state)
            set_generator_state(random, generator)
        if error:
            raise RuntimeError(error)

    def render(self, environment: int, pictures: Pictures, rgb: Colors, depth: Depths) -> None:
        pictures.renderer.render(self.capture(environment), rgb, depth)

    def capture(self, environment: int) -> _core.StateCapture:
        """Returns what a picture of a walker shows, a copy of its present state."""
        return self._pool.capture(environment)

    def worlds(self) -> tuple[World, ...]:
        return tuple(map(self._pool.world, range(self.num_envs)))

    def push_trunk(self, environment: int, force_x: float, force_z: float) -> None:
        """Pushes a walker's trunk at its origin during its next step [N], also if called while
        paused. Replaces an earlier push in the same step. Saved states do not have it."""
        self._pool.push(environment, 0, force_x, force_z, 0.0)

    def step_some(self, actions: NDArray[Any], environments: list[int]) -> Batch:
        """Steps some walkers. Row i of `actions` and of the result belongs to `environments[i]`."""
        batch = self._new_batch(len(environments))
        self._pool.step_some(actions, environments, batch)
        return batch

    def send(self, actions: NDArray[Any], environments: list[int]) -> None:
        """Starts to step some walkers. Row i of `actions` belongs to `environments[i]`."""
        self._pool.send(actions, environments)

    def send_resets(self, environments: list[int], seeds: Sequence[int | None]) -> None:
        """Starts a `reset` of these walkers; `recv` returns their rows."""
        self._seed(environments, seeds)
        self._pool.send_resets(environments)

    def recv(self) -> tuple[Batch, list[int]]:
        """Blocks until `batch_size` walkers have arrived. Returns their rows and their indices."""
        batch = self._new_batch(self.batch_size)
        return batch, self._pool.recv(batch)

    def seeds(self) -> tuple[int | None, ...]:
        """Returns the last seed of each generator; -1 if unknown. Seeds those without one."""
        self._seed([], [])
        return tuple(self._seeds)

    def generators(self) -> tuple[np.random.Generator, ...]:
        """Returns copies of the environments' generators. Seeds those without a seed."""
        self._seed([], [])
        states = (self._pool.generator_state(index) for index in range(self.num_envs))
        return tuple(cast(np.random.Generator, generator_of(state)) for state in states)

    def set_generators(self, generators: Sequence[np.random.Generator]) -> None:
        """Sets the generators from which resets without a seed continue; one per environment."""
        states = dict(enumerate(map(generator_state_of, generators)))
        self._pool.set_generator_states(states)
        self._seeds = [-1] * self.num_envs

    def pool(self, name: str) -> InProcessWalkers:
        return self

    def get_states(self, environments: list[int]) -> list[bytes]:
        """Returns these walkers' whole states."""
        return self._pool.get_states(environments)

    def get_state(self, random: np.random.Generator | None) -> bytes:
        """The state has `random`, if given, as its generator."""
        return self._pool.get_state(None if random is None else generator_state_of(random))

    def set_state(self, state: bytes) -> np.random.Generator | None:
        return generator_of(self._pool.set_state(state))

    @property
    def is_healthy(self) -> bool:
        is_healthy = self._pool.is_healthy(0)
        if is_healthy is None:
            raise AttributeError(f"is_healthy: {self.specification['id']} has no such attribute")
        return is_healthy

    def set_states(self, environments: list[int], states: Sequence[bytes]) -> None:
        """Restores these walkers' states. On an error, no walker has changed."""
        is_one = isinstance(states, (bytes, str)) or not hasattr(states, "__len__")
        if is_one or len(states) != len(environments):
            given = "one state" if is_one else f"{len(states)} states"
            raise ValueError(
                f"{given}; must be a sequence of {len(environments)}, one for each walker"
            )
        self._pool.set_states(environments, states)
        for index in environments:
            has_generator = any(self._pool.generator_state(index))
            self._seeds[index] = -1 if has_generator else None

    def _seed(self, environments: list[int], seeds: Sequence[int | None]) -> None:
        """Seeds generators by Gymnasium's `np_random`, which also takes seeds beyond 64 bits.

        Without a seed, a generator continues, or is seeded from entropy if it never was.
        """
        chosen = environments or range(self.num_envs)
        fresh = {
            index: np_random(seed)
            for index, seed in zip(chosen, seeds or [None] * len(chosen))
            if seed is not None or self._seeds[index] is None
        }
        states = {index: generator_state_of(random) for index, (random, _) in fresh.items()}
        self._pool.set_generator_states(states)
        for index, (_, seed) in fresh.items():
            self._seeds[index] = seed

    def close(self) -> None:
        """Ends the pool's threads."""
        del self._pool
