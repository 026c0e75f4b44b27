"""Fixtures of the Python suites."""

import contextlib
import itertools
import json
import os
import pathlib
import resource
import socket
import urllib.parse
from typing import NamedTuple

import pytest
from processes import Master


@pytest.fixture(scope="module")
def master():
    with Master(pathlib.Path(os.environ["WALKER_SIM_PROGRAMS"]), exports=True) as running:
        yield running


@pytest.fixture
def promotion():
    """NumPy 2's type promotion under NumPy 1, on which the bits of Gymnasium's rewards depend."""
    import numpy as np

    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        yield
        return
    before = np._get_promotion_state()
    np._set_promotion_state("weak")
    try:
        yield
    finally:
        np._set_promotion_state(before)


class Ended(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def command(capsys):
    """Runs a command in this process. Asserts its status, unless `status` is None, and that an
    error with status 2 is one line that names the command."""
    from walker_sim.commands import main

    def run(*words, status=0):
        capsys.readouterr()
        try:
            found = main([*map(str, words)])
        except SystemExit as end:
            found = end.code
        ended = Ended(found, *capsys.readouterr())
        assert found in ((0, 1, 2) if status is None else (status,)), ended.err
        if found == 2:
            name = f"walker_sim {words[0]}: " if len(words) > 1 else "walker_sim"
            assert ended.err.startswith(name)
            assert ended.err.count("\n") == 1
        return ended

    return run


@pytest.fixture
def full_disk():
    """Returns a context in which no file gets more bytes than this, as on a full disk."""

    @contextlib.contextmanager
    def limited(size=10):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited


@pytest.fixture
def record(tmp_path, command):
    """Runs `record` and returns its arrays and its file."""
    import numpy as np

    def run(*arguments):
        file = tmp_path / "walk.npz"
        command("record", *arguments, "--output", file)
        with np.load(file, allow_pickle=False) as arrays:
            return dict(arrays), file

    return run


@pytest.fixture
def evaluate(tmp_path, command):
    """Runs `evaluate`. Returns its output and its JSON."""

    def run(*words):
        file = tmp_path / "evaluation.json"
        out = command("evaluate", *words, "--json", file).out
        return out, json.loads(file.read_text())

    return run


@pytest.fixture
def figures(monkeypatch):
    """The figures that the commands make."""
    from walker_sim.commands import plots

    made = []
    make = plots.make_figure
    monkeypatch.setattr(plots, "make_figure", lambda **k: made.append(make(**k)) or made[-1])
    return made


@pytest.fixture
def browse(tmp_path):
    """Opens an address in a browser, and waits until the page has its panel."""
    from browser import Browser, wait_for

    browsers = []

    def start(address):
        folder = tmp_path / f"browser{len(browsers)}"
        folder.mkdir()
        browsers.append(Browser(folder, address))
        wait_for(lambda: "return" in browsers[-1].text(), "the panel")
        return browsers[-1]

    yield start
    for each in browsers:
        each.close()


class Clock:
    time = 100.0

    def __call__(self):
        return self.time


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def pygame(monkeypatch):
    """The module pygame with SDL's dummy display."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame as module

    yield module
    module.display.quit()


NUMBERS = itertools.count()


@contextlib.contextmanager
def held(uri):
    """Holds the port of a killed node, if it is free. When another node registers under its name,
    the master sends a shutdown there, which would end a node of another master that got the port.
    """
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with contextlib.suppress(OSError):
            holder.bind(("", urllib.parse.urlparse(uri or "").port or 0))
        yield


@pytest.fixture
def serve(master):
    servers = []

    def start(env="BipedalWalker-v3", namespace=None, **parameters):
        namespace = namespace or f"/server_{next(NUMBERS)}"
        with held(master.node_uri(f"{namespace}/walker_sim")):
            parameters = {"env": env, "publish_clock": "false", **parameters}
            servers.append(master.server(namespace=namespace, **parameters))
        return servers[-1].name, servers[-1]

    yield start
    for server in servers:
        server.end()
