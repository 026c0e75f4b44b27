"""On a processor without AVX, emulated by QEMU, Walker2d and Hopper raise an error that explains
it, and BipedalWalker runs."""

import os
import platform
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(platform.machine() != "x86_64", reason="AVX is x86-64's")

REFUSAL = "MuJoCo's library needs a processor with AVX"
PLAY = """
import sys, gymnasium, walker_sim
env = gymnasium.make(sys.argv[1])
env.reset(seed=1)
for _ in range(20):
    env.step(env.action_space.sample())
envs = walker_sim.WalkerVectorEnv(env.spec.name + "-v3", 20)
envs.reset(seed=1)
for _ in range(20):
    envs.step(envs.action_space.sample())
print("played")
"""


def emulated(*command, **options):
    """Runs the command on an emulated processor of 2008."""
    command = ["qemu-x86_64", "-cpu", "Nehalem", *command]
    # OpenBLAS, NumPy's library, would otherwise use the instructions of the named processor.
    environment = {name: os.environ[name] for name in os.environ if name != "OPENBLAS_CORETYPE"}
    return subprocess.run(command, capture_output=True, text=True, env=environment, **options)


def test_box2d_runs():
    done = emulated(sys.executable, "-c", PLAY, "walker_sim/BipedalWalker-v3")
    assert (done.returncode, done.stdout) == (0, "played\n"), done.stderr


@pytest.mark.parametrize("environment_id", ["Walker2d-v5", "Hopper-v4"])
def test_mujoco_is_refused_in_python(environment_id):
    done = emulated(sys.executable, "-c", PLAY, f"walker_sim/{environment_id}")
    assert done.returncode == 1, done.stderr
    assert f"RuntimeError: {REFUSAL}" in done.stderr


def test_mujoco_is_refused_in_cpp():
    describe = os.path.join(os.environ["WALKER_SIM_PROGRAMS"], "describe")
    done = emulated(describe, "Walker2d-v5")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"describe: {REFUSAL}")
