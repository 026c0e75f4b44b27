"""Calls the C interface of draws.cpp."""

import ctypes
import os

import numpy as np

LIBRARY = ctypes.CDLL(os.environ["WALKER_SIM_DRAWS"])
LIBRARY.walker_sim_test_ground.restype = ctypes.c_size_t
LIBRARY.walker_sim_test_level.restype = ctypes.c_size_t


def draw(seed, draws):
    """Returns the numbers that a generator with this seed draws, and its state after them. A draw
    is (0,) for random, (1, low, high) for uniform, (2, low, high) for integers."""
    rows = np.array([(*each, 0, 0)[:3] for each in draws], np.float64)
    numbers, state = np.empty(len(rows)), np.empty(6, np.uint64)
    LIBRARY.walker_sim_test_draw(
        *(ctypes.c_uint64(seed), ctypes.c_size_t(len(rows))),
        *(rows.ctypes, numbers.ctypes, state.ctypes),
    )
    return numbers, state


def terrain(hardcore, seed):
    """Returns a BipedalWalker episode's draws, see bipedal_walker_reference.terrain."""
    numbers = np.empty(5000)
    count = LIBRARY.walker_sim_test_ground(hardcore, ctypes.c_uint64(seed), numbers.ctypes)
    return numbers[:count]


def level(environment_id, world, seed):
    """Returns the points of the ground and the corners of the boxes that an episode draws in a
    world, shapes (columns, 2) and (boxes, 4, 2)."""
    numbers, count = np.empty(50000), ctypes.c_size_t()
    columns = LIBRARY.walker_sim_test_level(
        *(environment_id.encode(), str(world).encode(), ctypes.c_uint64(seed)),
        *(numbers.ctypes, ctypes.byref(count)),
    )
    ground = numbers[: 2 * columns].reshape(columns, 2)
    return ground, numbers[2 * columns : count.value].reshape(-1, 4, 2)


def values_of_steps(environment_id, world, seed, steps, count):
    """Returns the values of a world's parameters in each step, in the order of their names, shape
    (steps, count)."""
    rows = np.empty((steps, count))
    LIBRARY.walker_sim_test_values(
        *(environment_id.encode(), str(world).encode(), ctypes.c_uint64(seed)),
        *(ctypes.c_uint32(steps), rows.ctypes),
    )
    return rows


def disturbances(environment_id, world, seed, steps, action_size):
    """Returns the pushes and the errors of actions of an episode's steps in a world, shapes
    (steps, 2) and (steps, action size)."""
    rows = np.empty((steps, 2 + action_size))
    LIBRARY.walker_sim_test_disturbances(
        *(environment_id.encode(), str(world).encode(), ctypes.c_uint64(seed)),
        *(ctypes.c_uint32(steps), rows.ctypes),
    )
    return rows[:, :2], rows[:, 2:]
