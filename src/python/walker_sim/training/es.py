"""Evolution strategies and CMA-ES: training by whole episodes of many networks, without gradients.

docs/training.md has the mathematics and its sources.
"""

from __future__ import annotations

import importlib
import pickle
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.episode_player import make_player
from walker_sim.training.policy_file import NO_HISTORY, PolicyFile, to_bytes
from walker_sim.training.settings import ACTIVATION, LAYERS, Settings
from walker_sim.training.stage import Stage, Stopped

ADAM = (0.9, 0.99, 1e-8)  # decay of the mean, decay of the mean square, lower bound of its root
HIDDEN_SCALE = 0.3  # of what a linear policy becomes in tanh units, where they are nearly linear

Array = NDArray[np.float64]


class Evolution(Stage):
    """Training by ES or CMA-ES; see `Stage` for the parameters."""

    def __init__(self, env_id: str, settings: Settings, folder: Path, **keywords: Any) -> None:
        super().__init__(env_id, settings, folder, **keywords)
        settings = self.settings
        has_start = settings.start is not None or self.index > 0
        self._player = make_player(
            env_id, settings.parameters, self.num_threads, sums_observations=not has_start
        )
        specification = self._player.specification
        self._sums = np.zeros((3, len(specification["observation_low"])))  # 1, x, x^2
        self._template = self._first_policy(specification)
        self._network = _core.Policy.from_bytes("network", to_bytes(self._template))
        first = self._first = np.array(self._network.parameters)
        self._recent: deque[Array] = deque([first], maxlen=settings.average_updates)
        strategy = AdamStrategy if settings.algorithm == "es" else CmaStrategy
        self._optimiser: AdamStrategy | CmaStrategy = strategy(settings, first)
        self._steps, self._updates = 0, 0
        self._mean_return = float("nan")

    @property
    def steps(self) -> int:
        return self._steps

    @property
    def mean_return(self) -> float:
        return self._mean_return

    def learn(self) -> None:
        while not self.wants_to_stop:
            if self.steps >= self.next_evaluation:
                self.evaluate()
                self.save_checkpoint()
            if self.is_done:
                return
            before = pickle.dumps(self._state())
            try:
                self.update()
            except Stopped:
                self._set_state(pickle.loads(before))  # the update is repeated as if never begun
                raise
            self.report(self, None)

    def update(self) -> None:
        """Compares a population, and moves towards the better ones."""
        settings, progress = self.settings, min(self.steps / self.settings.steps, 1.0)
        # Each update has a generator of its own, so that a resumed training continues with it.
        random = np.random.default_rng([settings.seed, self.index, self._updates])
        candidates = self._optimiser.ask(random, progress)
        networks = [self._network.with_parameters(candidate) for candidate in candidates]
        is_common = settings.common_seeds or settings.algorithm == "cma"
        num_groups = 1 if is_common else len(candidates) // 2  # pairs with seeds of their own
        worlds, jobs = self.training_worlds, []
        for index in range(len(candidates)):
            group = self._updates * num_groups + index // 2 % num_groups
            for offset in range(settings.episodes):
                number = group * settings.episodes + offset
                jobs.append((index, self.first_seed + number, number % len(worlds)))
        episodes = self.play(self._player, networks, worlds, jobs)
        returns = np.array([episode.episode_return for episode in episodes])
        returns = returns.reshape(len(candidates), settings.episodes)
        worth = returns.mean(axis=1) - settings.deviation_weight * returns.std(axis=1)
        self._optimiser.tell(worth, progress)
        self._recent.append(self._optimiser.mean)
        self._steps += sum(episode.length for episode in episodes)
        self._updates += 1
        self._mean_return = float(returns.mean())
        if episodes[0].observation_sums:
            for episode in episodes:
                self._sums[0] += episode.length
                self._sums[1] += episode.observation_sums
                self._sums[2] += episode.observation_squares
            self._normalise()
        self.grow()

    def policy(self) -> PolicyFile:
        share, mean = self.settings.start_weight, np.mean(self._recent, axis=0)
        parameters = np.asarray(share * self._first + (1 - share) * mean, np.float32)
        layers, begin = [], 0
        for weight, bias in self._template.layers:
            middle, end = begin + weight.size, begin + weight.size + bias.size
            layers.append((parameters[begin:middle].reshape(weight.shape), parameters[middle:end]))
            begin = end
        self._template.layers, self._template.notes = layers, self.notes()
        return self._template

    def close(self) -> None:
        pass  # the player has no thread while it does not play

    def save(self, folder: Path) -> None:
        (folder / "evolution.pkl").write_bytes(pickle.dumps(self._state()))

    def load(self, folder: Path) -> None:
        self._set_state(pickle.loads((folder / "evolution.pkl").read_bytes()))

    def _state(self) -> dict[str, Any]:
        return {
            "optimiser": self._optimiser,
            "recent": list(self._recent),
            "first": self._first,
            "sums": self._sums,
            "template": self._template,
            "counts": (self._steps, self._updates, self._mean_return),
        }

    def _set_state(self, state: dict[str, Any]) -> None:
        self._optimiser, self._sums = state["optimiser"], state["sums"]
        self._optimiser.settings = self.settings
        self._first = state["first"]
        self._recent.clear()
        self._recent.extend(state["recent"])
        self._steps, self._updates, self._mean_return = state["counts"]
        self._template = state["template"]
        self._network = _core.Policy.from_bytes("network", to_bytes(self._template))

    def _first_policy(self, specification: dict[str, Any]) -> PolicyFile:
        settings = self.settings
        random = np.random.default_rng([settings.seed, self.index])
        low, high = (
            np.array(specification[f"action_{end}"], np.float32) for end in ("low", "high")
        )
        hidden = LAYERS if settings.layers is None else settings.layers
        start = self.read_start()
        history = (settings.history if start is None else start.history) or NO_HISTORY
        inputs = history[0] * self._sums.shape[1] + history[1] * len(low)
        sizes = [inputs, *hidden, len(low)]
        if start is not None:
            if settings.layers is not None:
                start.layers = _fitted(start, sizes, random)
            return start
        return PolicyFile(
            env_id=self.env_id,
            parameters=self.parameter_texts,
            activation=settings.activation or ACTIVATION,
            output="clip",
            mean=np.zeros(sizes[0]),
            deviation=np.ones(sizes[0]),
            low=low,
            high=high,
            layers=_fitted(None, sizes, random),
            history=history,
        )

    def _normalise(self) -> None:
        """Sets the mean and deviation of all observations so far."""
        count, total, squares = self._sums
        mean = total / count
        deviation = np.sqrt(np.maximum(squares / count - mean**2, 0) + 1e-8)
        num = self._template.history[0]
        for values, each in ((self._template.mean, mean), (self._template.deviation, deviation)):
            values[: num * len(each)] = np.tile(each, num)
        self._network = _core.Policy.from_bytes("network", to_bytes(self._template))


