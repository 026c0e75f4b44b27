"""Drives walker_sim_rollout (test/bipedal_walker/rollout.cpp), which steps our environments."""

import os
import subprocess

import numpy as np

OBSERVATION_SIZE = 24
ROW_SIZE = OBSERVATION_SIZE + 3  # observation, reward, terminated, truncated


class Refused(Exception):
    """The tool answered with an error; its text is the message."""


class Rollout:
    """One process with at most one environment in it."""

    def __init__(self, tool=None):
        self._process = subprocess.Popen(
            [tool or os.environ["WALKER_SIM_ROLLOUT"]],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()

    def _ask(self, line, numbers=None):
        """Raw bytes of the answer to one command."""
        payload = b"" if numbers is None else np.ascontiguousarray(numbers, np.float64).tobytes()
        self._process.stdin.write(line.encode() + b"\n" + payload)
        self._process.stdin.flush()
        status, _, rest = self._process.stdout.readline().decode().rstrip("\n").partition(" ")
        if status != "ok":
            raise Refused(rest or "the tool has ended")
        return self._process.stdout.read(int(rest))

    def make(self, environment_id, **parameters):
        texts = [f"{name}={str(value).lower()}" for name, value in parameters.items()]
        self._ask(" ".join(["make", environment_id, *texts]))

    def reset(self, seed=None):
        """Observation, shape (24,); without a seed the generator continues."""
        return np.frombuffer(self._ask(f"reset {'-' if seed is None else seed}"))

    def step(self, actions):
        """Rows (observation, reward, terminated, truncated) up to the episode's end.

        actions: shape (n, 4). Returns shape (m, 27) with m <= n.
        """
        return np.frombuffer(self._ask(f"step {len(actions)}", actions)).reshape(-1, ROW_SIZE)

    def generator_state(self):
        """NumPy PCG64: state high, low, increment high, low, has_uint32, uinteger."""
        return np.frombuffer(self._ask("state"), np.uint64)

    def spaces(self):
        """Observation low and high, action low and high, dt, max_episode_steps, threshold."""
        numbers = np.frombuffer(self._ask("spaces"))
        parts = np.split(numbers, np.cumsum([OBSERVATION_SIZE, OBSERVATION_SIZE, 4, 4, 1, 1]))
        return [*parts[:4], *(float(part[0]) for part in parts[4:])]

    def act(self, observations):
        """Actions of a new heuristic on observations of shape (n, 24), shape (n, 4)."""
        return np.frombuffer(self._ask(f"act {len(observations)}", observations)).reshape(-1, 4)

    def terrain(self, hardcore, seed):
        """What an episode draws: see gymnasium_reference.terrain."""
        return np.frombuffer(self._ask(f"terrain {int(hardcore)} {seed}"))

    def random(self, seed, draws):
        """The draws (see rollout.cpp) as doubles, then the generator's state as 6 integers."""
        answer = self._ask(" ".join([f"random {seed}", *draws]))
        return np.frombuffer(answer[:-48]), np.frombuffer(answer[-48:], np.uint64)
