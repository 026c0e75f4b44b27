"""Our Box2D and Gymnasium's in one process: neither takes the other's functions.

Each order of loading needs a process of its own, so the suite runs this file as a program. The
libraries are loaded with global symbols, the unkind way. As the two engines are of nearly one
version, bits could stay equal by luck: what the dynamic linker has bound to what is looked at too.
"""

import ctypes
import os
import re
import subprocess
import sys

import pytest

SEED = 6
STEPS = 400


def load_ours():
    ctypes.CDLL(os.environ["WALKER_SIM_CORE_LIBRARY"], ctypes.RTLD_GLOBAL)
    return ctypes.CDLL(os.environ["WALKER_SIM_C_INTERFACE"], ctypes.RTLD_GLOBAL)


def load_gymnasiums():
    sys.setdlopenflags(sys.getdlopenflags() | ctypes.RTLD_GLOBAL)
    import Box2D  # noqa: F401


def step_both(ours):
    """The hashes of an episode, stepped in turns: ours, Gymnasium's."""
    import gymnasium
    import numpy as np
    from gymnasium_reference import Actions, hashes

    environment = gymnasium.make("BipedalWalker-v3")
    observation, _ = environment.reset(seed=SEED)
    actions = Actions("heuristic", 0)
    row = np.zeros(27)
    pointer = ctypes.POINTER(ctypes.c_double)
    ours.walker_sim_test_reset(ctypes.c_ulong(SEED), row.ctypes.data_as(pointer))
    our_rows, their_rows = [row.copy()], [[*observation, 0, 0, 0]]
    for _ in range(STEPS):
        action = actions.draw(observation)
        ours.walker_sim_test_step(action.ctypes.data_as(pointer), row.ctypes.data_as(pointer))
        observation, *rest, _ = environment.step(action.astype(np.float32))
        our_rows.append(row.copy())
        their_rows.append([*observation, *rest])
        assert not (rest[1] or rest[2]), "choose a seed that lasts"
    return hashes(np.array(our_rows)), hashes(np.array(their_rows, np.float64))


def main(order):
    sys.path.insert(0, os.path.join(os.path.dirname(__file__), os.pardir))
    if order == "ours first":
        ours = load_ours()
        load_gymnasiums()
    else:
        load_gymnasiums()
        ours = load_ours()
    for result in step_both(ours):
        print(" ".join(f"{value:016x}" for value in result))


def engine_bindings(folder):
    """The linker's report on symbols of Box2D that went from one of the libraries to the other."""
    lines = [line for file in folder.iterdir() for line in file.read_text().splitlines()]
    assert any("`walker_sim_test_step'" in line for line in lines), "the linker told nothing"
    crossing = re.compile(r"file \S*(walker_sim_\S* .*to \S*_Box2D|_Box2D\S* .*to \S*walker_sim_)")
    return [line for line in lines if crossing.search(line) and re.search(r"`_Z\w*\db2", line)]


@pytest.mark.parametrize("order", ["ours first", "Gymnasium's first"])
def test_bits_stay_and_nothing_is_shared(order, tmp_path):
    from gymnasium_reference import Plan, Session, hashes, play

    (alone,) = play(Session("BipedalWalker-v3", False, [Plan("heuristic", SEED, 0)]))
    expected = " ".join(f"{value:016x}" for value in hashes(alone.rows[: STEPS + 1]))
    command = [sys.executable, __file__, order]
    linker = {"LD_DEBUG": "bindings", "LD_DEBUG_OUTPUT": tmp_path / "linker", "LD_BIND_NOW": "1"}
    environment = {**os.environ, **linker}
    run = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert run.returncode == 0, run.stderr
    ours, gymnasiums = run.stdout.splitlines()
    assert gymnasiums == expected
    assert ours == expected
    assert engine_bindings(tmp_path) == []


if __name__ == "__main__":
    main(sys.argv[1])
