"""Gymnasium's interfaces to walkers, for the scripts of test/promises."""

import numpy as np
import promises
from promises import ALL, NUM_WALKERS
from walker_sim import WalkerEnv


def sizes_of(env_id, keywords):
    walker = WalkerEnv(env_id, **keywords)
    return walker.action_space.shape[0], walker._info_names


class SingleWalkers(promises.SingleWalkers):
    """Environments of one walker each.

    @param make: makes the environment of a walker
    @param copied: copies an environment; every seventh step is of a copy
    """

    def __init__(self, case, make, keywords, copied=None):
        super().__init__(*sizes_of(case.env_id, keywords))
        self.walkers = [make(walker) for walker in ALL]
        self.copied = copied

    def reset_one(self, walker, seed):
        try:
            observation, info = self.walkers[walker].reset(seed=seed)
        except RuntimeError as error:  # over ROS, its text begins with whose reset failed
            observation, info = None, {"error": str(error).rpartition("reset: ")[2]}
        self.add_reset(walker, observation, info)

    def prepare(self, step):
        if self.copied and step % 7 == 0:
            self.walkers = [self.copied(walker) for walker in self.walkers]

    def step_one(self, walker, action):
        self.add_step(walker, *self.walkers[walker].step(np.array(action, np.float32)))

    def set_world(self, walker, world):
        self.walkers[walker].unwrapped.set_world(world)

    def save(self, walker):
        return self.walkers[walker].unwrapped.get_state()

    def load(self, walker, state):
        self.walkers[walker].unwrapped.set_state(state)

    def set_coordinates(self, walker, position, velocity):
        self.walkers[walker].unwrapped.set_state(position, velocity)


class GroupWalkers(promises.Interface):
    """Walkers that are stepped together; every seventh step is of a copy by `copied`."""

    def __init__(self, case, envs, keywords, copied=None):
        super().__init__(*sizes_of(case.env_id, keywords))
        self.envs, self.copied = envs, copied

    def prepare(self, step):
        if self.copied and step % 7 == 0:
            self.envs = self.copied(self.envs)

    def set_world(self, walker, world):
        self.envs.set_world(world, [walker])

    def save(self, walker):
        return self.envs.get_state([walker])[0]

    def load(self, walker, state):
        self.envs.set_state([state], [walker])


class VectorWalkers(GroupWalkers):
    """A vector environment."""

    def __init__(self, case, envs, keywords, copied=None):
        super().__init__(case, envs, keywords, copied)
        self.mode = envs.autoreset_mode.name.lower()
        self.resets_at_once = self.mode != "next_step"

    def reset(self, walkers, seed=None):
        seeds = None if seed is None else [seed + i if i in walkers else None for i in ALL]
        options = None if walkers == ALL else {"reset_mask": np.isin(ALL, walkers)}
        observations, infos = self.envs.reset(seed=seeds, options=options)
        for walker in walkers:
            self.add_reset(walker, observations[walker], row_of(infos, walker))

    def step(self, actions):
        actions = np.array(actions, np.float32)
        failed = np.array(self.has_ended)
        if self.mode != "disabled" or not failed.any() or actions.shape[1] != self.action_size:
            self.add_rows(ALL, *self.envs.step(actions))
            return
        stepped = np.flatnonzero(~failed)
        if len(stepped):
            self.add_rows(stepped, *self.envs.step(actions[stepped], stepped))
        self.reset([*np.flatnonzero(failed)])

    def add_rows(self, walkers, observations, rewards, terminated, truncated, infos):
        """Adds the result of a step; row i is of `walkers[i]`."""
        ended = []
        for row, walker in enumerate(walkers):
            info, has_ended = row_of(infos, row), terminated[row] or truncated[row]
            if self.has_ended[walker]:
                self.add_reset(walker, observations[row], info)
                continue
            last = observations[row], info
            if has_ended and self.mode == "same_step":
                last = infos["final_obs"][row], row_of(infos["final_info"], row)
            self.add_step(walker, last[0], rewards[row], terminated[row], truncated[row], last[1])
            if has_ended and self.mode == "same_step":
                self.add_reset(walker, observations[row], info)
            elif has_ended:
                ended.append(walker)
        if self.mode == "disabled" and ended:
            self.reset(ended)


class PartsOfWalkers(VectorWalkers):
    """A vector environment that steps its walkers in two parts."""

    def step(self, actions):
        for part in ([2, 0], np.array([1])):
            self.step_part(np.array(actions, np.float32)[part], part)

    def step_part(self, actions, part):
        self.add_rows(part, *self.envs.step(actions, part))

    def refuse_step(self, walker, actions):
        self.step_part(np.array(actions, np.float32), ALL)


class AsynchronousWalkers(PartsOfWalkers):
    """A vector environment whose walkers are sent in two parts and received one by one."""

    def step(self, actions):
        super().step(actions)
        for _ in range(NUM_WALKERS):
            outcome = self.envs.recv()
            self.add_rows([*outcome[-1]["env_id"]], *outcome)

    def step_part(self, actions, part):
        self.envs.send(actions, part)


def row_of(infos, row):
    """Returns a walker's dictionary of a vector environment's infos."""
    info = {}
    for name, column in infos.items():
        if name in ("final_obs", "final_info", "env_id") or name.startswith("_"):
            continue
        if infos[f"_{name}"][row]:
            info[name] = row_of(column, row) if name == "world" else column[row]
    return info
