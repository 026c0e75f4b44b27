"""Calls the C interface of draws.cpp."""

import ctypes
import os

import numpy as np

LIBRARY = ctypes.CDLL(os.environ["WALKER_SIM_DRAWS"])
LIBRARY.walker_sim_test_terrain.restype = ctypes.c_size_t


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
    count = LIBRARY.walker_sim_test_terrain(hardcore, ctypes.c_uint64(seed), numbers.ctypes)
    return numbers[:count]
