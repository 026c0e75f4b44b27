"""With floating-point traps enabled, no comparison with NaN, the value of absent infos, raises
SIGFPE. Users enable the traps to find NaNs in their own code."""

import os
import signal
import subprocess
import sys

import pytest
from walkers import IDS

PROGRAM = """
import ctypes, ctypes.util, sys
import numpy as np
import gymnasium
import walker_sim
FE_INVALID = 1  # on x86 and on ARM
libm = ctypes.CDLL(ctypes.util.find_library("m"))
libm.feenableexcept(FE_INVALID)
{setup}
{calls}
print("done")
"""

SINGLE = """
env = walker_sim.WalkerEnv("{env_id}")
actions = np.zeros(env.action_space.shape, np.float32)
"""
VECTOR = """
env = walker_sim.WalkerVectorEnv(
    "{env_id}", num_envs=4, num_threads=2, max_episode_steps=4, autoreset_mode="{mode}")
actions = np.zeros(env.action_space.shape, np.float32)
"""
ROS = """
sys.path.insert(0, {folder!r})
import fake_server
server = fake_server.FakeServer()
nan = float("nan")
server.answers["reset_batch"] = fake_server.batch_reset(info=[nan] * (2 * fake_server.INFO))
server.answers["step_batch"] = fake_server.batch_step(info=[nan] * (2 * fake_server.INFO))
env = walker_sim.WalkerVectorEnv(
    fake_server.ENV, num_envs=2, autoreset_mode="same_step", transport="ros",
    master_uri=server.master_uri)
actions = np.zeros(env.action_space.shape, np.float32)
"""
PLAY = """
env.reset(seed=1)
for _ in range(10):
    env.step(actions)
"""
TURNS = """
for _ in range(3):
    env.reset(seed=1)
    env.step(actions)
"""
STATES = """
env.set_state(env.get_state())
env.step(actions)
"""


def check(setup, calls=PLAY, **fields):
    program = PROGRAM.format(setup=setup.format(**fields), calls=calls)
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr


@pytest.mark.parametrize("env_id", IDS)
def test_one_walker(env_id):
    check(SINGLE, PLAY + STATES, env_id=env_id)


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
@pytest.mark.parametrize("env_id", IDS)
def test_many_walkers(env_id, mode):
    check(VECTOR, PLAY + STATES, env_id=env_id, mode=mode)


def test_over_ros():
    check(ROS, TURNS, folder=os.path.dirname(__file__))


def test_nan_parameters():
    calls = """
for keywords in (
    {"ctrl_cost_weight": np.nan},
    {"healthy_z_range": (np.nan, 2.0)},
    {"transport": "ros", "timeout": np.nan},
):
    try:
        walker_sim.WalkerEnv("Walker2d-v5", **keywords)
    except ValueError:
        continue
    sys.exit(f"{keywords}: taken")
"""
    check("", calls)


def test_the_traps_are_enabled():
    program = PROGRAM.format(setup="", calls="np.float64(np.inf) - np.float64(np.inf)")
    done = subprocess.run([sys.executable, "-c", program], stderr=subprocess.DEVNULL)
    assert done.returncode == -signal.SIGFPE
