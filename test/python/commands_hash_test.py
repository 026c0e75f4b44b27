"""hash prints the values of docs/reliability.md with any kernel, C library and pool."""

import functools
import os
import platform
import subprocess
import sys

import numpy as np
import pytest
from reference_hashes import HASHES, HASHES_WITHOUT_FMA, STEPS
from walker_sim.commands.hash import NUM_WALKERS, reference_hash
from walker_sim.commands.options import InputError
from walker_sim.in_process import InProcessWalkers
from walkers import IDS

SHORT = 150  # steps per environment in tests that compare two runs


def printed_with(**variables):
    """Runs the command in a new process, which selects kernel and library functions at its start.
    Returns the lines of the hashes."""
    done = subprocess.run(
        [sys.executable, "-m", "walker_sim", "hash", "--steps", str(STEPS)],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()[1:]


@functools.lru_cache(maxsize=None)
def short_hash(environment_id, num_envs=NUM_WALKERS, num_threads=1):
    walkers = InProcessWalkers(environment_id, {}, num_envs, num_threads, "next_step")
    return reference_hash(walkers, SHORT)


def test_hashes_are_the_documented_ones(command):
    lines = command("hash", "--steps", STEPS).out.splitlines()[1:]
    assert {line.split()[1].rstrip(","): line.split()[0] for line in lines} == HASHES[STEPS]
    assert set(HASHES[STEPS]) == set(IDS)


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize(("num_envs", "num_threads"), [(1, 1), (3, 2), (16, 4), (40, 2)])
def test_hash_does_not_depend_on_num_envs_or_threads(environment_id, num_envs, num_threads):
    assert short_hash(environment_id, num_envs, num_threads) == short_hash(environment_id)


@pytest.mark.parametrize("kernel", ["off", "sse2", "avx2", "avx512"])
def test_hash_does_not_depend_on_the_kernel(kernel):
    lines = printed_with(WALKER_SIM_KERNEL=kernel)
    assert [line.split()[0] for line in lines] == [*HASHES[STEPS].values()]


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
    changed = {"reset_noise_scale": np.nextafter(0.005, 1)}
    walkers = InProcessWalkers("Hopper-v5", changed, NUM_WALKERS, 1, "next_step")
    assert reference_hash(walkers, SHORT) != short_hash("Hopper-v5")


def test_error_names_failed_walker(monkeypatch):
    walkers = InProcessWalkers("BipedalWalker-v3", {}, 2, 1, "next_step")
    monkeypatch.setattr(walkers, "error", lambda row: "broken" if row == 1 else "")
    with pytest.raises(InputError, match="BipedalWalker-v3: walker 1, step 1: broken"):
        reference_hash(walkers, 5)
