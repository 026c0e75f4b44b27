"""Signals and other threads while MuJoCo compiles a model."""

import os
import signal
import threading

import gymnasium
import pytest
import walker_sim
from mujoco_reference import MODELS

ID = "walker_sim/Walker2d-v5"
MAKERS = {
    "gymnasium.make": lambda path: gymnasium.make(ID, xml_file=path),
    "gymnasium.make_vec": lambda path: gymnasium.make_vec(ID, num_envs=2, xml_file=path),
    "WalkerEnv": lambda path: walker_sim.WalkerEnv("Walker2d-v5", xml_file=path),
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
            walker_sim.WalkerEnv("Walker2d-v5", xml_file=str(compilation.path))
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
            walker_sim.WalkerEnv("Walker2d-v5", xml_file=str(compilation.path))
        made.append("compiled")

    with Compilation(tmp_path, []) as compilation:
        thread = threading.Thread(target=compile_it, args=[compilation])
        thread.start()
        compilation.join()
        for parameters in ({}, {"xml_file": str(MODELS["Walker2d-v5"])}):
            walker_sim.WalkerEnv("Walker2d-v5", **parameters).close()
            made.append("made")
        (tmp_path / "pipe.xml").unlink()  # MuJoCo opens it again and must fail
    thread.join()
    assert made == ["made", "made", "compiled"]
