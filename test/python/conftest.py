"""Lends the suites beside it what the walkers' own suites and the recordings know of Gymnasium, and
what the benchmark knows of masters and servers."""

import itertools
import os
import pathlib
import signal
import sys
import types
import xmlrpc.client

import pytest

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [
    str(TEST / folder)
    for folder in ("bench", "robots/bipedal_walker", "robots/mujoco", "recordings")
]


@pytest.fixture(scope="module")
def master(tmp_path_factory):
    """A ROS master, which ROS_MASTER_URI names."""
    from ros import Master

    programs = pathlib.Path(os.environ["WALKER_SIM_PROGRAMS"])
    folder = tmp_path_factory.mktemp("ros")
    with Master(types.SimpleNamespace(folder=folder, programs=programs)) as running:
        yield running


@pytest.fixture
def promotion():
    """Of NumPy 2, with either NumPy."""
    from promotion import promotion_of_numpy_2

    with promotion_of_numpy_2():
        yield


class Clock:
    """Goes when it is told to."""

    time = 100.0

    def __call__(self):
        return self.time


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def pygame(monkeypatch):
    """The module, with windows that nobody sees."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame as module

    yield module
    module.display.quit()


NUMBERS = itertools.count()


@pytest.fixture
def serve(master):
    """Starts a server in lock-step, in a namespace of its own: its name, and its process."""
    from ros import await_true, stop

    processes = []
    services = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])

    def uri_of(name):
        return services.lookupService("/test", f"{name}/get_spec")[2]

    def start(env="BipedalWalker-v3", namespace=None, **parameters):
        parameters = {"mode": "lockstep", "publish_clock": "false", **parameters}
        namespace = namespace or f"/server_{next(NUMBERS)}"
        before = uri_of(f"{namespace}/walker_sim")
        name, process = master.server(namespace=namespace, env=env, **parameters)
        processes.append(process)
        # A server that was killed is known to the master until the next one of its name.
        await_true(lambda: uri_of(name) not in (before, ""), f"another {name}", process)
        return name, process

    yield start
    for process in processes:
        process.send_signal(signal.SIGCONT)  # a test may have halted it
        stop(process)
