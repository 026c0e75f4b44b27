"""The benchmark's sections run in slices of 0.1 s and without EnvPool. No test depends on speed."""

import json
import os
import pathlib
import subprocess
import sys

import pytest
from bench import SECTIONS
from report import TABLES
from targets import BIPEDAL

BENCH = pathlib.Path(__file__).with_name("bench.py")
PATIENCE = 240  # [s]


def run(folder, *arguments):
    command = [sys.executable, BENCH, "--programs", os.environ["WALKER_SIM_PROGRAMS"], "--quick"]
    command += ["--output", folder, "--without", "envpool", "--without", "plot", *arguments]
    return subprocess.run(command, capture_output=True, encoding="utf-8", timeout=PATIENCE)


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    done = run(folder)
    return done, json.loads((folder / "bench.json").read_text())


def test_everything_is_measured(everything):
    done, written = everything
    assert [row["error"] for row in written["rows"] if row["error"]] == []
    assert done.returncode == 0, done.stderr
    assert {row["section"] for row in written["rows"]} == set(SECTIONS)
    assert all(value > 0 for row in written["rows"] for value in row["values"])
    for table in TABLES:
        assert (table.title in done.stdout) == (table.section in SECTIONS)


def test_what_needs_no_envpool_is_judged(everything):
    judged = {target["target"]: target["verdict"] for target in everything[1]["targets"]}
    for what, verdict in judged.items():
        assert (verdict == "not measured") == ("EnvPool" in what), (what, verdict)


# Fake programs print the kernel of a processor, and 11 steps if WALKER_SIM_KERNEL is set.
@pytest.mark.parametrize(
    ("kernel", "steps"),
    [
        ("${WALKER_SIM_KERNEL:-avx512}", {"": 1, ", avx2": 11, ", sse2": 11}),
        ("${WALKER_SIM_KERNEL:-avx2}", {"": 1, ", avx2": 1, ", sse2": 11}),
        ("sse2", {"": 1, ", sse2": 1}),
        ("library", {"": 1}),
    ],
)
def test_each_kernel_that_the_processor_has_is_measured_once(tmp_path, monkeypatch, kernel, steps):
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
    rows = json.loads((tmp_path / "bench.json").read_text())["rows"]
    many = [(row["side"], row["median"]) for row in rows if row["environment"] == BIPEDAL]
    expected = {"pool, 16": 1, "single": 1, **{f"pool, 64{k}": n for k, n in steps.items()}}
    assert sorted(many) == sorted(expected.items())


def test_what_cannot_be_measured_is_a_failure_that_names_it(tmp_path):
    done = run(tmp_path, "--only", "reset", "--programs", tmp_path)
    assert done.returncode == 1
    assert "FAILED reset, BipedalWalker-v3 walker_sim: " in done.stderr
    assert "walker_sim_benchmark" in done.stderr
    assert "failed" in done.stdout
    assert "Gymnasium" in done.stdout


def test_policies_walk_over_ros(tmp_path):
    done = run(tmp_path, "--only", "policies")
    rows = json.loads((tmp_path / "bench.json").read_text())["rows"]
    assert [row["error"] for row in rows if row["error"]] == [], done.stderr
    assert [len(row["slices"]) for row in rows] == [2] * 12  # seeds; six walkers in two modes


def test_without_its_learner_training_says_so(tmp_path):
    done = run(tmp_path, "--only", "training")
    assert done.returncode == 1
    assert "Stable-Baselines3 is not installed" in done.stderr


def test_an_unknown_section_is_refused(tmp_path):
    done = run(tmp_path, "--only", "core,cores")
    assert done.returncode == 2
    assert "--only cores: must be some of core, pool" in done.stderr
