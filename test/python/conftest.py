"""Lends the suites beside it what the walkers' own suites and the recordings know of Gymnasium, and
what the benchmark knows of masters and servers."""

import itertools
import os
import pathlib
import sys
import types

import pytest

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST / folder) for folder in ("bench", "bipedal_walker", "recordings", "walker2d")]


@pytest.fixture(scope="module")
def master(tmp_path_factory):
    """A ROS master, which ROS_MASTER_URI names."""
    from ros import Master

    programs = pathlib.Path(os.environ["WALKER_SIM_PROGRAMS"])
    folder = tmp_path_factory.mktemp("ros")
    with Master(types.SimpleNamespace(folder=folder, programs=programs)) as running:
        yield running


NUMBERS = itertools.count()


@pytest.fixture
def serve(master):
    """Starts a server in lock-step, in a namespace of its own: its name, and its process."""
    from ros import stop

    processes = []

    def start(env="BipedalWalker-v3", namespace=None, **parameters):
        parameters = {"mode": "lockstep", "publish_clock": "false", **parameters}
        namespace = namespace or f"/server_{next(NUMBERS)}"
        name, process = master.server(namespace=namespace, env=env, **parameters)
        processes.append(process)
        return name, process

    yield start
    for process in processes:
        stop(process)
