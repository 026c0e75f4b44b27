"""hash prints the values of docs/reliability.md with any kernel and C library.

commands_ros_test.py has any number of walkers.
"""

import platform

import numpy as np
import pytest
from reference_hashes import HASHES, HASHES_WITHOUT_FMA, KERNELS, STEPS
from walker_sim.commands.hash import NUM_WALKERS, reference_hash
from walker_sim.commands.options import InputError
from walker_sim.in_process import InProcessWalkers
from walkers import IDS, run_python


def printed_with(**variables):
    """Runs the command in a new process, which selects kernel and library functions at its start.
    Returns the lines of the hashes."""
    program = f"from walker_sim.commands import main\nmain(['hash', '--steps', '{STEPS}'])"
    return run_python(program, **variables)[0].splitlines()[1:]


@pytest.mark.parametrize("kernel", KERNELS)
def test_hashes_are_the_documented_ones_with_any_kernel(kernel):
    lines = printed_with(WALKER_SIM_KERNEL=kernel)
    assert {line.split()[1].rstrip(","): line.split()[0] for line in lines} == HASHES[STEPS]
    assert set(HASHES[STEPS]) == set(IDS)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="there is one variant on others")
def test_libm_without_fma_has_its_documented_hashes():
    """GLIBC_TUNABLES hides the processor's FMA from glibc."""
    hidden = "-FMA,-AVX2,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable"
    found = {}
    for line in printed_with(GLIBC_TUNABLES=f"glibc.cpu.hwcaps={hidden}"):
        digest, environment_id, engine = line.split(maxsplit=2)
        found[environment_id.rstrip(",")] = digest
        assert engine.endswith(", libm: no fma") == engine.startswith("MuJoCo")
    assert found == {**HASHES[STEPS], **HASHES_WITHOUT_FMA[STEPS]}
    assert len(HASHES_WITHOUT_FMA[STEPS]) == 4


def test_one_bit_changes_the_hash():
    hashes = set()
    for scale in (0.005, np.nextafter(0.005, 1)):
        changed = {"reset_noise_scale": scale}
        walkers = InProcessWalkers("Hopper-v5", changed, NUM_WALKERS, 1, "next_step")
        hashes.add(reference_hash(walkers, 150))
    assert len(hashes) == 2


def test_error_names_failed_walker(monkeypatch):
    walkers = InProcessWalkers("BipedalWalker-v3", {}, 2, 1, "next_step")
    monkeypatch.setattr(walkers, "error", lambda row: "broken" if row == 1 else "")
    with pytest.raises(InputError, match="BipedalWalker-v3: walker 1, step 1: broken"):
        reference_hash(walkers, 5)
