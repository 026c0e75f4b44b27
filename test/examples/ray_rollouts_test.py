"""examples/ray_rollouts.py: rollouts do not depend on the number of actors; no process remains."""

import pathlib
import time

import gymnasium
import numpy as np
import pytest
import walker_sim  # noqa: F401  # registers the walkers
from running import assert_helps, ray_home, run_example, short_folder, start_example

NAMES = {"observations", "actions", "rewards", "terminated", "truncated", "is_step"}
WALKERS = 5
STEPS = 120


@pytest.fixture(scope="module")
def home():
    with short_folder() as folder:
        yield folder


def test_help(home):
    assert_helps("ray_rollouts", home)


def collect(home, *arguments):
    sizes = ("--walkers", WALKERS, "--steps", STEPS)
    text = run_example("ray_rollouts", *sizes, *arguments, folder=home, **ray_home(home))
    assert f" steps of {WALKERS} walkers by " in text
    with np.load(home / "rollouts.npz") as arrays:
        return dict(arrays)


def processes_with(words):
    lines = []
    for process in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = process.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue  # the process has exited
        if words in line:
            lines.append(line)
    return lines


def same(one, other):
    return all(np.array_equal(one[name], other[name]) for name in NAMES)


def test_equal_numbers_for_equal_seeds(home):
    few = collect(home, "--actors", 1)
    many = collect(home, "--actors", 3)
    other = collect(home, "--actors", 1, "--seed", 2)
    assert few.keys() == many.keys() == NAMES
    assert few["observations"].shape == (STEPS + 1, WALKERS, 24)
    assert few["actions"].shape == (STEPS, WALKERS, 4)
    assert same(few, many)
    assert not same(few, other)


def test_rows_are_what_happened(home):
    rollouts = collect(home, "--actors", 2, "--env", "walker_sim/Walker2d-v5")
    ended = rollouts["terminated"] | rollouts["truncated"]
    assert ended.any()
    assert rollouts["is_step"][0].all()
    assert np.array_equal(rollouts["is_step"][1:], ~ended[:-1])
    walker = gymnasium.make("walker_sim/Walker2d-v5")
    for column in range(WALKERS):
        observation, _ = walker.reset(seed=1 + column)
        for row in range(ended[:, column].argmax() + 1):
            assert np.array_equal(rollouts["observations"][row, column], observation)
            action = rollouts["actions"][row, column]
            observation, reward, terminated, _, _ = walker.step(action)
            assert rollouts["rewards"][row, column] == reward
            assert rollouts["terminated"][row, column] == terminated


def test_leaves_nothing_running(home):
    arguments = ("--walkers", 2, "--actors", 1, "--steps", 200)
    seen = set()
    with start_example("ray_rollouts", *arguments, folder=home, **ray_home(home)) as process:
        while process.poll() is None:
            seen.update(processes_with(str(home)))
            time.sleep(0.05)
        assert process.returncode == 0, process.stdout.read()
    assert any("raylet" in line for line in seen), "the search must find what runs"
    assert processes_with(str(home)) == []


def test_more_actors_than_walkers(home):
    text = run_example(
        "ray_rollouts", "--walkers", 2, "--actors", 3, folder=home, status=2, **ray_home(home)
    )
    assert "--actors 3: must be from 1 to --walkers, 2" in text


def test_no_steps(home):
    text = run_example("ray_rollouts", "--steps", 0, folder=home, status=2, **ray_home(home))
    assert "--steps 0: collects nothing; must be at least 1" in text
