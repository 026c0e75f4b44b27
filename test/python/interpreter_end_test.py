"""If Python exits while a daemon thread is inside a call of the core, the exit status is 0."""

import os
import subprocess
import sys

import pytest

REPEATS = 3

# The threads repeat the same call forever while the main thread exits.
PROGRAM = """
import threading
import numpy as np
import walker_sim
{setup}
seen = threading.Semaphore(0)
def run():
    while True:
        {call}
        seen.release()
for _ in range({threads}):
    threading.Thread(target=run, daemon=True).start()
{until}
"""

SINGLE = """
env = walker_sim.WalkerEnv("{env_id}", {keywords})
env.reset(seed=1)
action = np.zeros(env.action_space.shape)
def step():
    _, _, terminated, *_ = env.step(action)
    if terminated:
        env.reset()
"""
VECTOR = """
env = walker_sim.WalkerVectorEnv("{env_id}", num_envs=6, num_threads=2, {keywords})
env.reset(seed=1)
actions = np.zeros(env.action_space.shape)
"""
POOL = """
env = walker_sim.WalkerVectorEnv("{env_id}", num_envs=6, num_threads=3, batch_size=2)
env.async_reset(seed=1)
def turn():
    observations, *_, infos = env.recv()
    env.send(np.zeros((2, *env.single_action_space.shape)), infos["env_id"])
"""
ROS = """
import sys
sys.path.insert(0, {folder!r})
from fake_server import ENV, NUM_ENVS, FakeServer
server = FakeServer()
env = walker_sim.WalkerVectorEnv(
    ENV, num_envs=NUM_ENVS, autoreset_mode="same_step", transport="ros",
    master_uri=server.master_uri)
env.reset(seed=1)
actions = np.zeros(env.action_space.shape)
"""


def check(call, setup, threads=1, until="for _ in range(3): seen.acquire()", **fields):
    """Runs several processes concurrently, so that the exit hits threads at different points."""
    setup = setup.format(**{"keywords": "", "folder": os.path.dirname(__file__), **fields})
    program = PROGRAM.format(setup=setup, call=call, threads=threads, until=until)
    running = [
        subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True)
        for _ in range(REPEATS)
    ]
    ends = [(process.communicate()[1], process.returncode) for process in running]
    assert ends == [("", 0)] * REPEATS


@pytest.mark.parametrize("env_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_a_step(env_id):
    check("step()", SINGLE, env_id=env_id)


def test_steps_of_threads_that_share_a_walker():
    check("step()", SINGLE, threads=4, env_id="Walker2d-v5")


def test_a_reset():
    check("env.reset()", SINGLE, env_id="BipedalWalker-v3")


def test_a_vector_step():
    check("env.step(actions)", VECTOR, env_id="Walker2d-v5")


def test_recv():
    check("turn()", POOL, env_id="BipedalWalker-v3")


@pytest.mark.parametrize("env_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_a_picture(env_id):
    check("env.render()", SINGLE, env_id=env_id, keywords="render_mode='rgb_array'")


def test_a_step_over_ros():
    check("env.reset(); env.step(actions)", ROS)


def test_a_call_over_ros_that_is_never_answered():
    check("server.may_answer.clear(); env.step(actions)", ROS, until="server.asked.wait()")
