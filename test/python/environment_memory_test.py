"""Environments and episodes leak neither Python objects nor engine memory."""

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
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * PAGE


def growth(repeated, count):
    """Returns the growth of Python's allocated blocks and of resident memory [bytes]."""
    for _ in range(200):  # until the heap size is stable
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
def test_no_memory_leaks(environment_id, repeated):
    # Enough calls that the memory bound is well above the heap's fluctuation of about 2 MB: the
    # allocator decides when it returns a model's textures.
    count = 800
    call = repeated(environment_id)
    for _ in range(3):  # a leak repeats; heap fluctuation does not
        blocks, memory = growth(call, count)
        assert blocks < count
        if memory < 4096 * count:  # an environment takes far more than 4096 bytes
            return
    pytest.fail(f"{memory} bytes more for {count} calls, and much in the two rounds before")
