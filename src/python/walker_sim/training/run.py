"""One training: learns, evaluates, keeps the best policy, saves checkpoints and resumes."""

from __future__ import annotations

import json
import shutil
import signal
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from walker_sim import _core
from walker_sim.training import learner
from walker_sim.training.average import Average
from walker_sim.training.curve import Point, draw_curve, read_curve, write_curve
from walker_sim.training.evaluation import Evaluation
from walker_sim.training.policy_file import to_bytes, write_policy
from walker_sim.training.settings import Settings, write_settings
from walker_sim.training.walkers import GymnasiumSource, NormalizedVecEnv, PoolSource, Source

POLICY, SETTINGS, CHECKPOINT = "policy.safetensors", "settings.yaml", "checkpoint"
CURVE, PICTURE = "curve.csv", "curve.png"


class Training:
    """Training of one policy, with its files in one folder.

    Parameters
    ----------
    env_id, settings
        Environment and settings of the training.
    folder
        Existing folder for policy.safetensors (the best policy on the evaluation's seeds),
        settings.yaml, curve.csv, curve.png and the checkpoint.
    num_threads
        Number of threads that step walkers; 0: one per processor. Results do not depend on it.
    environments
        ``walker_sim``, or ``gymnasium``: Gymnasium's own in a DummyVecEnv, for comparison.
    report
        Called with the training and None after each rollout, with the training and the new point
        after each evaluation.
    """

    def __init__(
        self,
        env_id: str,
        settings: Settings,
        folder: Path,
        *,
        num_threads: int = 0,
        environments: str = "walker_sim",
        report: Callable[[Training, Point | None], None] = lambda training, point: None,
    ) -> None:
        self.env_id, self.settings, self.folder, self.report = env_id, settings, folder, report
        source: Source = (
            PoolSource(env_id, settings, num_threads)
            if environments == "walker_sim"
            else GymnasiumSource(env_id, settings)
        )
        self.walkers = NormalizedVecEnv(source, settings)
        self.model = learner.make_learner(settings, self.walkers)
        self.average = Average(settings.average_updates)
        self.points: list[Point] = []
        self.best = -np.inf
        self.wants_to_stop = False
        self._evaluation = Evaluation(
            env_id, settings.parameters, settings.evaluation_episodes, num_threads
        )
        self._began = 0.0
        self._evaluating = 0.0  # time spent evaluating, minus the checkpoint's `seconds` [s]

    @property
    def steps(self) -> int:
        """Number of steps of all walkers so far."""
        return int(self.model.num_timesteps)

    @property
    def seconds(self) -> float:
        """Wall time of the training, without evaluations and interruptions [s]."""
        return time.monotonic() - self._began - self._evaluating

    @property
    def is_done(self) -> bool:
        return self.steps >= self.settings.steps

    def resume(self) -> None:
        """Restores the folder's checkpoint; OSError if none. Walkers begin new episodes."""
        folder = self.folder / CHECKPOINT
        state = json.loads((folder / "state.json").read_text())
        learner.load_model(self.model, folder)
        with np.load(folder / "statistics.npz") as file:
            for name in ("observation_statistics", "return_statistics"):
                statistics = getattr(self.walkers, name)
                statistics.mean, statistics.var = file[f"{name}.mean"], file[f"{name}.var"]
                statistics.count = float(file[f"{name}.count"])
        self.average.load(folder / "average.npz")
        self.points = read_curve(self.folder / CURVE) if (self.folder / CURVE).exists() else []
        self.best = state["best"]
        self.model.num_timesteps = state["steps"]
        self.model._n_updates = state["updates"]
        self._evaluating = -state["seconds"]

    def run(self) -> None:
        """Learns until the last step, `wants_to_stop`, SIGINT or SIGTERM; saves a checkpoint."""
        self._began = time.monotonic()
        write_settings(self.settings, self.folder / SETTINGS)
        handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
        for each in handlers:
            signal.signal(each, self._stop_soon)
        try:
            if self.steps == 0:
                self.after_update()  # an early interrupt also needs a network to save
            if not self.is_done:
                self.model.learn(
                    self.settings.steps - self.steps,
                    callback=_Hooks(self),
                    log_interval=None,
                    reset_num_timesteps=False,
                )
            if self.is_done:
                self.after_update()
                self.evaluate()
            self.save_checkpoint()
        finally:
            for each, handler in handlers.items():
                signal.signal(each, handler)

    def close(self) -> None:
        self.walkers.close()
        self._evaluation.close()

    def before_rollout(self) -> None:
        now = self.settings.at(self.steps)
        self.walkers.settings = now
        self.model.gamma = now.gamma
        if self.settings.algorithm == "ppo":
            self.model.rollout_buffer.gamma = now.gamma
        learner.set_exploration(self.settings, self.model, self.steps)

    def after_update(self) -> None:
        self.average.add(learner.actor_arrays(self.model))

    def evaluate(self) -> None:
        """Adds a point to the curve; saves the policy if it is the best so far."""
        began = time.monotonic()
        seconds = self.seconds
        arrays = self.average.mean()
        policy = learner.to_policy(self.env_id, self.settings, self.walkers, arrays, self.steps)
        returns = self._evaluation.returns(
            _core.Policy.from_bytes(f"after {self.steps} steps", to_bytes(policy))
        )
        training = float(np.mean(self.walkers.returns)) if self.walkers.returns else float("nan")
        outcome = (float(returns.mean()), float(returns.std()), float(returns.min()))
        point = Point(self.steps, seconds, training, *outcome)
        self.points.append(point)
        if point.evaluation_return > self.best:
            self.best = point.evaluation_return
            write_policy(policy, self.folder / POLICY)
        write_curve(self.points, self.folder / CURVE)
        title = f"{self.env_id}, {self.settings.algorithm.upper()}, seed {self.settings.seed}"
        draw_curve(self.points, title, self.folder / PICTURE)
        self._evaluating += time.monotonic() - began
        self.report(self, point)

    def save_checkpoint(self) -> None:
        """Saves the state for `resume`. The old checkpoint stays until this one is complete."""
        folder, unfinished = self.folder / CHECKPOINT, self.folder / f"{CHECKPOINT}.new"
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir()
        learner.save_model(self.model, unfinished)
        arrays: dict[str, Any] = {}
        for name in ("observation_statistics", "return_statistics"):
            for part in ("mean", "var", "count"):
                arrays[f"{name}.{part}"] = getattr(getattr(self.walkers, name), part)
        np.savez(unfinished / "statistics.npz", **arrays)
        self.average.save(unfinished / "average.npz")
        state = {
            "id": self.env_id,
            "steps": self.steps,
            "updates": self.model._n_updates,
            "seconds": self.seconds,
            "best": self.best,
        }
        (unfinished / "state.json").write_text(json.dumps(state, indent=1) + "\n")
        old = self.folder / f"{CHECKPOINT}.old"
        shutil.rmtree(old, ignore_errors=True)
        if folder.exists():
            folder.rename(old)
        unfinished.rename(folder)
        shutil.rmtree(old, ignore_errors=True)

    def _stop_soon(self, *_: object) -> None:
        self.wants_to_stop = True


class _Hooks(BaseCallback):
    """Callback by which the learner calls the training."""

    def __init__(self, training: Training) -> None:
        super().__init__()
        self._training = training
        self._updates = training.model._n_updates
        every = training.settings.evaluate_every
        self._next_evaluation = (training.steps // every + 1) * every

    def _on_rollout_start(self) -> None:
        training = self._training
        if training.model._n_updates > self._updates:
            self._updates = training.model._n_updates
            training.after_update()
            if training.steps >= self._next_evaluation:
                self._next_evaluation += training.settings.evaluate_every
                training.evaluate()
                training.save_checkpoint()
        training.before_rollout()

    def _on_step(self) -> bool:
        return not self._training.wants_to_stop

    def _on_rollout_end(self) -> None:
        self._training.report(self._training, None)
