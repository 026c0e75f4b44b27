"""Threads and signals: the core releases the GIL during calls, serializes calls on a shared
environment, and lets signals interrupt a compilation, steps and episodes.

Only `ctrl_c` measures time. With a long switch interval, Python does not preempt a thread, so
another thread runs only if the core releases the GIL.
"""

import os
import pickle
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import chain

import gymnasium
import numpy as np
import pytest
from mujoco_reference import MODELS
from walker_sim import WalkerEnv, _core, play_out
from walker_sim.commands.policies import shipped_policy
from walker_sim.training.policy_file import read_policy, to_bytes
from walkers import IDS, assert_same, ctrl_c, make_many, through_pickle

ENDLESS = {"terminate_when_unhealthy": False}
SLOW = {"frame_skip": 1000, "num_threads": 2, **ENDLESS}
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


# ---------------------------------------------------------------- compilation

ID = "walker_sim/Walker2d-v5"
MAKERS = {
    "gymnasium.make": lambda path: gymnasium.make(ID, xml_file=path),
    "gymnasium.make_vec": lambda path: gymnasium.make_vec(ID, num_envs=2, xml_file=path),
    "WalkerEnv": lambda path: WalkerEnv("Walker2d-v5", xml_file=path),
}


class Compilation(threading.Thread):
    """Has a model whose compilation blocks on a FIFO. Sends this process signals meanwhile."""

    def __init__(self, folder, signals):
        super().__init__()
        self.path = folder / "model.xml"
        self.path.write_text("<mujoco><include file='pipe.xml'/></mujoco>")
        self._pipe = folder / "pipe.xml"
        os.mkfifo(self._pipe)
        self._signals = signals

    def run(self):
        self.writer = os.open(self._pipe, os.O_WRONLY)  # blocks until MuJoCo's process reads
        for number in self._signals:
            os.kill(os.getpid(), number)

    def __exit__(self, *_):
        if self.is_alive():  # the compilation has not started
            os.close(os.open(self._pipe, os.O_RDONLY | os.O_NONBLOCK))
        self.join()
        os.close(self.writer)

    def __enter__(self):
        self.start()
        return self


def assert_no_child_is_left():
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_ctrl_c_ends_it(make, tmp_path):
    with Compilation(tmp_path, [signal.SIGINT]) as compilation, pytest.raises(KeyboardInterrupt):
        make(str(compilation.path))
    assert_no_child_is_left()
    gymnasium.make(ID, xml_file=str(MODELS["Walker2d-v5"])).close()


def test_ctrl_c_ends_episodes_without_end(command):
    policy = _core.Policy(str(shipped_policy("Hopper-v5")))
    player = _core.EpisodePlayer("Hopper-v5", {"max_episode_steps": 0, **ENDLESS}, 2, 0, False)
    jobs = [(0, seed, 0) for seed in range(100)]
    slow, size = read_policy(shipped_policy("Hopper-v5")), 2000
    slow.layers = [
        (np.zeros((outputs, inputs), np.float32), np.zeros(outputs, np.float32))
        for inputs, outputs in ((11, size), (size, size), (size, 3))
    ]
    slow = _core.Policy.from_bytes("slow", to_bytes(slow))
    for call in (
        lambda: player.play([policy], [], jobs, print),
        lambda: play_out("Hopper-v5", policy, range(100), max_episode_steps=0, **ENDLESS),
        lambda: slow.act(np.zeros((10**6, 11)), np.zeros((10**6, 3))),
    ):
        with ctrl_c(), pytest.raises(KeyboardInterrupt):
            call()
    words = ["max_episode_steps=0", "terminate_when_unhealthy=false"]
    with ctrl_c(1):
        command("evaluate", "Hopper-v5", "--policy", "shipped", *words, status=130)


