"""Threads: the core releases the GIL during calls and serializes calls on a shared environment.

With a long switch interval, Python does not preempt a thread, so another thread runs only if the
core releases the GIL.
"""

import pickle
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import chain

import numpy as np
import pytest
from walker_sim import WalkerEnv, _core
from walker_sim.commands.policies import shipped_policy
from walkers import IDS, make_many, through_pickle

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
    worlds = ("pushed", "moon", "slippery", "noisy")

    def play(index):
        environment = WalkerEnv(IDS[index % len(IDS)], world=worlds[index])
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


@pytest.mark.parametrize(
    "make", [WalkerEnv, lambda *ids, **options: make_many(*ids, 3, num_threads=2, **options)]
)
def test_threads_step_a_shared_environment(make):
    """All threads take the same action, so in any order their results together are one episode,
    and in order those of each thread."""
    shared, alone = (make("Walker2d-v5", **ENDLESS) for _ in range(2))
    for environment in (shared, alone):
        environment.reset(seed=3)

    def play(environment, count):
        action = np.full(environment.action_space.shape, 0.3)
        outcomes = [environment.step(action)[:2] for _ in range(count)]
        return [
            (observation.tobytes(), np.asarray(reward).tolist()) for observation, reward in outcomes
        ]

    seen = in_threads(lambda _: play(shared, 300))
    expected = play(alone, 4 * 300)
    assert sorted(chain(*seen)) == sorted(expected)
    assert all(rows == sorted(rows, key=expected.index) for rows in seen)


def test_threads_reset_a_shared_environment():
    """No two resets get the same draws of the generator, also beside a thread that saves states."""
    resets = 200
    shared, alone = (WalkerEnv("Walker2d-v4") for _ in range(2))
    for environment in (shared, alone):
        environment.np_random = np.random.default_rng(8)

    def play(environment, count, saves=False):
        rows = []
        for _ in range(count):
            rows.append(environment.reset()[0].tobytes())
            if saves:
                environment.get_state()
        return rows

    seen = in_threads(lambda index: play(shared, resets, saves=index == 0))
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


def test_a_call_within_a_call_of_the_same_object_is_refused():
    policy = _core.Policy(str(shipped_policy("Hopper-v5")))
    player = _core.EpisodePlayer("Hopper-v5", {"max_episode_steps": 20}, 1, 0, False)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="during another call of the same object"):
            player.play(
                [policy], [], [(0, 1, 0)], lambda *_: player.play([policy], [], [(0, 1, 0)], print)
            )
