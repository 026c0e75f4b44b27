"""The shortest soak: every part makes a round, and its checks can fail."""

import os
import pathlib
import re
import subprocess
import sys
import time

import numpy as np
import pytest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE))
import tally as tallies  # noqa: E402
import usage  # noqa: E402

COMMAND = [
    *(sys.executable, HERE / "soak.py", "--seed", "1"),
    *("--programs", os.environ["WALKER_SIM_PROGRAMS"]),
]


def test_every_part_passes(tmp_path):
    report = tmp_path / "soak.md"
    done = subprocess.run(
        [*COMMAND, "--hours", "0.004", "--output", report],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    failures = [line for line in done.stdout.splitlines() if "FAILED" in line]
    assert done.returncode == 0, "\n".join([*failures, done.stdout])
    assert re.fullmatch(r"\d+ passed, 0 failed(, \d+ left out)?", done.stdout.splitlines()[-1])
    text = report.read_text(encoding="utf-8")
    assert text.rstrip().endswith(done.stdout.splitlines()[-1])
    assert str(HERE.parents[1]) not in text and os.uname().nodename not in text


def test_interrupted_soak_reports_its_results(tmp_path):
    report = tmp_path / "soak.md"
    soak = subprocess.Popen(
        [*COMMAND, "--output", report, "--only", "many_subscribers", "many_environments"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert soak.stderr.readline().startswith("seed 1")
    time.sleep(3)
    soak.terminate()
    output = soak.communicate()[0]
    assert soak.returncode == 1
    assert re.fullmatch(r"\d+ passed, 1 failed", output.strip())
    assert "interrupted" in report.read_text(encoding="utf-8")
    end = time.monotonic() + 30
    with pytest.raises(ProcessLookupError):  # no process of its group is left
        while time.monotonic() < end:
            os.killpg(soak.pid, 0)
            time.sleep(0.1)


def test_one_failed_check_of_many_counts():
    printed = []
    tally = tallies.Tally(printed.append)
    tally.part = "part"
    for is_met in (True, False, True):
        tally.check("a thing", is_met, "why")
    tally.check("another", True)
    assert tally.summary() == "1 passed, 1 failed"
    assert printed == ["  FAILED part: a thing: why"]
    assert "| part | a thing | 3 | 1 |" in tallies.markdown(tally, {"seed": 1})


@pytest.mark.parametrize(("rate", "is_flat"), [(0.0, True), (0.2, False)])
def test_leak_is_distinguished_from_noise(rate, is_flat):
    """The leak has `rate` [MiB/s] over a minute, in a heap that fluctuates."""
    watched = usage.Usage(os.getpid())
    noise = np.random.default_rng(1)
    for at in np.arange(0, 60, 0.2):
        resident = usage.MIB * (40 + rate * at + noise.uniform(-0.5, 0.5))
        watched._samples.append((at, resident, 10, 3))
    assert (watched.growth() < usage.MAX_GROWTH) == is_flat


@pytest.mark.parametrize("seconds", [0, 20, 120])
def test_memory_is_not_judged_after_a_short_time(seconds):
    watched, tally = usage.Usage(os.getpid()), tallies.Tally(lambda text: None)
    watched._samples = [(at, at * usage.MIB, 10, 3) for at in range(seconds)]
    watched.check(tally, "a server")
    assert tally.failed == (seconds > usage.MIN_DURATION)


def test_growing_latency_is_found(monkeypatch):
    monkeypatch.setattr(usage, "MIN_DURATION", 0.0)
    for grows in (False, True):
        latency = usage.Latency()
        latency._times = [1e-4 * (1 + grows * i / 2000) for i in range(10000)]
        tally = tallies.Tally(lambda text: None)
        latency.check(tally, "a call")
        assert tally.failed == grows