def test_walkers_are_usable_after_ctrl_c_in_a_step():
    envs, twin = (make_many("Walker2d-v5", 1500, autoreset_mode="disabled", **SLOW) for _ in "12")
    envs.reset(seed=1)
    actions = np.full((1500, 6), 0.3, np.float32)
    with ctrl_c(0.2), pytest.raises(KeyboardInterrupt):
        while True:  # a step takes seconds, but less on a fast machine
            envs.step(actions)
    envs.step(actions[:2], [0, 1499])  # every walker is still in its episode
    for each in (envs, twin):
        each.reset(seed=2)
    assert_same(envs.step(actions[:2], [5, 7]), twin.step(actions[:2], [5, 7]))


def test_ctrl_c_loses_no_result_of_recv():
    envs, twin = (make_many("Walker2d-v5", 800, **SLOW) for _ in "12")
    for each in (envs, twin):
        each.async_reset(seed=1)
        each.recv()
        each.send(np.full((800, 6), 0.3, np.float32))
    with ctrl_c(0.2), pytest.raises(KeyboardInterrupt):
        envs.recv()
    orders = [each.recv() for each in (envs, twin)]
    rows = [outcome[0][np.argsort(outcome[4]["env_id"])] for outcome in orders]
    assert rows[0].tobytes() == rows[1].tobytes()


def test_ctrl_c_ends_the_wait_for_another_threads_call():
    policy = _core.Policy(str(shipped_policy("Hopper-v5")))
    player = _core.EpisodePlayer("Hopper-v5", {"max_episode_steps": 20, **ENDLESS}, 1, 0, False)
    jobs = [(0, seed, 0) for seed in range(10**5)]
    has_begun, is_over = threading.Event(), threading.Event()

    def receive(*_):
        has_begun.set()
        if is_over.is_set():
            raise InterruptedError

    with ThreadPoolExecutor(1) as other:
        playing = other.submit(player.play, [policy], [], jobs, receive)
        has_begun.wait()
        try:
            with ctrl_c(), pytest.raises(KeyboardInterrupt):
                player.play([policy], [], jobs[:1], receive)
        finally:
            is_over.set()
        assert isinstance(playing.exception(), InterruptedError)


def test_a_call_within_a_call_of_the_same_object_is_refused():
    policy = _core.Policy(str(shipped_policy("Hopper-v5")))
    player = _core.EpisodePlayer("Hopper-v5", {"max_episode_steps": 20}, 1, 0, False)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="during another call of the same object"):
            player.play(
                [policy], [], [(0, 1, 0)], lambda *_: player.play([policy], [], [(0, 1, 0)], print)
            )


def test_handlers_of_other_signals_run_meanwhile(tmp_path):
    came = []

    def raise_it(number, _):
        came.append(number)
        raise InterruptedError

    before = signal.signal(signal.SIGUSR1, lambda number, _: came.append(number))
    before_2 = signal.signal(signal.SIGUSR2, raise_it)
    try:
        compilation = Compilation(tmp_path, [signal.SIGUSR1, signal.SIGUSR2])
        with compilation, pytest.raises(InterruptedError):
            WalkerEnv("Walker2d-v5", xml_file=str(compilation.path))
    finally:
        signal.signal(signal.SIGUSR1, before)
        signal.signal(signal.SIGUSR2, before_2)
    assert came == [signal.SIGUSR1, signal.SIGUSR2]
    assert_no_child_is_left()


def test_other_threads_make_walkers_meanwhile(tmp_path):
    """A compiling thread holds no lock that others need."""
    made = []

    def compile_it(compilation):
        with pytest.raises(ValueError, match="XML"):
            WalkerEnv("Walker2d-v5", xml_file=str(compilation.path))
        made.append("compiled")

    with Compilation(tmp_path, []) as compilation:
        thread = threading.Thread(target=compile_it, args=[compilation])
        thread.start()
        compilation.join()
        for parameters in ({}, {"xml_file": str(MODELS["Walker2d-v5"])}):
            WalkerEnv("Walker2d-v5", **parameters).close()
            made.append("made")
        (tmp_path / "pipe.xml").unlink()  # MuJoCo opens it again and must fail
    thread.join()
    assert made == ["made", "made", "compiled"]
