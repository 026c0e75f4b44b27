"""Compares every bit of a walker's steps over ROS with the same walker in this process."""

import gymnasium
import numpy as np
import walker_sim  # noqa: F401  # registers the ids

ENV = "BipedalWalker-v3"


class Pair:
    """Steps both walkers with the same random actions from a seed."""

    def __init__(self, server, master_uri, timeout, env_id=ENV):
        options = {"transport": "ros", "server": server, "master_uri": master_uri}
        self.remote = gymnasium.make(f"walker_sim/{env_id}", timeout=timeout, **options)
        self.local = gymnasium.make(f"walker_sim/{env_id}")
        self._size = self.remote.action_space.shape[0]

    def reset(self, seed):
        """Resets both and returns whether they are equal. Raises what the remote walker raises."""
        self._random = np.random.default_rng(seed)
        self._ends = False
        return self._equal(self.remote.reset(seed=seed), self.local.reset(seed=seed))

    def step(self):
        """Steps both, or resets them after an episode's end, and returns whether they are equal."""
        if self._ends:
            return self.reset(int(self._random.integers(1 << 32)))
        action = self._random.uniform(-1, 1, self._size).astype(np.float32)
        theirs, ours = self.remote.step(action), self.local.step(action)
        self._ends = ours[2] or ours[3]
        return self._equal(theirs, ours)

    def steps(self, count):
        return all([self.step() for _ in range(count)])

    @staticmethod
    def _equal(one, other):
        return one[0].tobytes() == other[0].tobytes() and one[1:] == other[1:]

    def close(self):
        self.remote.close()
        self.local.close()
