"""What trainings of all algorithms have in common: evaluations, the best policy, the curve,
checkpoints and interruptions."""

from __future__ import annotations

import json
import shutil
import signal
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands.policies import shipped_policy
from walker_sim.episode_player import PlayedEpisode, make_player, play_jobs
from walker_sim.errors import UnknownKeyword
from walker_sim.files import remove_unfinished, replace_file
from walker_sim.training.curriculum import Curriculum
from walker_sim.training.curve import Point, draw_curve, read_curve, write_curve
from walker_sim.training.mixture import Part, in_turn, text_of
from walker_sim.training.policy_file import (
    PolicyFile,
    read_policy,
    to_bytes,
    with_history,
    with_lidar,
    write_policy,
)
from walker_sim.training.settings import Settings
from walker_sim.training.settings_file import read_settings, write_settings
from walker_sim.walkers import LIDAR_RAYS, has_lidar
from walker_sim.worlds import World

POLICY, SETTINGS, CHECKPOINT = "policy.safetensors", "settings.yaml", "checkpoint"
STATE = "state.json"  # in the checkpoint
SLOTS = ("a", "b")
"""Folders of the checkpoint with the learner's files. STATE names the one that is in use."""
EARLIER = (f"{CHECKPOINT}.new", f"{CHECKPOINT}.old")
"""Complete copies that are left if a version without slots was killed between two renames."""
CURVE, PICTURE = "curve.csv", "curve.png"
FIRST_CHOICE_SEED = 2_000_000
"""First seed of the episodes that decide which policy is kept. Those of the model cards in
docs/policies begin at 1000000."""
FIRST_TRIAL_SEED = 1 << 39
"""First seed of the episodes that decide whether a curriculum's ranges grow."""
FIRST_TRAINING_SEED = 1 << 40
"""Lower bound of training seeds, far from those on which policies are chosen and evaluated."""


class Stopped(Exception):
    """A signal has stopped the training while it played episodes, which are dropped."""


