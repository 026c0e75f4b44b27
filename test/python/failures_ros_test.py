"""Servers that hang, die, restart or change; signals; copies; closed connections."""

import copy
import os
import pickle
import signal
import socket
import threading
import time
import xmlrpc.client
import xmlrpc.server

import gymnasium
import numpy as np
import pytest
import walker_sim  # registers the ids
from walkers import make_ours, random_actions

LONG = 60.0  # timeout that only a failing test reaches [s]
ACTIONS = random_actions("BipedalWalker-v3", 50)
LOST = "the server or its episode was lost; reset first"


def make_single(server, **options):
    return make_ours("BipedalWalker-v3", transport="ros", server=server, **options)


def make_batch(server, **options):
    return gymnasium.make_vec(
        "walker_sim/BipedalWalker-v3", 2, transport="ros", server=server, **options
    )


def action_of(environment):
    return np.zeros(environment.action_space.shape, np.float32)


def assert_works(environment):
    num_envs = getattr(environment, "num_envs", None)
    if num_envs is None:
        local = make_ours("BipedalWalker-v3")
    else:
        local = gymnasium.make_vec("walker_sim/BipedalWalker-v3", num_envs)
    observation, _ = environment.reset(seed=11)
    assert observation.tobytes() == local.reset(seed=11)[0].tobytes()
    action = action_of(environment)
    for _ in range(3):
        assert environment.step(action)[0].tobytes() == local.step(action)[0].tobytes()


def halt(process):
    process.send_signal(signal.SIGSTOP)


def go_on(process):
    process.send_signal(signal.SIGCONT)


def kill(process):
    process.kill()
    process.wait()


def soon(call):

    def wait_and_call():
        time.sleep(0.2)
        call()

    thread = threading.Thread(target=wait_and_call)
    thread.start()
    return thread


@pytest.fixture(params=[make_single, make_batch], ids=["single", "batch"])
def kind(request):
    return request.param, {} if request.param is make_single else {"num_envs": 2}


# ---------------------------------------------------------------- failures


def test_a_server_that_is_silent(serve, kind):
    make, parameters = kind
    server, process = serve(**parameters)
    environment = make(server, timeout=2)  # long enough for a responsive server [s]
    environment.reset(seed=1)
    environment.step(action_of(environment))
    halt(process)
    with pytest.raises(
        walker_sim.ConnectionError, match=r"/step.*: timed out; whether the call was"
    ):
        environment.step(action_of(environment))
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(action_of(environment))
    with pytest.raises(walker_sim.ConnectionError, match="timed out"):
        environment.reset(seed=1)
    go_on(process)
    assert_works(environment)


def test_a_server_that_dies_amid_a_step_and_is_started_again(serve, kind):
    make, parameters = kind
    server, process = serve(**parameters)
    environment = make(server, timeout=LONG)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    halt(process)
    killer = soon(lambda: kill(process))
    with pytest.raises(walker_sim.ConnectionError, match="whether the call was made is not known"):
        environment.step(action_of(environment))
    killer.join()
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(action_of(environment))
    with pytest.raises(
        walker_sim.ConnectionError, match="as the ROS master has it: Connection refused; has the"
    ):
        environment.reset()
    serve(namespace=server.rpartition("/")[0], **parameters)
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(action_of(environment))
    assert_works(environment)


def test_a_server_that_was_started_again_between_two_steps(serve, kind):
    make, parameters = kind
    server, process = serve(**parameters)
    environment = make(server)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    kill(process)
    serve(namespace=server.rpartition("/")[0], **parameters)
    with pytest.raises(walker_sim.ConnectionError, match="has lost its episode: reset before"):
        environment.step(action_of(environment))
    assert_works(environment)


def test_a_server_that_was_started_again_before_the_first_step(serve, kind):
    """The connection for steps is opened at the first step, so it goes to the new server."""
    make, parameters = kind
    server, process = serve(**parameters)
    environment = make(server)
    environment.reset(seed=1)
    kill(process)
    serve(namespace=server.rpartition("/")[0], **parameters)
    with pytest.raises(walker_sim.RequestRefused, match="there is no episode yet; reset first"):
        environment.step(action_of(environment))
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(action_of(environment))
    assert_works(environment)


def test_another_server_that_takes_the_name(serve, kind):
    make, parameters = kind
    server, process = serve(**parameters)
    namespace = server.rpartition("/")[0]
    environment = make(server)
    environment.reset(seed=1)
    kill(process)
    _, process = serve(namespace=namespace, max_episode_steps=7, **parameters)
    with pytest.raises(walker_sim.ConnectionError):
        environment.reset()
    for _ in range(2):
        with pytest.raises(
            walker_sim.ServerMismatch, match="max_episode_steps is 7 there; must be 1600"
        ):
            environment.reset()
        with pytest.raises(walker_sim.ResetNeeded, match=LOST):
            environment.step(action_of(environment))
    kill(process)
    serve(namespace=namespace, max_episode_steps=1600, **parameters)
    assert_works(environment)


