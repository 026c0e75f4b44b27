"""Threads: the core releases the GIL during calls, and serializes calls on a shared environment.

No test measures time. With a long switch interval, Python does not preempt a thread, so another
thread runs only if the core releases the GIL.
"""

import pickle
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import chain

import numpy as np
import pytest
from walker_sim import WalkerEnv
from walkers import IDS, run_python, through_pickle

ENDLESS = {"terminate_when_unhealthy": False}
MOST_CALLS = 200000


@pytest.fixture()
def no_preemption():
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    yield
    sys.setswitchinterval(interval)


def another_thread_runs_during(call):
    """Returns whether another thread runs while this one repeats the call."""
    has_run = []
    gate = threading.Lock()

    def run():
        with gate:
            has_run.append(True)

    with gate:
        thread = threading.Thread(target=run)
        thread.start()
        # The thread waits for the gate, then for the GIL.
    for _ in range(MOST_CALLS):
        if has_run:
            break
        call()
    has_run_meanwhile = bool(has_run)
    thread.join()
    return has_run_meanwhile


def test_the_check_detects_a_held_gil(no_preemption):
    assert not another_thread_runs_during(lambda: None)
    assert another_thread_runs_during(lambda: time.sleep(0.001))


def begin(environment_id="Walker2d-v5", **parameters):
    environment = WalkerEnv(environment_id, **parameters)
    environment.reset(seed=1)  # a first reset without a seed reads the system's entropy
    return environment


def call_step():
    environment, action = begin(**ENDLESS), np.zeros(6)
    return lambda: environment.step(action)


def call_loads():
    pickled = pickle.dumps(begin(**ENDLESS))
    return lambda: pickle.loads(pickled)


@pytest.mark.parametrize(
    "make_call",
    [call_step, call_loads, *(lambda env_id=env_id: begin(env_id).reset for env_id in IDS)],
)
def test_calls_let_other_threads_run(no_preemption, make_call):
    assert another_thread_runs_during(make_call())


def in_threads(function, count=4):
    with ThreadPoolExecutor(count) as threads:
        return list(threads.map(function, range(count)))


def test_one_environment_per_thread():
    def play(index):
        environment = WalkerEnv(IDS[index % len(IDS)])
        actions = np.random.default_rng(index).uniform(-1, 1, (1500, *environment._action_shape))
        environment.reset(seed=index)
        outcomes = []
        for action in actions:
            observation, reward, terminated, *_ = environment.step(action)
            outcomes.append((observation.tobytes(), reward, terminated))
            if terminated:
                outcomes.append(environment.reset()[0].tobytes())
        return outcomes

    assert in_threads(play) == [play(index) for index in range(4)]


def test_threads_step_a_shared_environment():
    """All threads take the same action, so in any order their results together are one episode."""
    steps = 600
    shared, alone = (WalkerEnv("Walker2d-v5", **ENDLESS) for _ in range(2))
    for environment in (shared, alone):
        environment.reset(seed=3)

    def play(environment, count):
        action = np.full(6, 0.3)
        return [(o.tobytes(), r) for o, r, *_ in (environment.step(action) for _ in range(count))]

    seen = in_threads(lambda _: play(shared, steps))
    assert sorted(chain(*seen)) == sorted(play(alone, 4 * steps))


def test_threads_reset_a_shared_environment():
    """No two resets get the same draws of the generator."""
    resets = 200
    shared, alone = (WalkerEnv("Walker2d-v4") for _ in range(2))
    for environment in (shared, alone):
        environment.np_random = np.random.default_rng(8)

    def play(environment, count):
        return [environment.reset()[0].tobytes() for _ in range(count)]

    seen = in_threads(lambda _: play(shared, resets))
    assert sorted(chain(*seen)) == sorted(play(alone, 4 * resets))


def test_threads_pickle_a_moving_environment():
    """Each copy holds the state between two steps, so it continues the same episode."""
    environment = WalkerEnv("Walker2d-v5", **ENDLESS)
    environment.reset(seed=3)
    action = np.full(6, 0.3)
    stop = threading.Event()

    def move_or_store(index):
        if index == 0:
            rows = [environment.step(action)[0].tobytes() for _ in range(400)]
            stop.set()
            return rows
        nexts = []
        while not stop.is_set():
            nexts.append(through_pickle(environment).step(action)[0].tobytes())
        return nexts

    moved, *stored = in_threads(move_or_store, 3)
    moved.append(environment.step(action)[0].tobytes())
    assert set(chain(*stored)) <= set(moved)


@pytest.mark.parametrize("environment_id", IDS)
def test_a_stack_of_128_kib_suffices(environment_id):
    """Runs in a new process, which a stack overflow would kill."""
    code = """
import sys, threading
import gymnasium, numpy, walker_sim

def play():
    with gymnasium.make(f"walker_sim/{environment_id}") as env:
        for seed in range(2):
            env.reset(seed=seed)
            for _ in range(40):
                terminated = env.step(env.action_space.sample())[2]
                if terminated:
                    env.reset()
        env.unwrapped.set_state(env.unwrapped.get_state())
    envs = walker_sim.WalkerVectorEnv(environment_id, 70, num_threads=2)
    envs.reset(seed=1)
    for _ in range(40):
        envs.step(envs.action_space.sample())
    envs.close()
    done.append(True)

environment_id, done = sys.argv[1], []
threading.stack_size(128 * 1024)
thread = threading.Thread(target=play)
thread.start()
thread.join()
assert done
"""
    run_python(code, environment_id)
