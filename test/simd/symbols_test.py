"""No code compiled for one instruction set is shared with another: of functions that several files
define, the linker keeps one, perhaps one that this processor cannot run."""

import os
import pathlib
import platform
import re
import subprocess

import pytest

pytestmark = pytest.mark.skipif(
    platform.machine() != "x86_64", reason="there are kernels for x86-64 alone"
)

OBJECTS = [
    pathlib.Path(name) for name in os.environ["WALKER_SIM_KERNEL_OBJECTS"].split(":") if name
]


def name_of(file):
    """Returns a name such as hopper/kernel/kernel_avx2.cpp.o."""
    return "/".join(file.parts[-3:])


def test_each_kernel_has_an_object():
    sets = {
        "hopper": ("sse2", "avx2"),
        "walker2d": ("sse2", "avx2"),
        "bipedal_walker": ("sse2", "avx2", "avx512"),
    }
    assert sorted(map(name_of, OBJECTS)) == sorted(
        f"{robot}/kernel/kernel_{name}.cpp.o" for robot in sets for name in sets[robot]
    )


@pytest.mark.parametrize("file", OBJECTS, ids=name_of)
def test_what_is_shared_has_the_kernels_name(file):
    instruction_set = re.fullmatch(r"kernel_(\w+)\.cpp\.o", file.name)[1]
    command = ["nm", "--defined-only", "--demangle", file]
    listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    shared = [line for line in listed if re.match(r"[0-9a-f]* [TWVuBD] ", line)]
    assert len(shared) > 5, "else the listing was not understood"
    # Constants contain no instructions.
    strange = [line for line in shared if instruction_set not in line and "::model::" not in line]
    assert strange == []
