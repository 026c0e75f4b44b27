"""Servers that hang, die, restart or change; signals; copies; closed connections."""

import copy
import os
import signal
import socket
import threading

import gymnasium
import numpy as np
import pytest
import walker_sim
from walkers import make_many, make_ours, through_pickle

LONG = 60.0  # timeout that only a failing test reaches [s]
LOST = "the server or its episode was lost; reset first"


def make_single(server, **options):
    return make_ours("BipedalWalker-v3", transport="ros", server=server, **options)


def make_batch(server, **options):
    return make_many("BipedalWalker-v3", 2, transport="ros", server=server, **options)


def step(environment):
    return environment.step(np.zeros(environment.action_space.shape, np.float32))


def assert_works(environment):
    if environment.action_space.shape == (4,):
        local = make_ours("BipedalWalker-v3")
    else:
        local = make_many("BipedalWalker-v3", 2)
    observation, _ = environment.reset(seed=11)
    assert observation.tobytes() == local.reset(seed=11)[0].tobytes()
    for _ in range(3):
        assert step(environment)[0].tobytes() == step(local)[0].tobytes()


def assert_lost(environment):
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        step(environment)


def halt(process):
    process.send_signal(signal.SIGSTOP)


def resume(process):
    process.send_signal(signal.SIGCONT)


def kill(process):
    process.kill()
    process.wait()


def soon(call, *arguments):
    timer = threading.Timer(0.2, call, arguments)
    timer.start()
    return timer


class Case:
    """A server with one or two walkers, and environments that are its clients."""

    def __init__(self, serve, make):
        self._serve, self._make = serve, make
        self._parameters = {} if make is make_single else {"num_envs": 2}
        self.server, self.process = serve(**self._parameters)

    def make(self, num_steps=1, **options):
        """Makes an environment, which has begun an episode."""
        environment = self._make(self.server, **options)
        environment.reset(seed=1)
        for _ in range(num_steps):
            step(environment)
        return environment

    def restart(self, **changes):
        kill(self.process)
        namespace = self.server.rpartition("/")[0]
        _, self.process = self._serve(namespace=namespace, **self._parameters, **changes)


@pytest.fixture(params=[make_single, make_batch], ids=["single", "batch"])
def case(serve, request):
    return Case(serve, request.param)


# ---------------------------------------------------------------- failures


def test_a_silent_server(case):
    environment = case.make(timeout=2)  # long enough for a responsive server [s]
    halt(case.process)
    message = r"/step.*: timed out; the server may or may not"
    with pytest.raises(walker_sim.ConnectionError, match=message):
        step(environment)
    assert_lost(environment)
    with pytest.raises(walker_sim.ConnectionError, match="timed out"):
        environment.reset(seed=1)
    resume(case.process)
    assert_works(environment)


def test_a_server_that_dies_during_a_step_and_restarts(case):
    environment = case.make(timeout=LONG)
    halt(case.process)
    killer = soon(kill, case.process)
    with pytest.raises(walker_sim.ConnectionError, match="may or may not have executed the call"):
        step(environment)
    killer.join()
    assert_lost(environment)
    message = "its address in the ROS master: Connection refused; has the"
    with pytest.raises(walker_sim.ConnectionError, match=message):
        environment.reset()
    case.restart()
    assert_lost(environment)
    assert_works(environment)


@pytest.mark.parametrize(
    ("num_steps", "error", "message"),
    [
        # The connection for steps is opened at the first step, so it goes to the new server.
        (0, walker_sim.RequestRefused, "there is no episode yet; reset first"),
        (1, walker_sim.ConnectionError, "has lost its episode: reset before"),
    ],
)
def test_a_server_that_restarts_between_calls(case, num_steps, error, message):
    environment = case.make(num_steps)
    case.restart()
    with pytest.raises(error, match=message):
        step(environment)
    assert_lost(environment)
    assert_works(environment)


def test_another_server_under_the_same_name(case):
    environment = case.make(num_steps=0)
    case.restart(max_episode_steps=7)
    with pytest.raises(walker_sim.ConnectionError):
        environment.reset()
    message = "max_episode_steps is 7 there; must be 1600"
    for _ in range(2):
        with pytest.raises(walker_sim.ServerMismatch, match=message):
            environment.reset()
        assert_lost(environment)
    case.restart(max_episode_steps=1600)
    assert_works(environment)


