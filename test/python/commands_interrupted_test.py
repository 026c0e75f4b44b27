"""An interrupted evaluate leaves only complete lines of completed episodes."""

import csv
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest
from walker_sim.commands import main

ID = "Walker2d-v5"
PATIENCE = 60.0  # timeout that only a failing test reaches [s]


def rows_of(path):
    text = path.read_text()
    assert text.endswith("\n")
    return [*csv.DictReader(text.splitlines())]


def walk_slowly(observation):
    time.sleep(0.001)
    return [0.0] * 6


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "killed"])
def test_the_episodes_that_have_ended_are_kept(tmp_path, number):
    path = tmp_path / "returns.csv"
    policy = f"{__name__}:walk_slowly"
    options = ["--policy", policy, "--csv", str(path), "--json", str(tmp_path / "summary.json")]
    here = str(pathlib.Path(__file__).parent)
    process = subprocess.Popen(
        [sys.executable, "-m", "walker_sim", "evaluate", ID, "--seeds", "0:100000", *options],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([here, os.environ["PYTHONPATH"]])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        end = time.monotonic() + PATIENCE
        while not path.exists() or path.read_text().count("\n") < 21:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < end
            time.sleep(0.01)
        process.send_signal(number)
        out, error = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    kept = rows_of(path)
    assert 20 <= len(kept) < 100000
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert error == f"{path}: {len(kept)} of 100000 episodes\ninterrupted\n"
        assert out == ""
    seeds = [int(row["seed"]) for row in kept]
    assert len({*seeds}) == len(seeds)
    # The kept rows equal those of an uninterrupted run with the same seeds.
    whole = tmp_path / "whole.csv"
    words = [",".join(map(str, sorted(seeds[:20]))), "--policy", "zero", "--csv", str(whole)]
    assert main(["evaluate", ID, "--seeds", *words]) == 0
    assert rows_of(whole) == sorted(kept[:20], key=lambda row: int(row["seed"]))


def test_a_file_that_was_there_is_written_anew(tmp_path):
    path = tmp_path / "returns.csv"
    path.write_text("something much longer\n" * 1000)
    assert main(["evaluate", ID, "--seeds", "3,1,2", "--csv", str(path)]) == 0
    assert [row["seed"] for row in rows_of(path)] == ["3", "1", "2"]


def test_a_pipe_gets_all_at_last(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    command = ["evaluate", ID, "--seeds", "3,1,2", "--csv", str(path)]
    process = subprocess.Popen([sys.executable, "-m", "walker_sim", *command])
    try:
        with path.open() as file:
            rows = [*csv.DictReader(file)]
        assert process.wait(PATIENCE) == 0
    finally:
        process.kill()
    assert [row["seed"] for row in rows] == ["3", "1", "2"]