class Stage(ABC):
    """One stage of the training of a policy, with its files in one folder.

    Parameters
    ----------
    env_id, settings
        Environment and settings of the training.
    folder
        Existing folder for policy.safetensors (the best policy on the evaluation's seeds),
        settings.yaml, curve.csv, curve.png and the checkpoint.
    index
        Index of the stage. Its steps, its curve and its best policy continue those of the stages
        before it, which have been completed in the same folder.
    num_threads
        Number of threads that step walkers, and that learn with PPO; 0: one per processor. Results
        do not depend on it.
    report
        Called with the training and None after each update, with the training and the new point
        after each evaluation.
    """

    def __init__(
        self,
        env_id: str,
        settings: Settings,
        folder: Path,
        *,
        index: int = 0,
        num_threads: int = 0,
        report: Callable[[Stage, Point | None], None] = lambda training, point: None,
    ) -> None:
        self.env_id, self.whole, self.folder, self.report = env_id, settings, folder, report
        self.index, self.settings = index, settings.stage(index)
        # VecEnv would take its own keywords and the camera's for parameters of the environment.
        known = [parameter["name"] for parameter in _core.parameters_of(env_id)]
        for name in self.settings.parameters:
            if name not in known:
                raise UnknownKeyword(f"parameter {name}: unknown; must be one of {' '.join(known)}")
        self.points: list[Point] = []
        self.best = -np.inf
        self.wants_to_stop = False
        self._is_playing = False
        self._slot = ""  # of the checkpoint; empty: there is none, or its files are beside STATE
        # All stages are compared by the same episodes: those of what the training aims at.
        self.goal = settings.stage(settings.num_stages - 1)
        curricula: list[Curriculum | None] = []
        for each in map(settings.stage, range(index, settings.num_stages)):
            # A mistake in a later stage is reported now, not after hours.
            walker = _core.Pool(env_id, dict(each.parameters))
            for part in each.mixture:
                try:
                    walker.set_world([], [part.world])
                except ValueError as error:
                    raise ValueError(f"{part.name}: {error}" if part.name else error) from error
            world, growth = each.mixture[0].world, each.curriculum
            curricula.append(Curriculum(env_id, each.parameters, world, growth) if growth else None)
            if each.start is not None:
                self._read(each.start, each)
        self.curriculum = curricula[0]
        # With reuse_world an episode would depend on the ones before it.
        own = {name: value for name, value in self.goal.parameters.items() if name != "reuse_world"}
        self._evaluator = make_player(env_id, own, num_threads)
        self._trials = 0
        self.num_threads = num_threads
        self._steps_before = 0
        self._began = 0.0
        self._evaluating = 0.0  # time spent evaluating, minus the checkpoint's `seconds` [s]
        if index > 0:
            state = read_state(folder)
            self._continue(state)
            self._steps_before = state["steps"]
            self.best = -np.inf  # `run` evaluates the policy until here

    @property
    @abstractmethod
    def steps(self) -> int:
        """Number of steps of all walkers in this stage so far."""

    @property
    @abstractmethod
    def mean_return(self) -> float:
        """Mean return of the latest training episodes; NaN before the first has ended."""

    @abstractmethod
    def policy(self) -> PolicyFile:
        """Returns the policy to evaluate."""

    @abstractmethod
    def learn(self) -> None:
        """Learns until the last step or `wants_to_stop`. Calls `report`, `evaluate` and
        `save_checkpoint`."""

    @abstractmethod
    def save(self, folder: Path) -> None:
        """Saves the learner's state."""

    @abstractmethod
    def load(self, folder: Path) -> None:
        """Restores the state of `save`."""

    @property
    def first_seed(self) -> int:
        """The first seed of the stage's training episodes."""
        return FIRST_TRAINING_SEED + (self.settings.seed << 20) + (self.index << 36)

    @property
    def next_evaluation(self) -> int:
        """The number of this stage's steps at which the next evaluation is due."""
        every, evaluated = self.settings.evaluate_every, 0
        if self.points:
            evaluated = max(self.points[-1].steps - self._steps_before, 0)
        return (evaluated // every + 1) * every

    @property
    def all_steps(self) -> int:
        """The steps of this and of all earlier stages."""
        return self._steps_before + self.steps

    @property
    def seconds(self) -> float:
        """Wall time of the training, without evaluations and interruptions [s]."""
        return time.monotonic() - self._began - self._evaluating

    @property
    def is_done(self) -> bool:
        return self.steps >= self.settings.steps

    @property
    def is_complete(self) -> bool:
        """Whether the policy after the last step has been evaluated."""
        return self.is_done and bool(self.points) and self.points[-1].steps == self.all_steps

    @property
    def mixture(self) -> list[Part]:
        """The worlds of the stage at present, with the share of each in the training."""
        if self.curriculum:
            return [Part("", self.curriculum.world, 1)]
        return self.settings.mixture

    @property
    def training_worlds(self) -> list[World]:
        """The worlds of training episodes, in turn."""
        return self.curriculum.training_worlds if self.curriculum else in_turn(self.mixture)

    @property
    def parameter_texts(self) -> dict[str, str]:
        """The environment's parameters that the training aims at, for the policy's file."""
        return {name: str(value) for name, value in self.goal.parameters.items()}

    def notes(self) -> dict[str, str]:
        """Returns the metadata of the policy."""
        world = text_of(self.mixture)
        return {
            "algorithm": self.settings.algorithm,
            "steps": str(self.all_steps),
            "seed": str(self.settings.seed),
            "settings": self.whole.hash(),
            **({"world": world} if world != "{}" else {}),
        }

    def resume(self) -> None:
        """Restores the folder's checkpoint; OSError if none. Walkers begin new episodes."""
        state = read_state(self.folder)
        self._continue(state)
        self._steps_before = state["steps_before"]
        if self.curriculum:
            self.curriculum.moves, self._trials = state["moves"], state["trials"]
        self.load(checkpoint_of(self.folder) / self._slot)

    def _continue(self, state: dict[str, Any]) -> None:
        points = read_curve(self.folder / CURVE) if (self.folder / CURVE).exists() else []
        # A training that is killed after an evaluation and before its checkpoint repeats it.
        count = state.get("points", len(points))
        self.points = points[:count]
        # The policy of such an evaluation may have been kept.
        self.best = max([state["best"], *map(self._worth, points[count:])])
        self._evaluating = -state["seconds"]
        self._slot = state["files"] if state.get("files") in SLOTS else ""

    def run(self) -> None:
        """Learns until the last step, `wants_to_stop`, SIGINT or SIGTERM; saves a checkpoint."""
        self._began = time.monotonic()
        for name in (POLICY, SETTINGS, CURVE, PICTURE):
            remove_unfinished(self.folder / name)
        file = self.folder / SETTINGS
        if not file.exists() or read_settings(file) != self.whole:
            write_settings(self.whole, file)
        handlers = {
            number: signal.signal(number, self._stop_soon)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        try:
            self._run()
            self.save_checkpoint()
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)

    def _run(self) -> None:
        try:
            if self.best == -np.inf and (self.index > 0 or self.settings.start is not None):
                self.evaluate()  # the policy to start from is the best so far
                self.save_checkpoint()
            if not self.is_done and not self.wants_to_stop:
                self.learn()
            if self.is_done and not self.is_complete:
                self.evaluate()
        except Stopped:
            pass  # the checkpoint continues before the dropped episodes

    @abstractmethod
    def close(self) -> None:
        """Ends what the learner has begun."""

    def evaluate(self) -> None:
        """Adds a point to the curve; saves the policy if it is the best so far."""
        began = time.monotonic()
        seconds = self.seconds
        policy, parts = self.policy(), self.goal.mixture
        worlds, episodes = [part.world for part in parts], self.settings.evaluation_episodes
        returns = self._returns(policy, worlds, FIRST_CHOICE_SEED, episodes)
        outcome = (float(returns.mean()), float(returns.std()), float(returns.min()))
        means = {part.name: float(mean) for part, mean in zip(parts, returns.mean(axis=1))}
        means = means if len(parts) > 1 else {}
        world = text_of(self.mixture)
        point = Point(self.all_steps, seconds, self.mean_return, *outcome, world, means)
        self.points.append(point)
        if self._worth(point) > self.best:
            self.best = self._worth(point)
            if self.steps > 0 or self.index == 0:  # else it is the stage's before, with its notes
                write_policy(policy, self.folder / POLICY)
        write_curve(self.points, self.folder / CURVE)
        title = f"{self.env_id}, {self.settings.algorithm.upper()}, seed {self.settings.seed}"
        draw_curve(self.points, title, self.folder / PICTURE)
        self._evaluating += time.monotonic() - began
        self.report(self, point)

    def grow(self) -> bool:
        """Tries one end of the curriculum's ranges. Returns whether they have changed."""
        if not self.curriculum:
            return False
        before = self.curriculum.world
        episodes = self.curriculum.episodes
        returns = self._returns(
            self.policy(),
            [self.curriculum.trial(self._trials)],
            FIRST_TRIAL_SEED + self._trials * episodes,
            episodes,
        )
        self.curriculum.take(self._trials, float(returns.mean()))
        self._trials += 1
        return self.curriculum.world != before

    def read_start(self) -> PolicyFile | None:
        """Reads the policy to start from: the settings', or that of the stage before. Returns None
        if the training begins with a new network. ValueError if the policy does not fit."""
        if self.settings.start is None and self.index == 0:
            return None
        return self._read(self.settings.start or self.folder / POLICY, self.settings)

    def _read(self, start: str | Path, settings: Settings) -> PolicyFile:
        own = self.env_id if start == "shipped" else start
        policy = read_policy(shipped_policy(str(own)) if own in _core.ids() else Path(own))
        if has_lidar(self.goal.parameters) and not has_lidar(policy.parameters):
            policy = with_lidar(policy, LIDAR_RAYS)
        _core.Policy.from_bytes("start", to_bytes(policy)).check(
            self.env_id, dict(self.goal.parameters)
        )
        if settings.activation not in (None, policy.activation):
            raise ValueError(
                f"activation = {settings.activation!r}: must be {policy.activation!r} as the "
                "policy to start from has it"
            )
        policy.env_id, policy.parameters = self.env_id, self.parameter_texts
        return with_history(policy, settings.history or policy.history)

    def _worth(self, point: Point) -> float:
        """Returns the number of an evaluation by which the best policy is chosen."""
        if self.settings.keep_best_by == "min" and point.means:
            return min(point.means.values())
        return point.evaluation_return

    def _returns(
        self, policy: PolicyFile, worlds: list[World], first_seed: int, episodes: int
    ) -> NDArray[np.float64]:
        """Returns the return of each episode, played without exploration, a row for each world."""
        network = _core.Policy.from_bytes(f"after {self.all_steps} steps", to_bytes(policy))
        jobs = [
            (0, first_seed + index, world)
            for world in range(len(worlds))
            for index in range(episodes)
        ]
        played = self.play(self._evaluator, [network], worlds, jobs)
        returns = np.array([episode.episode_return for episode in played])
        return returns.reshape(len(worlds), episodes)

    def play(self, *arguments: Any) -> list[PlayedEpisode]:
        """Plays episodes as `play_jobs`; Stopped once a signal has stopped the training."""
        self._is_playing = True
        try:
            if self.wants_to_stop:
                raise Stopped
            return play_jobs(*arguments)
        finally:
            self._is_playing = False

    def save_checkpoint(self) -> None:
        """Saves the state for `resume`. The old checkpoint stays until this one is complete."""
        folder = self.folder / CHECKPOINT
        slot = SLOTS[self._slot == SLOTS[0]]
        shutil.rmtree(folder / slot, ignore_errors=True)  # incomplete if a training was killed
        (folder / slot).mkdir(parents=True)
        self.save(folder / slot)
        state = {
            "id": self.env_id,
            "stage": self.index,
            "is_done": self.is_complete,
            "steps": self.all_steps,
            "steps_before": self._steps_before,
            "seconds": self.seconds,
            "best": self.best,
            "points": len(self.points),
            "files": slot,
            **({"moves": self.curriculum.moves, "trials": self._trials} if self.curriculum else {}),
        }
        replace_file(folder / STATE, (json.dumps(state, indent=1) + "\n").encode())
        remove_unfinished(folder / STATE)
        if self._slot:
            shutil.rmtree(folder / self._slot, ignore_errors=True)
        self._slot = slot

    def _stop_soon(self, *_: object) -> None:
        self.wants_to_stop = True
        if self._is_playing:
            # `play` may be ending: a second signal must not end `save_checkpoint`.
            self._is_playing = False
            raise Stopped


def checkpoint_of(folder: Path) -> Path:
    """Returns the folder of a training's checkpoint, whether or not it exists."""
    for name in (CHECKPOINT, *EARLIER):
        if (folder / name / STATE).exists():
            return folder / name
    return folder / CHECKPOINT


def read_state(folder: Path) -> dict[str, Any]:
    """Returns the state of a training's checkpoint: id, stage, steps, best return. OSError if the
    file is missing."""
    text = (checkpoint_of(folder) / STATE).read_text(encoding="utf-8")
    state: dict[str, Any] = json.loads(text)
    return state
