"""Drives the program rollout.cpp through a pipe."""

import os
import subprocess

import numpy as np


class Refused(Exception):
    """The tool answered with an error."""


def parameter_text(value):
    """Formats a parameter's value for src/base/parameter_text.h."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        return "[" + ",".join(map(repr, map(float, value))) + "]"
    return str(value)


def assignments(parameters):
    return [f"{name}={parameter_text(value)}" for name, value in parameters.items()]


class Rollout:
    """A rollout.cpp process, which holds at most one environment.

    A row is observation, reward, terminated, truncated, info (NaN where absent).
    """

    def __init__(self, tool=None):
        tool = tool or os.environ["WALKER_SIM_ROLLOUT"]
        self._process = subprocess.Popen([tool], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._row_size = 0

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()

    def _ask(self, *words, numbers=None):
        payload = b"" if numbers is None else np.ascontiguousarray(numbers, np.float64).tobytes()
        self._process.stdin.write("\t".join(map(str, words)).encode() + b"\n" + payload)
        self._process.stdin.flush()
        status, _, rest = self._process.stdout.readline().decode().rstrip("\n").partition(" ")
        if status != "ok":
            raise Refused(rest or "the tool has ended")
        return self._process.stdout.read(int(rest))

    def make(self, environment_id, **parameters):
        self._ask("make", environment_id, *assignments(parameters))
        self._row_size = len(self.spaces()[0]) + 3 + len(self.description()[0])

    def reset(self, seed=None):
        """Returns the reset's row, shape (row size,). Without a seed the generator continues."""
        return np.frombuffer(self._ask("reset", "-" if seed is None else seed))

    def step(self, actions):
        """Steps until the actions, shape (n, action size), or the episode end. Returns the rows."""
        answer = self._ask("step", len(actions), numbers=actions)
        return np.frombuffer(answer).reshape(-1, self._row_size)

    def render(self, width, height, **camera):
        """Returns a picture of the current state, shape (height, width, 3)."""
        parameters = {"width": width, "height": height, **camera}
        answer = self._ask("render", *assignments(parameters))
        return np.frombuffer(answer, np.uint8).reshape(height, width, 3)

    def generator_state(self):
        """Returns NumPy's PCG64: state high, low, increment high, low, has_uint32, uinteger."""
        return np.frombuffer(self._ask("state"), np.uint64)

    def spaces(self):
        """Returns observation low, high, action low, high, dt, max_episode_steps, threshold."""
        numbers = np.frombuffer(self._ask("spaces"))
        observation_size, action_size = map(int, numbers[:2])
        sizes = [observation_size, observation_size, action_size, action_size, 1, 1]
        parts = np.split(numbers[2:], np.cumsum(sizes))
        return [*parts[:4], *(float(part[0]) for part in parts[4:])]

    def description(self):
        infos, *parameters = self._ask("description").decode().splitlines()
        return infos.split(), dict(parameter.split("=", 1) for parameter in parameters)

    def act(self, observations):
        """Returns a new BipedalWalker heuristic's actions (n, 4) for observations (n, 24)."""
        answer = self._ask("act", len(observations), numbers=observations)
        return np.frombuffer(answer).reshape(-1, 4)

    def terrain(self, hardcore, seed):
        """Returns a BipedalWalker episode's random draws, see bipedal_walker_reference.terrain."""
        return np.frombuffer(self._ask("terrain", int(hardcore), seed))

    def random(self, seed, draws):
        """Returns the draws (see rollout.cpp) as doubles, and the generator's state."""
        answer = self._ask("random", seed, *draws)
        return np.frombuffer(answer[:-48]), np.frombuffer(answer[-48:], np.uint64)
