"""Programs in a new process: floating-point traps, exits during calls, and forks."""

import os
import signal
import subprocess
import sys

import pytest
from walkers import IDS, run_python

SINGLE = """
env = walker_sim.WalkerEnv("{env_id}", {keywords})
env.reset(seed=1)
actions = np.zeros(env.action_space.shape, np.float32)
def step():
    _, _, terminated, *_ = env.step(actions)
    if terminated:
        env.reset()
"""
VECTOR = """
env = walker_sim.WalkerVectorEnv("{env_id}", num_envs=6, num_threads=2, {keywords})
env.reset(seed=1)
actions = np.zeros(env.action_space.shape, np.float32)
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
from fake_server import ENV, INFO, NUM_ENVS, FakeServer, batch_reset, batch_step
server = FakeServer()
{answers}
env = walker_sim.WalkerVectorEnv(
    ENV, num_envs=NUM_ENVS, autoreset_mode="same_step", transport="ros",
    master_uri=server.master_uri)
env.reset(seed=1)
actions = np.zeros(env.action_space.shape, np.float32)
"""


def filled(setup, **fields):
    folder = os.path.dirname(__file__)
    return setup.format(**{"keywords": "", "answers": "", "folder": folder, **fields})


# ---------------------------------------------------------------- traps

TRAPS = """
import ctypes, ctypes.util, sys
import numpy as np
import walker_sim
FE_INVALID = 1  # on x86 and on ARM
libm = ctypes.CDLL(ctypes.util.find_library("m"))
libm.feenableexcept(FE_INVALID)
"""
PLAY = """
for _ in range(10):
    env.step(actions)
env.set_state(env.get_state())
env.step(actions)
"""


ANSWERS = """
info = [float("nan")] * (NUM_ENVS * INFO)
server.answers.update(reset_batch=batch_reset(info=info), step_batch=batch_step(info=info))
"""
TURNS = """
for _ in range(3):
    env.reset(seed=1)
    env.step(actions)
"""
NAN_PARAMETERS = """
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
LIMITED = 'max_episode_steps=4, autoreset_mode="{}"'
TRAPPED = {
    **{f"one {env_id}": filled(SINGLE, env_id=env_id) + PLAY for env_id in IDS},
    **{
        f"many {env_id} {mode}": filled(VECTOR, env_id=env_id, keywords=LIMITED.format(mode)) + PLAY
        for env_id in IDS
        for mode in ("next_step", "same_step")
    },
    "over ROS": filled(ROS, answers=ANSWERS) + TURNS,
    "parameters": NAN_PARAMETERS,
}


@pytest.mark.parametrize("program", TRAPPED.values(), ids=TRAPPED)
def test_traps(program):
    """With the traps enabled, no comparison with NaN, the value of absent infos, may raise SIGFPE.
    Users enable the traps to find NaNs in their own code."""
    assert run_python(f"{TRAPS}{program}\nprint('done')")[0] == "done\n"


def test_the_traps_are_enabled():
    run_python(f"{TRAPS}np.float64(np.inf) - np.float64(np.inf)", status=-signal.SIGFPE)


# ---------------------------------------------------------------- exits

# The threads repeat the same call forever while the main thread exits.
EXIT = """
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
ENDLESS = "terminate_when_unhealthy=False"  # no thread steps between another's end and reset
REPEATS = 3


@pytest.mark.parametrize(
    ("setup", "call", "options"),
    [
        (SINGLE, "step()", {"env_id": "BipedalWalker-v3"}),
        (SINGLE, "step()", {"env_id": "Walker2d-v5"}),
        (SINGLE, "step()", {"env_id": "Walker2d-v5", "keywords": ENDLESS, "threads": 4}),
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
    """If Python exits while a daemon thread is inside a call of the core, the exit status is 0.
    Several processes run concurrently, so that the exit hits threads at different points."""
    until = "for _ in range(3): seen.acquire()"
    fields = {"call": call, "threads": 1, "until": until, **options}
    program = EXIT.format(setup=filled(setup, **fields), **fields)
    running = [
        subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True)
        for _ in range(REPEATS)
    ]
    ends = [(process.communicate()[1], process.returncode) for process in running]
    assert ends == [("", 0)] * REPEATS


# ---------------------------------------------------------------- forks

# OpenGL's threads do not exist in a child if its parent has rendered.
FORKED = """
import os, sys
import gymnasium, numpy as np
import walker_sim

def make():
    env = gymnasium.make("walker_sim/{env_id}", render_mode="rgb_array")
    env.reset(seed=1)
    return env

def outcome_of(env):
    try:
        return env.render().shape[2]
    except RuntimeError as error:
        return str(error)

def in_child(call):
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        print(call())
        sys.exit(0)  # with all that an interpreter's end does
    assert os.waitpid(child, 0)[1] == 0

env = make()
"""
REFUSAL = "the parent process had drawn a picture before it forked this one"


def lines_of(calls, env_id="Walker2d-v5"):
    return run_python(FORKED.format(env_id=env_id) + calls)[0].splitlines()


def test_a_child_draws_if_its_parent_has_not():
    assert lines_of("in_child(lambda: outcome_of(env))\nprint(outcome_of(env))") == ["3", "3"]


def test_a_child_is_refused_if_its_parent_has_drawn():
    """Both the inherited and a new renderer refuse; the parent can still render."""
    calls = """
outcome_of(env)
in_child(lambda: outcome_of(env))
in_child(lambda: outcome_of(make()))
print(outcome_of(env))
"""
    seen = lines_of(calls)
    assert [line.startswith(REFUSAL) for line in seen] == [True, True, False], seen
    assert seen[-1] == "3"


def test_steps_and_cairos_pictures_work_after_a_fork():
    calls = """
outcome_of(env)
in_child(lambda: env.step(np.zeros(env.action_space.shape))[0].shape)
in_child(lambda: outcome_of(env))
"""
    assert lines_of(calls, "BipedalWalker-v3") == ["(24,)", "3"]
    assert lines_of(calls)[0] == "(17,)"


def test_async_vector_env_reports_the_refusal():
    calls = """
outcome_of(env)
envs = gymnasium.vector.AsyncVectorEnv([make] * 2, context="fork", shared_memory=False)
gymnasium.logger.min_level = 50
try:
    envs.call("render")
except RuntimeError as error:
    print(error)
envs.close(terminate=True)
"""
    assert lines_of(calls)[-1].startswith(REFUSAL)
