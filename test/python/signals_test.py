"""Signals interrupt a compilation, steps and episodes, during which other threads go on.

Only `ctrl_c` measures time.
"""

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest
from mujoco_reference import MODELS
from walker_sim import WalkerEnv, _core, play_out
from walker_sim.commands.policies import shipped_policy
from walker_sim.training.policy_file import read_policy, to_bytes
from walkers import assert_same, ctrl_c, make_many

ENDLESS = {"terminate_when_unhealthy": False}
SLOW = {"frame_skip": 1000, "num_threads": 2, **ENDLESS}
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
