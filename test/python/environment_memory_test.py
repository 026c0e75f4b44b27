"""What is made goes again: no object of Python's and no memory of the engines' stays behind."""

import copy
import gc
import os
import pathlib
import sys

import pytest
from walker_sim import InvalidAction, WalkerEnv
from walkers import IDS, random_actions

PAGE = os.sysconf("SC_PAGE_SIZE")


def resident_memory():
    """[bytes]"""
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * PAGE


def growth(repeated, count):
    """Of blocks that Python holds, and of resident memory [bytes], over `count` calls."""
    for _ in range(200):  # until the heap has its size
        repeated()
    gc.collect()
    before = sys.getallocatedblocks(), resident_memory()
    for _ in range(count):
        repeated()
    gc.collect()
    return sys.getallocatedblocks() - before[0], resident_memory() - before[1]


def episode(environment_id):
    environment = WalkerEnv(environment_id)
    actions = random_actions(environment_id, 50)

    def play():
        environment.reset(seed=2)
        for action in actions:
            if environment.step(action)[2]:
                break
        with pytest.raises(InvalidAction):
            environment.step(actions[0][:1])

    return play


def new_environment(environment_id):
    def make():
        environment = WalkerEnv(environment_id)
        environment.reset(seed=1)
        environment.step(random_actions(environment_id, 1)[0])
        copy.deepcopy(environment)

    return make


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("repeated", [episode, new_environment])
def test_nothing_stays_behind(environment_id, repeated):
    # So many that the bound on memory is well above what the heap goes up and down by as it gives a
    # model's textures back when it likes, some 2 MB.
    count = 800
    call = repeated(environment_id)
    for _ in range(3):  # what stays behind does so each time; the heap goes up and comes down
        blocks, memory = growth(call, count)
        assert blocks < count  # less than one for each call
        if memory < 4096 * count:  # a walker in its world takes far more
            return
    pytest.fail(f"{memory} bytes more for {count} calls, and much in the two rounds before")
