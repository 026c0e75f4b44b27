"""Hashes that docs/reliability.md documents for `python3 -m walker_sim hash` on this machine."""

import os
import pathlib
import re

from walker_sim import _core
from walker_sim.walkers import variant_of

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "reliability.md"


def documented():
    """Returns the hashes by steps and id: with FMA, and those that differ without FMA."""
    hashes, without_fma = {}, {}
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        head = re.fullmatch(r"walker_sim \S+, run 1: 16 x ([0-9,]+) steps", line)
        if head:
            steps = int(head[1].replace(",", ""))
        found = re.match(r"([0-9a-f]{64})  (\S+), ", line)
        if found:
            hashes.setdefault(steps, {})[found[2]] = found[1]
        found = re.fullmatch(r"\| (\S+) \| ([0-9,]+) \| `([0-9a-f]{64})` \|", line)
        if found:
            without_fma.setdefault(int(found[2].replace(",", "")), {})[found[1]] = found[3]
    return hashes, without_fma


def kernels():
    """Returns the values of WALKER_SIM_KERNEL that this processor supports, as the refusal of
    another one names them."""
    before = os.environ.get("WALKER_SIM_KERNEL", "")
    os.environ["WALKER_SIM_KERNEL"] = "another"
    try:
        _core.Pool("BipedalWalker-v3", {})
    except ValueError as error:
        return ["", *re.search("must be one of (.+), or not set", str(error))[1].split(", ")]
    finally:
        os.environ["WALKER_SIM_KERNEL"] = before


KERNELS = kernels()
HASHES, HASHES_WITHOUT_FMA = documented()
STEPS = min(HASHES)
if variant_of(_core.Pool("Walker2d-v5", {}).specification["engine_version"], "libm") == "no fma":
    HASHES = {steps: {**HASHES[steps], **HASHES_WITHOUT_FMA[steps]} for steps in HASHES}
