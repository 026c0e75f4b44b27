"""Reads Gymnasium's episodes from test/recordings, to repeat them with an installed wheel."""

import json
import os
import struct
from typing import NamedTuple

FOLDER = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "recordings")


class RecordedStep(NamedTuple):
    """A reset or a step."""

    action: list
    observation: list
    reward: float
    terminated: bool
    truncated: bool
    info: list


class RecordedEpisode(NamedTuple):
    id: str
    parameters: dict
    seed: int
    steps: list  # the reset's first; its action is zero


def read_all():
    """Returns the episodes of both BipedalWalkers, Walker2d and Hopper."""
    return [
        *read("full_episodes.txt", bipedal_walker_step),
        *read("walker2d_full_episodes.txt", mujoco_step(6, 17)),
        *read("hopper_full_episodes.txt", mujoco_step(3, 11)),
    ]


def read(name, step_of):
    with open(os.path.join(FOLDER, name), encoding="ascii") as file:
        lines = [line.split() for line in file if not line.startswith("#")]
    environment_id, parameters = None, {}
    for number, words in enumerate(lines):
        if words[0] == "session":
            environment_id = words[1]
            parameters = {name: json.loads(v) for name, v in (w.split("=") for w in words[3:])}
        elif words[0] == "episode":
            count = int(words[4]) + 1
            steps = [step_of(line) for line in lines[number + 1 : number + 1 + count]]
            yield RecordedEpisode(environment_id, parameters, int(words[2]), steps)


def bipedal_walker_step(words):
    """All numbers are float32."""
    numbers = [single(word) for word in words[:29]]
    flags = (words[29] == "1", words[30] == "1")
    return RecordedStep(numbers[:4], numbers[4:28], numbers[28], *flags, [])


def mujoco_step(action_size, observation_size):
    """Actions are float32, the other numbers float64."""
    reward = action_size + observation_size

    def step(words):
        action = [single(word) for word in words[:action_size]]
        observation = [double(word) for word in words[action_size:reward]]
        flags = (words[reward + 1] == "1", words[reward + 2] == "1")
        info = [double(word) for word in words[reward + 3 :]]
        return RecordedStep(action, observation, double(words[reward]), *flags, info)

    return step


def single(word):
    return struct.unpack(">f", bytes.fromhex(word))[0]


def double(word):
    return struct.unpack(">d", bytes.fromhex(word))[0]
