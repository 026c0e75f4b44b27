"""scripts/fuzz for the time of the part, which each target has a share of."""

import re
import subprocess

from graph import ROOT

LEAST = 60  # its build takes longer [s]


def run(soak):
    if soak.seconds < LEAST:
        soak.leave_out(f"its share is below {LEAST} s")
        return
    targets = [*(ROOT / "test" / "fuzz").glob("*_fuzz.cpp")]
    seconds = max(1, round(soak.seconds / len(targets)))
    done = subprocess.run(
        [str(ROOT / "scripts" / "fuzz"), "--seconds", str(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    soak.check("it finds nothing", done.returncode == 0, done.stdout[-4000:])
    told = re.findall(r"^(\w+) +(\d+) inputs +(\d+) edges", done.stdout, re.MULTILINE)
    soak.check("every target tells what it did", len(told) == len(targets), done.stdout[-4000:])
    for name, inputs, edges in told:
        soak.figure(f"{name}, {seconds} s", f"{int(inputs):,} inputs, {edges} edges")
