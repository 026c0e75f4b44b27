"""Our Box2D and Gymnasium's in one process, both loaded with RTLD_GLOBAL, the worst case."""

import ctypes
import os
import re
import sys

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", ".."))  # when run as a program
import coexistence
from gymnasium_reference import Plan

PLAN = Plan("heuristic", 6, 0)
STEPS = 400


def load_ours():
    return coexistence.OurWalker("BipedalWalker-v3", 27, ctypes.RTLD_GLOBAL)


def load_gymnasiums():
    sys.setdlopenflags(sys.getdlopenflags() | ctypes.RTLD_GLOBAL)
    import gymnasium

    return gymnasium.make("BipedalWalker-v3")


def reference():
    from bipedal_walker_reference import Actions

    return Actions(PLAN.kind, PLAN.action_seed), ()


@pytest.mark.parametrize("order", coexistence.ORDERS)
def test_bits_stay_and_nothing_is_shared(order, tmp_path):
    from bipedal_walker_reference import play
    from gymnasium_reference import Session, hashes

    (alone,) = play(Session("BipedalWalker-v3", {}, [PLAN]))
    expected = hashes(alone.rows[: STEPS + 1]).tolist()
    ours, gymnasiums, report = coexistence.run(__file__, order, tmp_path)
    assert gymnasiums == expected
    assert ours == expected
    # Matches file names only, because any folder may be called walker_sim_something.
    our_file, their_file = r"\S*walker_sim_[^/\s]* ", r"\S*_Box2D[^/\s]* "
    crossing = re.compile(rf"file ({our_file}.*to {their_file}|{their_file}.*to {our_file})")
    engine = re.compile(r"`_Z\w*\db2")
    assert [line for line in report if crossing.search(line) and engine.search(line)] == []


if __name__ == "__main__":
    coexistence.program(sys.argv[1], load_ours, load_gymnasiums, reference, PLAN.seed, STEPS)
