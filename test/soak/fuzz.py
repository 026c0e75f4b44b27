"""Runs scripts/dev/fuzz for the part's time, in equal shares for all targets."""

import contextlib
import os
import pathlib
import re
import signal
import subprocess

from graph import ROOT

MIN_SECONDS = 60  # a shorter part is left out, because the build takes longer


def prepare(seconds):
    """Builds the targets before the other parts load the processors. `run` reports a failure."""
    if seconds >= MIN_SECONDS:
        with started("--build") as script:
            script.communicate()


def fuzz(soak):
    if soak.seconds < MIN_SECONDS:
        soak.leave_out(f"its share is below {MIN_SECONDS} s")
        return
    targets = [*(ROOT / "test" / "fuzz").glob("*_fuzz.cpp")]
    seconds = max(1, round(soak.seconds / len(targets)))
    with started("--seconds", str(seconds)) as script:
        # With autogroup scheduling, the session would otherwise get as much as everything else.
        with contextlib.suppress(OSError):
            nice = pathlib.Path(f"/proc/{script.pid}/autogroup")
            nice.write_text(str(os.nice(0)), encoding="ascii")
        output = script.communicate()[0]
    soak.check("it finds nothing", script.returncode == 0, output[-4000:])
    reports = re.findall(r"^(\w+) +(\d+) inputs +(\d+) edges", output, re.MULTILINE)
    soak.check("every target reports", len(reports) == len(targets), output[-4000:])
    for name, inputs, edges in reports:
        soak.figure(f"{name}, {seconds} s", f"{int(inputs):,} inputs, {edges} edges")


@contextlib.contextmanager
def started(*arguments):
    """Starts the script in its own process group, so that no fuzzer outlives an ended soak."""
    script = subprocess.Popen(
        [str(ROOT / "scripts" / "dev" / "fuzz"), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        yield script
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(script.pid, signal.SIGKILL)