def test_another_client_moves_the_walker(case):
    """Both clients get an error, because both results are wrong. A failed call that arrives late
    has the same effect."""
    other = case.make(num_steps=0)
    environment = case.make()
    moved = "where step [12] was expected: another client, .* has moved the walker"
    for client in (other, environment):
        with pytest.raises(walker_sim.ConnectionError, match=moved):
            step(client)
    assert_lost(environment)
    assert_works(environment)
    other.reset(seed=2)
    step(other)
    environment.reset(seed=1)
    with pytest.raises(walker_sim.ConnectionError, match=moved):
        step(other)
    assert_works(other)


# ---------------------------------------------------------------- threads and signals


def test_other_threads_run_while_a_call_waits(serve):
    case = Case(serve, make_single)
    halt(case.process)
    helper = soon(resume, case.process)
    environment = make_single(case.server, timeout=LONG)
    helper.join()
    for call in (lambda: environment.reset(seed=1), lambda: step(environment)):
        halt(case.process)
        helper = soon(resume, case.process)
        call()
        helper.join()


class Signals:
    """Sends SIGINT repeatedly. Calls `handle` once, as soon as SAME_PLACES signals in succession
    found this thread at the same place, which is then the call that waits and nothing before it."""

    SAME_PLACES = 5

    def __init__(self, handle):
        self._handle = handle
        self._places = []
        self._has_ended = threading.Event()

    def __enter__(self):
        self._before = signal.signal(signal.SIGINT, self._on_signal)
        self._thread = threading.Thread(target=self._send)
        self._thread.start()

    def _on_signal(self, _, frame):
        self._places.append((frame, frame.f_lasti))
        latest = self._places[-self.SAME_PLACES :]
        is_waiting = len(latest) == self.SAME_PLACES and len(set(latest)) == 1
        if is_waiting and not self._has_ended.is_set():
            self._has_ended.set()
            self._handle()

    def _send(self):
        while not self._has_ended.wait(0.02):
            os.kill(os.getpid(), signal.SIGINT)

    def __exit__(self, *_):
        self._has_ended.set()
        self._thread.join()
        signal.signal(signal.SIGINT, self._before)


def interrupt():
    raise KeyboardInterrupt


def test_ctrl_c_ends_a_call(case):
    environment = case.make(timeout=LONG)
    for call in (lambda: step(environment), lambda: environment.reset()):
        halt(case.process)
        with Signals(interrupt), pytest.raises(KeyboardInterrupt):
            call()
        assert_lost(environment)
        resume(case.process)
        assert_works(environment)


def test_ctrl_c_while_it_connects(serve):
    with socket.create_server(("localhost", 0)) as silent:
        uri = f"http://localhost:{silent.getsockname()[1]}"
        with Signals(interrupt), pytest.raises(KeyboardInterrupt):
            make_single("/walker_sim", master_uri=uri, timeout=LONG)


def test_a_handled_signal_ends_no_call(serve):
    case = Case(serve, make_single)
    environment = case.make(timeout=LONG)
    halt(case.process)
    with Signals(lambda: resume(case.process)):
        step(environment)
    assert_works(environment)


# ---------------------------------------------------------------- copies, and the end


@pytest.mark.parametrize("copied", [copy.deepcopy, through_pickle])
def test_copies_are_other_connections(case, copied):
    environment = case.make()
    other = copied(environment)
    with pytest.raises(walker_sim.ResetNeeded, match="there is no episode yet; reset first"):
        step(other.unwrapped)
    assert_works(other)
    other.close()
    assert_works(environment)
    environment.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        step(copied(environment).unwrapped)


def ends():
    """Returns the number of this process's sockets."""
    links = (f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd"))
    return sum(os.readlink(link).startswith("socket:") for link in links if os.path.islink(link))


def test_close_closes_the_connections(case):
    before = ends()
    environment = case.make()
    assert ends() == before + 3  # for ~get_spec, for resets and for steps
    environment.close()
    assert ends() == before
    environment.close()


def test_failures_leave_no_connections(serve):
    case = Case(serve, make_single)
    before = ends()
    for _ in range(3):
        with pytest.raises(walker_sim.ServerMismatch):
            make_single(case.server, hardcore=True)
    environment = case.make(num_steps=0)
    kill(case.process)
    for _ in range(3):
        with pytest.raises(walker_sim.ConnectionError):
            environment.reset()
    assert ends() == before
