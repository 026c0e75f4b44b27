"""Training with Stable-Baselines3."""

from __future__ import annotations

import json
import os
from collections import deque
from pathlib import Path
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from walker_sim import sb3
from walker_sim.training import learner
from walker_sim.training.policy_file import NO_HISTORY, PolicyFile
from walker_sim.training.settings import ACTIVATION, Settings
from walker_sim.training.stage import Stage


class Training(Stage):
    """Training by PPO, SAC or TQC.

    Parameters
    ----------
    env_id, settings, folder, keywords
        See `Stage`.
    walkers
        Environments to learn on; None: this package's.
    """

    def __init__(
        self,
        env_id: str,
        settings: Settings,
        folder: Path,
        *,
        walkers: VecEnv | None = None,
        **keywords: Any,
    ) -> None:
        super().__init__(env_id, settings, folder, **keywords)
        start = self.read_start()
        if start is not None:
            self.settings = learner.settings_for(start, self.settings)
        settings = self.settings
        if walkers is None:
            parameters = {**settings.parameters, "num_threads": self.num_threads}
            walkers = sb3.VecEnv(env_id, settings.num_envs, **parameters)
        self.walkers = learner.wrap(walkers, settings)
        self.model = learner.make_learner(settings, self.walkers)
        if start is not None:
            learner.begin_with(start, self.model)
        self._set_worlds()
        self.model.value_steps = settings.value_steps
        self.model.num_threads = self.num_threads or os.cpu_count() or 1
        self.walkers.seed(self.first_seed)
        self.networks: deque[Sequence[NDArray[np.float32]]] = deque(
            [learner.actor_arrays(self.model)], maxlen=settings.average_updates
        )

    @property
    def steps(self) -> int:
        return int(self.model.num_timesteps)

    @property
    def mean_return(self) -> float:
        returns = [episode["r"] for episode in self.model.ep_info_buffer or ()]
        return float(np.mean(returns)) if returns else float("nan")

    def learn(self) -> None:
        self.model.learn(
            self.settings.steps - self.steps,
            callback=_Hooks(self),
            log_interval=None,
            reset_num_timesteps=False,
        )
        if self.is_done:
            self.after_update()

    def close(self) -> None:
        self.walkers.close()

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
        if self.grow():
            self._set_worlds()

    def _set_worlds(self) -> None:
        """Sets the worlds of the walkers' next episodes."""
        worlds, count = self.training_worlds, self.settings.num_envs
        if count < len(worlds):
            what = "twice the number of ends of the curriculum's ranges"
            raise ValueError(
                f"num_envs = {count}: must be at least {len(worlds)}, "
                f"{what if self.curriculum else 'the sum of the weights of world'}"
            )
        if any(worlds):
            self.walkers.unwrapped.set_world([worlds[i % len(worlds)] for i in range(count)])

    def policy(self) -> PolicyFile:
        """Returns the mean of the latest networks with the present observation statistics."""
        # Single precision would accumulate rounding errors of many networks.
        arrays = [
            np.asarray(np.mean(each, axis=0, dtype=np.float64), np.float32)
            for each in zip(*self.networks)
        ]
        settings, walkers = self.settings, self.walkers
        return PolicyFile(
            env_id=self.env_id,
            parameters=self.parameter_texts,
            activation=settings.activation or ACTIVATION,
            output="clip" if settings.algorithm == "ppo" else "tanh",
            mean=walkers.obs_rms.mean,
            deviation=np.sqrt(walkers.obs_rms.var + walkers.epsilon),
            low=walkers.action_space.low,
            high=walkers.action_space.high,
            layers=list(zip(arrays[::2], arrays[1::2])),
            notes=self.notes(),
            history=settings.history or NO_HISTORY,
        )

    def save(self, folder: Path) -> None:
        schedules = ["lr_schedule", "learning_rate", "clip_range"]
        self.model.save(folder / "model.zip", exclude=schedules)
        if self.model.__dict__.get("replay_buffer") is not None:
            self.model.save_replay_buffer(folder / "buffer.pkl")
        self.walkers.save(str(folder / "normalization.pkl"))
        np.savez(folder / "networks.npz", *(np.stack(each) for each in zip(*self.networks)))
        counts = {"steps": self.steps, "updates": self.model._n_updates}
        (folder / "counts.json").write_text(json.dumps(counts) + "\n")

    def load(self, folder: Path) -> None:
        self.model.set_parameters(folder / "model.zip", exact_match=True, device="cpu")
        if (folder / "buffer.pkl").exists():
            self.model.load_replay_buffer(folder / "buffer.pkl")
        saved = VecNormalize.load(str(folder / "normalization.pkl"), self.walkers.venv)
        self.walkers.obs_rms, self.walkers.ret_rms = saved.obs_rms, saved.ret_rms
        self.networks.clear()
        with np.load(folder / "networks.npz") as file:
            self.networks.extend(zip(*(file[name] for name in file.files)))
        self._set_worlds()
        counts = json.loads((folder / "counts.json").read_text())
        self.model.num_timesteps = counts["steps"]
        self.model._n_updates = counts["updates"]
        # Else the first episodes and their noise would come again.
        self.model.set_random_seed((self.settings.seed + self.steps) % 2**32)
        self.walkers.seed(self.first_seed + self.steps)


class _Hooks(BaseCallback):
    """Callback by which the learner calls the training."""

    def __init__(self, training: Training) -> None:
        super().__init__()
        self._training = training
        self._updates = training.model._n_updates

    def _on_rollout_start(self) -> None:
        training = self._training
        if training.model._n_updates > self._updates:
            self._updates = training.model._n_updates
            training.after_update()
            if training.steps >= training.next_evaluation:
                training.evaluate()
                training.save_checkpoint()
        training.before_rollout()

    def _on_step(self) -> bool:
        return not self._training.wants_to_stop

    def _on_rollout_end(self) -> None:
        self._training.report(self._training, None)
