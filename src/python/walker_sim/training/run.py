"""One training: learns, evaluates, keeps the best policy, saves checkpoints and resumes."""

from __future__ import annotations

import json
import shutil
import signal
import time
from collections import deque
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from walker_sim import _core, sb3
from walker_sim.errors import UnknownKeyword
from walker_sim.training import learner
from walker_sim.training.evaluation import Evaluation, Point, draw_curve, read_curve, write_curve
from walker_sim.training.policy_file import PolicyFile, to_bytes, write_policy
from walker_sim.training.settings import Settings, write_settings

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
    walkers
        Environments to learn on; None: this package's.
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
        walkers: VecEnv | None = None,
        report: Callable[[Training, Point | None], None] = lambda training, point: None,
    ) -> None:
        # VecEnv would take its own keywords and the camera's for parameters of the environment.
        known = [parameter["name"] for parameter in _core.parameters_of(env_id)]
        for name in settings.parameters:
            if name not in known:
                raise UnknownKeyword(f"parameter {name}: unknown; must be one of {' '.join(known)}")
        self.env_id, self.settings, self.folder, self.report = env_id, settings, folder, report
        if walkers is None:
            parameters = {**settings.parameters, "num_threads": num_threads}
            walkers = sb3.VecEnv(env_id, settings.num_envs, world=settings.world, **parameters)
        self.walkers = learner.wrap(walkers, settings)
        self.model = learner.make_learner(settings, self.walkers)
        self.walkers.seed(learner.FIRST_TRAINING_SEED + (settings.seed << 20))
        self.networks: deque[Sequence[NDArray[np.float32]]] = deque(maxlen=settings.average_updates)
        self.points: list[Point] = []
        self.best = -np.inf
        self.wants_to_stop = False
        self._evaluation = Evaluation(
            *(env_id, settings.parameters, settings.world),
            *(settings.evaluation_episodes, num_threads),
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

    @property
    def mean_return(self) -> float:
        """Mean return of the last 100 training episodes; NaN before the first has ended."""
        returns = [episode["r"] for episode in self.model.ep_info_buffer or ()]
        return float(np.mean(returns)) if returns else float("nan")

    def resume(self) -> None:
        """Restores the folder's checkpoint; OSError if none. Walkers begin new episodes."""
        folder = self.folder / CHECKPOINT
        state = json.loads((folder / "state.json").read_text())
        self.model.set_parameters(folder / "model.zip", exact_match=True, device="cpu")
        if (folder / "buffer.pkl").exists():
            self.model.load_replay_buffer(folder / "buffer.pkl")
        saved = VecNormalize.load(str(folder / "normalization.pkl"), self.walkers.venv)
        self.walkers.obs_rms, self.walkers.ret_rms = saved.obs_rms, saved.ret_rms
        with np.load(folder / "networks.npz") as file:
            self.networks.extend(zip(*(file[name] for name in file.files)))
        self.points = read_curve(self.folder / CURVE) if (self.folder / CURVE).exists() else []
        self.best = state["best"]
        self.model.num_timesteps = state["steps"]
        self.model._n_updates = state["updates"]
        self._evaluating = -state["seconds"]

    def run(self) -> None:
        """Learns until the last step, `wants_to_stop`, SIGINT or SIGTERM; saves a checkpoint."""
        self._began = time.monotonic()
        write_settings(self.settings, self.folder / SETTINGS)
        handlers = {
            number: signal.signal(number, self._stop_soon)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
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
            for number, handler in handlers.items():
                signal.signal(number, handler)

    def close(self) -> None:
        self.walkers.close()
        self._evaluation.close()

    def before_rollout(self) -> None:
        """Applies the settings of this number of steps."""
        now = self.settings.at(self.steps)
        self.walkers.gamma = self.model.gamma = now.gamma
        self.walkers.venv.least_reward = now.least_reward
        if self.settings.algorithm != "ppo":
            return
        self.model.rollout_buffer.gamma = now.gamma
        if self.settings.log_std is not None:  # else the noise is learnt
            begin, end = self.settings.log_std
            noise = self.model.policy.log_std.requires_grad_(False)
            noise.data.fill_(begin + (end - begin) * min(self.steps / self.settings.steps, 1.0))

    def after_update(self) -> None:
        self.networks.append(learner.actor_arrays(self.model))

    def policy(self) -> PolicyFile:
        """Returns the mean of the latest networks with the present observation statistics."""
        # Single precision would accumulate rounding errors of many networks.
        arrays = [
            np.asarray(np.mean(each, axis=0, dtype=np.float64), np.float32)
            for each in zip(*self.networks)
        ]
        settings, walkers = self.settings, self.walkers
        world = {"world": _core.world_text(dict(settings.world))} if settings.world else {}
        return PolicyFile(
            env_id=self.env_id,
            parameters={name: str(value) for name, value in settings.parameters.items()},
            activation=settings.activation,
            output="clip" if settings.algorithm == "ppo" else "tanh",
            mean=walkers.obs_rms.mean,
            deviation=np.sqrt(walkers.obs_rms.var + walkers.epsilon),
            low=walkers.action_space.low,
            high=walkers.action_space.high,
            layers=list(zip(arrays[::2], arrays[1::2])),
            notes={
                "algorithm": settings.algorithm,
                "steps": str(self.steps),
                "seed": str(settings.seed),
                "settings": settings.hash(),
                **world,
            },
        )

    def evaluate(self) -> None:
        """Adds a point to the curve; saves the policy if it is the best so far."""
        began = time.monotonic()
        seconds = self.seconds
        policy = self.policy()
        returns = self._evaluation.returns(
            _core.Policy.from_bytes(f"after {self.steps} steps", to_bytes(policy))
        )
        outcome = (float(returns.mean()), float(returns.std()), float(returns.min()))
        point = Point(self.steps, seconds, self.mean_return, *outcome)
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
        schedules = ["lr_schedule", "learning_rate", "clip_range"]
        self.model.save(unfinished / "model.zip", exclude=schedules)
        if self.model.__dict__.get("replay_buffer") is not None:
            self.model.save_replay_buffer(unfinished / "buffer.pkl")
        self.walkers.save(str(unfinished / "normalization.pkl"))
        np.savez(unfinished / "networks.npz", *(np.stack(each) for each in zip(*self.networks)))
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