def test_somebody_else_who_moves_the_walker(serve, kind):
    """Both clients get an error, because both results are wrong. A failed call that arrives late
    has the same effect."""
    make, parameters = kind
    server, _ = serve(**parameters)
    environment, other = make(server), make(server)
    moved = "where step [12] was expected: another client, .* has moved the walker"
    other.reset(seed=2)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    with pytest.raises(walker_sim.ConnectionError, match=moved):
        other.step(action_of(other))
    with pytest.raises(walker_sim.ConnectionError, match=moved):
        environment.step(action_of(environment))
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(action_of(environment))
    assert_works(environment)
    other.reset(seed=2)
    other.step(action_of(other))
    environment.reset(seed=1)
    with pytest.raises(walker_sim.ConnectionError, match=moved):
        other.step(action_of(other))
    assert_works(other)


def test_a_master_that_is_gone(serve):
    """An existing connection needs no master; a new one does."""
    server, _ = serve()
    real = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    relay = xmlrpc.server.SimpleXMLRPCServer(("localhost", 0), logRequests=False)
    relay.register_function(lambda *names: real.lookupService(*names), "lookupService")
    thread = threading.Thread(target=relay.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    environment = make_single(server, master_uri=f"http://localhost:{relay.server_address[1]}")
    environment.reset(seed=1)
    environment.step(ACTIONS[0])
    relay.shutdown()
    thread.join()
    relay.server_close()
    assert_works(environment)
    environment.close()
    with pytest.raises(
        walker_sim.ConnectionError, match=r"^ROS master .*is it running, and is this"
    ):
        environment.reset()


# ---------------------------------------------------------------- threads and signals


def test_other_threads_go_on_while_a_call_waits(serve):
    server, process = serve()
    halt(process)
    helper = soon(lambda: go_on(process))
    environment = make_single(server, timeout=LONG)
    helper.join()
    for call in (lambda: environment.reset(seed=1), lambda: environment.step(ACTIONS[0])):
        halt(process)
        helper = soon(lambda: go_on(process))
        call()
        helper.join()


class Signals:
    """Sends SIGINT repeatedly, because the first may arrive before the call waits. Calls `handle`
    once, at the first signal that Python handles."""

    def __init__(self, handle):
        self._handle = handle
        self._has_ended = threading.Event()

    def __enter__(self):
        self._before = signal.signal(signal.SIGINT, self._on_signal)
        self._thread = threading.Thread(target=self._send)
        self._thread.start()

    def _on_signal(self, *_):
        if not self._has_ended.is_set():
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


def test_ctrl_c_ends_a_call(serve, kind):
    make, parameters = kind
    server, process = serve(**parameters)
    environment = make(server, timeout=LONG)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    for call in (lambda: environment.step(action_of(environment)), lambda: environment.reset()):
        halt(process)
        with Signals(interrupt), pytest.raises(KeyboardInterrupt):
            call()
        with pytest.raises(walker_sim.ResetNeeded, match=LOST):
            environment.step(action_of(environment))
        go_on(process)
        assert_works(environment)


def test_ctrl_c_while_it_connects(serve):
    with socket.create_server(("localhost", 0)) as silent:
        uri = f"http://localhost:{silent.getsockname()[1]}"
        with Signals(interrupt), pytest.raises(KeyboardInterrupt):
            make_single("/walker_sim", master_uri=uri, timeout=LONG)


def test_a_signal_that_is_handled_ends_nothing(serve):
    server, process = serve()
    environment = make_single(server, timeout=LONG)
    environment.reset(seed=1)
    halt(process)
    with Signals(lambda: go_on(process)):
        environment.step(ACTIONS[0])
    assert_works(environment)


# ---------------------------------------------------------------- copies, and the end


def through_pickle(environment):
    return pickle.loads(pickle.dumps(environment))


@pytest.mark.parametrize("copied", [copy.deepcopy, through_pickle])
def test_copies_are_other_connections(serve, kind, copied):
    make, parameters = kind
    server, _ = serve(**parameters)
    environment = make(server)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    other = copied(environment)
    with pytest.raises(walker_sim.ResetNeeded, match="there is no episode yet; reset first"):
        other.unwrapped.step(action_of(other))
    assert_works(other)
    other.close()
    assert_works(environment)
    environment.close()
    closed = copied(environment)
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        closed.unwrapped.step(action_of(environment))


def sockets():
    links = (f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd"))
    return sum("socket:" in os.readlink(link) for link in links if os.path.islink(link))


def test_close_closes_the_sockets(serve, kind):
    make, parameters = kind
    server, _ = serve(**parameters)
    before = sockets()
    environment = make(server)
    environment.reset(seed=1)
    environment.step(action_of(environment))
    assert sockets() == before + 3  # for ~get_spec, resets and steps
    environment.close()
    assert sockets() == before
    environment.close()


def test_failures_leave_no_sockets(serve):
    server, process = serve()
    before = sockets()
    for _ in range(3):
        with pytest.raises(walker_sim.ServerMismatch):
            make_single(server, hardcore=True)
    environment = make_single(server)
    environment.reset(seed=1)
    kill(process)
    for _ in range(3):
        with pytest.raises(walker_sim.ConnectionError):
            environment.reset()
    assert sockets() == before
