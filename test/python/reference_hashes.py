"""What docs/reliability.md says that `python3 -m walker_sim hash` prints."""

import pathlib
import re

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "reliability.md"


def documented():
    """By steps of each walker and by id."""
    hashes = {}
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        head = re.fullmatch(r"walker_sim \S+, run 1: 16 x ([0-9,]+) steps", line)
        if head:
            steps = int(head[1].replace(",", ""))
        found = re.match(r"([0-9a-f]{64})  (\S+), ", line)
        if found:
            hashes.setdefault(steps, {})[found[2]] = found[1]
    return hashes


HASHES = documented()
STEPS = min(HASHES)
