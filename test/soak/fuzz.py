"""A part of the time for scripts/fuzz, where it is."""

import subprocess

from graph import ROOT

LEAST = 60  # its build takes as long [s]


def run(soak):
    script = ROOT / "scripts" / "fuzz"
    if not script.exists():
        soak.leave_out("there is no scripts/fuzz")
        return
    if soak.seconds < LEAST:
        soak.leave_out(f"its share is below {LEAST} s")
        return
    targets = len([*(ROOT / "test" / "fuzz").glob("*_fuzz.cpp")])  # each has so many seconds
    done = subprocess.run(
        [str(script), "--seconds", str(max(1, round(soak.seconds / max(1, targets))))],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    soak.check("it finds nothing", done.returncode == 0, done.stdout[-2000:])
