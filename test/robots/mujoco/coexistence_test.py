"""Our MuJoCo and Gymnasium's newer one in one process, both loaded with RTLD_LOCAL, Python's
default."""

import ctypes
import os
import re
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", ".."))  # when run as a program
import coexistence
from gymnasium_reference import Plan

ID = "Walker2d-v5"
PLAN = Plan("smooth", 41, 41)  # a recorded one
STEPS = 40


def load_ours():
    return coexistence.OurWalker(ID, 17 + 3 + 6, ctypes.RTLD_LOCAL)


def load_gymnasiums():
    import gymnasium

    return gymnasium.make(ID)


def reference():
    from mujoco_reference import INFO_NAMES, Actions

    return Actions(PLAN.kind, PLAN.action_seed, 6), INFO_NAMES[ID]


def recorded_hashes():
    from recording_file import read_sessions

    sessions = read_sessions("walker2d_episodes.txt")
    (found,) = (
        rows
        for session, recorded in sessions
        for plan, rows in zip(session.plans, recorded)
        if (session.environment_id, session.parameters, plan) == (ID, {}, PLAN)
    )
    return found[: STEPS + 1].tolist()


@pytest.mark.parametrize("order", coexistence.ORDERS)
def test_bits_stay_and_nothing_is_shared(order, tmp_path):
    from gymnasium_reference import Session, hashes
    from mujoco_reference import play

    (alone,) = play(Session(ID, {}, [PLAN]))
    ours, gymnasiums, report = coexistence.run(__file__, order, tmp_path)
    assert gymnasiums == hashes(alone.rows[: STEPS + 1]).tolist()
    assert [value & 0xFFFFFFFF for value in ours] == recorded_hashes()
    assert ours != gymnasiums, "two versions of MuJoCo; choose a longer episode"

    mujoco = re.compile(r"binding file (\S+) .*to (\S+) .*`_?mj\w+'")
    files = [map(os.path.basename, found.groups()) for found in map(mujoco.search, report) if found]
    is_ours = re.compile(r"walker_sim|libmujoco\.so\.2\.2\.2")
    bindings = [tuple(bool(is_ours.search(file)) for file in pair) for pair in files]
    assert set(bindings) == {(True, True), (False, False)}


if __name__ == "__main__":
    coexistence.program(sys.argv[1], load_ours, load_gymnasiums, reference, PLAN.seed, STEPS)
