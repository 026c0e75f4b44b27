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

RENDERED = "render_mode='rgb_array'"
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
def receive_and_send():
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


@pytest.mark.parametrize(
    ("setup", "call", "options"),
    [
        (SINGLE, "step()", {"env_id": "BipedalWalker-v3"}),
        (SINGLE, "step()", {"env_id": "Walker2d-v5"}),
        (SINGLE, "step()", {"env_id": "Walker2d-v5", "threads": 4}),
        (SINGLE, "env.reset()", {"env_id": "BipedalWalker-v3"}),
        (SINGLE, "env.render()", {"env_id": "BipedalWalker-v3", "keywords": RENDERED}),
        (SINGLE, "env.render()", {"env_id": "Walker2d-v5", "keywords": RENDERED}),
        (VECTOR, "env.step(actions)", {"env_id": "Walker2d-v5"}),
        (POOL, "receive_and_send()", {"env_id": "BipedalWalker-v3"}),
        (ROS, "env.reset(); env.step(actions)", {}),
        (ROS, "server.may_answer.clear(); env.step(actions)", {"until": "server.asked.wait()"}),
    ],
)
def test_exit_during(setup, call, options):
    check(call, setup, **options)