class AdamStrategy:
    """Evolution strategy with antithetic noise, ranks as fitness and Adam.

    Salimans et al. (2017), "Evolution Strategies as a Scalable Alternative to Reinforcement
    Learning", algorithm 2, section 2.1; the noise comes in pairs as in Mania et al. (2018).
    """

    def __init__(self, settings: Settings, first: Array) -> None:
        self.settings, self.mean = settings, first
        self._first_moment, self._second_moment = np.zeros_like(first), np.zeros_like(first)
        self._updates = 0
        self._noise = np.zeros((0, len(first)))

    def ask(self, random: np.random.Generator, progress: float) -> list[Array]:
        """Returns the networks of the next update: pairs of mean plus and minus a noise."""
        self._noise = random.standard_normal((self.settings.population // 2, len(self.mean)))
        noise = _between(self.settings.sigma, progress) * self._noise
        return [self.mean + sign * row for row in noise for sign in (1, -1)]

    def tell(self, worth: Array, progress: float) -> None:
        """Moves the mean, given what each network is worth."""
        differences = worth[::2] - worth[1::2]
        limit = self.settings.max_difference
        if limit is not None:
            shaped = np.clip(differences, -limit, limit)
            shaped /= np.sqrt(np.mean(shaped**2)) + 1e-8
        else:
            if not self.settings.common_seeds:  # a network can be compared within its pair only
                worth = np.stack([differences, -differences], axis=1).ravel()
            ranks = np.empty(len(worth))
            ranks[np.argsort(worth, kind="stable")] = np.arange(len(worth)) / (len(worth) - 1) - 0.5
            shaped = ranks[::2] - ranks[1::2]
        gradient = shaped @ self._noise / len(worth)
        gradient /= _between(self.settings.sigma, progress)
        self._noise = self._noise[:0]
        first, second, least = ADAM
        self._updates += 1
        self._first_moment = first * self._first_moment + (1 - first) * gradient
        self._second_moment = second * self._second_moment + (1 - second) * gradient**2
        mean = self._first_moment / (1 - first**self._updates)
        root = np.sqrt(self._second_moment / (1 - second**self._updates))
        rate = _between(self.settings.learning_rate, progress)
        self.mean = self.mean + rate * mean / (root + least)


class CmaStrategy:
    """CMA-ES of the package cma, for policies with few parameters."""

    def __init__(self, settings: Settings, first: Array) -> None:
        cma: Any = importlib.import_module("cma")
        self.settings = settings
        options = {
            "popsize": settings.population,
            "seed": settings.seed + 1,  # 0 would be the time
            "randn": self._draw,
            "verbose": -9,
        }
        self._strategy = cma.CMAEvolutionStrategy(first, settings.sigma[0], options)
        self._random = np.random.default_rng(0)
        self._candidates: list[Array] = []

    @property
    def mean(self) -> Array:
        return np.array(self._strategy.result.xfavorite)

    def ask(self, random: np.random.Generator, progress: float) -> list[Array]:
        self._random = random
        self._candidates = [np.array(candidate) for candidate in self._strategy.ask()]
        return self._candidates

    def tell(self, worth: Array, progress: float) -> None:
        self._strategy.tell(self._candidates, list(-worth))

    def _draw(self, *shape: int) -> Array:
        return self._random.standard_normal(shape)


def _fitted(
    start: PolicyFile | None, sizes: list[int], random: np.random.Generator
) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Returns layers of these sizes, from observation to action. They act as `start` does, which
    has layers of these sizes or is linear; without it, actions are zero."""
    if start is not None:
        own = [start.layers[0][0].shape[1], *(len(bias) for _, bias in start.layers)]
        if own == sizes:
            return start.layers
        if len(own) > 2 or len(sizes) != 3 or sizes[1] < sizes[2] or start.activation != "tanh":
            raise ValueError(
                f"layers = {sizes[1:-1]}: must be {own[1:-1]} as the policy to start from has "
                "them, or, if that is linear, one layer with at least a unit for each action"
            )
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        weight = random.standard_normal((outputs, inputs)) / np.sqrt(inputs)
        layers.append((weight.astype(np.float32), np.zeros(outputs, np.float32)))
    layers[-1][0][:] = 0
    if start is not None:
        # The first units compute the linear actions; the others do not act yet.
        (weight, bias), (last, _) = layers
        count = sizes[-1]
        weight[:count] = HIDDEN_SCALE * start.layers[0][0]
        bias[:count] = HIDDEN_SCALE * start.layers[0][1]
        last[:, :count] = np.eye(count) / HIDDEN_SCALE
    return layers


def _between(ends: tuple[float, float], progress: float) -> float:
    return ends[0] + (ends[1] - ends[0]) * progress
