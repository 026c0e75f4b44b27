"""Tests that this package's engine and Gymnasium's do not bind each other's symbols in one process.

Each load order needs a new process, so a suite runs itself as a program: `run` starts the process,
which calls `program`. Equal bits alone do not prove separation, so suites also check the dynamic
linker's bindings.
"""

import ctypes
import os
import subprocess
import sys

ORDERS = ("ours first", "Gymnasium's first")


class OurWalker:
    def __init__(self, environment_id, row_size, mode):
        import numpy as np

        ctypes.CDLL(os.environ["WALKER_SIM_CORE_LIBRARY"], mode)
        self._library = ctypes.CDLL(os.environ["WALKER_SIM_C_INTERFACE"], mode)
        self._library.walker_sim_test_make.restype = ctypes.c_void_p
        self._row = np.zeros(row_size)
        self._walker = ctypes.c_void_p(self._library.walker_sim_test_make(environment_id.encode()))

    def reset(self, seed):
        self._library.walker_sim_test_reset(
            self._walker, ctypes.c_ulong(seed), self._pointer(self._row)
        )
        return self._row.copy()

    def step(self, action):
        self._library.walker_sim_test_step(
            self._walker, self._pointer(action), self._pointer(self._row)
        )
        return self._row.copy()

    @staticmethod
    def _pointer(array):
        return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def program(order, load_ours, load_theirs, reference, seed, steps):
    """Loads both in this order, steps them alternately, prints the hashes of our rows, then theirs.

    reference() returns the source of actions, which may read observations, and the info names.
    """
    if order == ORDERS[0]:
        ours = load_ours()
        assert not {"Box2D", "mujoco"} & sys.modules.keys(), "Gymnasium's engine came first"
        theirs = load_theirs()
    else:
        theirs = load_theirs()
        ours = load_ours()

    import numpy as np
    from gymnasium_reference import hashes, row_of

    actions, info_names = reference()
    observation, info = theirs.reset(seed=seed)
    our_rows = [ours.reset(seed)]
    their_rows = [row_of(observation, 0, 0, 0, info, info_names)]
    for _ in range(steps):
        action = actions.draw(observation)
        our_rows.append(ours.step(action))
        observation, *outcome, info = theirs.step(action.astype(np.float32))
        their_rows.append(row_of(observation, *outcome, info, info_names))
        assert not (outcome[1] or outcome[2]), "choose a seed that lasts"
    for rows in (our_rows, their_rows):
        print(*hashes(np.array(rows, np.float64)))


def run(script, order, folder):
    """Runs a suite's program. Returns our and their hashes, and the lines of the dynamic linker's
    report, which is written to the empty `folder`."""
    linker = {"LD_DEBUG": "bindings", "LD_DEBUG_OUTPUT": folder / "linker", "LD_BIND_NOW": "1"}
    process = subprocess.run(
        [sys.executable, script, order],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **linker},
    )
    assert process.returncode == 0, process.stderr
    report = [line for file in folder.iterdir() for line in file.read_text().splitlines()]
    assert any("`walker_sim_test_step'" in line for line in report), "the linker reported nothing"
    return *(list(map(int, line.split())) for line in process.stdout.splitlines()), report
