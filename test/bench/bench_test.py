"""The benchmark runs, in slices of 0.1 s and without EnvPool. No test depends on speed."""

import json
import os
import pathlib
import subprocess
import sys

import pytest
from bench import SECTIONS
from report import TABLES

BENCH = pathlib.Path(__file__).with_name("bench.py")
PATIENCE = 240  # [s]


def run(folder, *arguments):
    command = [sys.executable, BENCH, "--programs", os.environ["WALKER_SIM_PROGRAMS"], "--quick"]
    command += ["--output", folder, "--without", "envpool", "--without", "plot", *arguments]
    return subprocess.run(command, capture_output=True, encoding="utf-8", timeout=PATIENCE)


def rows_in(folder):
    return json.loads((folder / "bench.json").read_text())["rows"]


def test_measures_every_section(tmp_path):
    done = run(tmp_path)
    rows = rows_in(tmp_path)
    assert [row["error"] for row in rows if row["error"]] == []
    assert done.returncode == 0, done.stderr
    assert {row["section"] for row in rows} == set(SECTIONS)
    assert all(value > 0 for row in rows for value in row["values"])
    for section, (title, *_) in TABLES.items():
        assert (title in done.stdout) == (section in SECTIONS)


# Fake programs print the kernel of a processor, and 11 steps if WALKER_SIM_KERNEL is set.
@pytest.mark.parametrize(
    ("kernel", "steps"),
    [
        ("${WALKER_SIM_KERNEL:-avx512}", {"": 1, ", avx2": 11, ", sse2": 11}),
        ("${WALKER_SIM_KERNEL:-avx2}", {"": 1, ", sse2": 11}),
        ("sse2", {"": 1}),
        ("library", {"": 1}),
    ],
)
def test_measures_each_supported_kernel_once(tmp_path, monkeypatch, kernel, steps):
    slice_ = '"steps": ${WALKER_SIM_KERNEL:+1}1, "seconds": 1, "processor_seconds": 1'
    programs = {
        "describe": f"Box2D, stepped by the {kernel}",
        "walker_sim_benchmark": f'{{"num_envs": ${{7:-1}}, {slice_}}}'.replace('"', '\\"'),
    }
    for name, answer in programs.items():
        (tmp_path / name).write_text(f'#!/bin/sh\necho "{answer}"\n')
        (tmp_path / name).chmod(0o755)
    monkeypatch.delenv("WALKER_SIM_KERNEL", raising=False)
    done = run(tmp_path, "--only", "core", "--without", "gymnasium", "--programs", tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [row for row in rows_in(tmp_path) if row["environment"] == "BipedalWalker-v3"]
    many = [(row["side"], row["median"]) for row in rows]
    expected = {"pool, 16": 1, "single": 1, **{f"pool, 64{k}": n for k, n in steps.items()}}
    assert sorted(many) == sorted(expected.items())


def test_error_names_failed_measurement(tmp_path):
    done = run(tmp_path, "--only", "reset", "--programs", tmp_path)
    assert done.returncode == 1
    assert "FAILED reset, BipedalWalker-v3 walker_sim: " in done.stderr
    assert "walker_sim_benchmark" in done.stderr
    assert "failed" in done.stdout
    assert "Gymnasium" in done.stdout


def test_policies_walk_over_ros(tmp_path):
    done = run(tmp_path, "--only", "policies")
    rows = rows_in(tmp_path)
    assert [row["error"] for row in rows if row["error"]] == [], done.stderr
    assert [len(row["slices"]) for row in rows] == [2] * 12  # seeds; six walkers in two modes


@pytest.mark.parametrize(
    ("sections", "status", "message"),
    [
        ("training", 1, "Stable-Baselines3 is not installed"),
        ("core,cores", 2, "--only cores: must be among core, pool"),
    ],
)
def test_error_names_section(tmp_path, sections, status, message):
    done = run(tmp_path, "--only", sections)
    assert done.returncode == status
    assert message in done.stderr
