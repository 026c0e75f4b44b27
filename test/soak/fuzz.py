"""scripts/fuzz for the time of the part, which each target has a share of."""

import contextlib
import os
import pathlib
import re
import signal
import subprocess

from graph import ROOT

LEAST = 60  # its build takes longer [s]
SCRIPT = str(ROOT / "scripts" / "fuzz")


def prepare(seconds):
    """Builds the targets, before the other parts take the processors. `run` tells of a failure."""
    if seconds >= LEAST:
        subprocess.run([SCRIPT, "--build"], stdout=subprocess.DEVNULL)


def run(soak):
    if soak.seconds < LEAST:
        soak.leave_out(f"its share is below {LEAST} s")
        return
    targets = [*(ROOT / "test" / "fuzz").glob("*_fuzz.cpp")]
    seconds = max(1, round(soak.seconds / len(targets)))
    # A group of its own, so that no fuzzer outlives a soak that is ended.
    script = subprocess.Popen(
        [SCRIPT, "--seconds", str(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    # Where the system first shares processors out among sessions, its own has as much as all else.
    with contextlib.suppress(OSError):
        pathlib.Path(f"/proc/{script.pid}/autogroup").write_text(str(os.nice(0)), encoding="ascii")
    try:
        output = script.communicate()[0]
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(script.pid, signal.SIGKILL)
    soak.check("it finds nothing", script.returncode == 0, output[-4000:])
    told = re.findall(r"^(\w+) +(\d+) inputs +(\d+) edges", output, re.MULTILINE)
    soak.check("every target tells what it did", len(told) == len(targets), output[-4000:])
    for name, inputs, edges in told:
        soak.figure(f"{name}, {seconds} s", f"{int(inputs):,} inputs, {edges} edges")
