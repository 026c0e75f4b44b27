"""Malformed answers of a server or master raise an error and never access invalid memory."""

import contextlib
import os
import resource
import signal
import socket
import threading

import gymnasium
import numpy as np
import pytest
import walker_sim  # registers the ids
from fake_server import (
    BATCH,
    ENV,
    INFO,
    NUM_ENVS,
    RIGHT,
    WIDTH,
    FakeServer,
    batch_reset,
    batch_step,
    outcome,
    picture,
    specification,
    transition,
)
from walker_sim import _core
from walker_sim.environment import WalkerEnv

LARGEST = 2**32 - 1
LONG = 60.0  # timeout that only a failing test reaches [s]
LOST = "the server or its episode was lost; reset first"


@pytest.fixture
def server():
    fake = FakeServer()
    yield fake
    fake.close()


def make_batch(server, autoreset_mode="same_step", **options):
    server.answers["get_spec"] = specification(autoreset_mode=autoreset_mode)
    return gymnasium.make_vec(
        f"walker_sim/{ENV}",
        NUM_ENVS,
        transport="ros",
        master_uri=server.master_uri,
        autoreset_mode=autoreset_mode,
        timeout=LONG,
        **options,
    )


def make_single(server, **options):
    server.answers["get_spec"] = specification(num_envs=1)
    return WalkerEnv(ENV, transport="ros", master_uri=server.master_uri, timeout=LONG, **options)


def zeros(environment):
    return np.zeros(environment.action_space.shape, np.float32)


def assert_goes_on(environment):
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(zeros(environment))
    assert_works(environment)


def assert_works(environment):
    environment.reset(seed=1)
    environment.step(zeros(environment))


# ---------------------------------------------------------------- lengths and indices


def resized(values):
    for size in sorted({0, len(values) - 1, len(values) + 1}):
        yield (values + values[-1:])[:size]


SIZES = [
    (name, values)
    for name, (_, right) in BATCH.items()
    if name not in ("final_environments", "failed_environments", "failed_at_reset", "failures")
    for values in resized(right)
]
INDICES = [[2], [LARGEST], [1, 1], [1, 0], [0, 1, 2], [1] * 1000]


@pytest.mark.parametrize("mode", ["same_step", "disabled"])
@pytest.mark.parametrize(
    ("field", "values"), SIZES, ids=[f"{name}-{len(values)}" for name, values in SIZES]
)
def test_a_batchs_step_with_a_field_of_another_size(server, field, values, mode):
    environment = make_batch(server, mode)
    assert_works(environment)
    environment.reset(seed=1)
    server.answers["step_batch"] = batch_step(**{field: values})
    words = f"its answer's {field} has {len(values)} elements; must have {len(BATCH[field][1])};"
    with pytest.raises(walker_sim.ConnectionError, match=words):
        environment.step(zeros(environment))
    server.answers["step_batch"] = RIGHT["step_batch"]
    assert_goes_on(environment)


@pytest.mark.parametrize(
    "environments", INDICES, ids=[str(indices[:3]).replace(" ", "") for indices in INDICES]
)
def test_a_batchs_step_that_ends_other_environments(server, environments):
    environment = make_batch(server)
    environment.reset(seed=1)
    server.answers["step_batch"] = batch_step(
        final_environments=environments,
        final_observations=[0.25] * (WIDTH * len(environments)),
        final_info=[0.0] * (INFO * len(environments)),
    )
    with pytest.raises(
        walker_sim.ConnectionError,
        match=r"its answer's final_environments\[\d+\] is \d+; must be (below num_envs = 2"
        r"|above the one before, 1);",
    ):
        environment.step(zeros(environment))
    server.answers["step_batch"] = RIGHT["step_batch"]
    assert_goes_on(environment)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"failures": ["it broke"]}, "failures has 1 elements; must have 0"),
        ({"failed_environments": [0]}, "failures has 0 elements; must have 1"),
        (
            {"failed_environments": [2], "failures": ["it broke"]},
            r"failed_environments\[0\] is 2; must be below num_envs = 2",
        ),
        ({"failures": ["it broke"] * 5}, "array has 5 texts; must have at most 4"),
    ],
    ids=["no-environment", "no-text", "another", "many"],
)
def test_failures_that_cannot_be(server, changes, words):
    environment = make_batch(server)
    environment.reset(seed=1)
    of_a_step = {"failed_at_reset": [1] * len(changes.get("failures", [])), **changes}
    server.answers["step_batch"] = batch_step(**of_a_step)
    with pytest.raises(walker_sim.ConnectionError, match=f"its answer's {words};"):
        environment.step(zeros(environment))
    server.answers["step_batch"] = RIGHT["step_batch"]
    assert_goes_on(environment)
    server.answers["reset_batch"] = batch_reset(**changes)
    with pytest.raises(
        walker_sim.ConnectionError, match=f"its answer's {words.replace('most 4', 'most 2')};"
    ):
        environment.reset(seed=1)
    server.answers["reset_batch"] = RIGHT["reset_batch"]
    assert_goes_on(environment)


def test_flags_that_are_neither_0_nor_1(server):
    environment = make_batch(server)
    environment.reset(seed=1)
    server.answers["step_batch"] = batch_step(failed_at_reset=[1])
    with pytest.raises(
        walker_sim.ConnectionError, match="failed_at_reset has 1 elements; must have 0;"
    ):
        environment.step(zeros(environment))
    server.answers["step_batch"] = RIGHT["step_batch"]
    assert_goes_on(environment)
    failed = {"failed_environments": [1], "failed_at_reset": [2], "failures": ["it broke"]}
    server.answers["step_batch"] = batch_step(**failed)
    with pytest.raises(
        walker_sim.ConnectionError, match=r"failed_at_reset\[0\] is 2; must be 0 or 1;"
    ):
        environment.step(zeros(environment))
    server.answers["step_batch"] = RIGHT["step_batch"]
    assert_goes_on(environment)
    for field in ("terminated", "truncated"):
        server.answers["step_batch"] = batch_step(**{field: [0, 2]})
        with pytest.raises(
            walker_sim.ConnectionError, match=rf"{field}\[1\] is 2; must be 0 or 1;"
        ):
            environment.step(zeros(environment))
        server.answers["step_batch"] = RIGHT["step_batch"]
        assert_goes_on(environment)


@pytest.mark.parametrize("field", ["observations", "info"])
def test_a_batchs_reset_with_a_field_of_another_size(server, field):
    environment = make_batch(server)
    right = {"observations": [0.5] * (NUM_ENVS * WIDTH), "info": [0.0] * (NUM_ENVS * INFO)}
    for values in resized(right[field]):
        server.answers["reset_batch"] = batch_reset(**{field: values})
        with pytest.raises(
            walker_sim.ConnectionError, match=f"its answer's {field} has {len(values)} elements;"
        ):
            environment.reset(seed=1)
        server.answers["reset_batch"] = RIGHT["reset_batch"]
        assert_goes_on(environment)


@pytest.mark.parametrize("service", ["reset", "step"])
@pytest.mark.parametrize("field", ["observation", "info"])
def test_a_single_walker_with_a_field_of_another_size(server, service, field):
    environment = make_single(server)
    call = {
        "reset": lambda: environment.reset(seed=1),
        "step": lambda: environment.step(zeros(environment)),
    }[service]
    step = 0 if service == "reset" else 1
    for values in resized({"observation": [0.5] * WIDTH, "info": [0.0] * INFO}[field]):
        environment.reset(seed=1)
        server.answers[service] = transition(step, **{field: values})
        with pytest.raises(
            walker_sim.ConnectionError, match=f"its answer's {field} has {len(values)} elements;"
        ):
            call()
        server.answers[service] = RIGHT[service]
        assert_goes_on(environment)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"num_envs": 0}, r"num_envs is 0; must be in \[1, 100000\]"),
        ({"num_envs": LARGEST}, rf"num_envs is {LARGEST}; must be in \[1, 100000\]"),
        ({"observation_size": LARGEST}, f"observation_low has {WIDTH} .* have {LARGEST}"),
        ({"observation_low": []}, f"observation_low has 0 elements; must have {WIDTH}"),
        ({"action_high": [1.0] * 7}, "action_high has 7 elements; must have 6"),
        ({"joint_names": []}, "joint_names has 0 elements; must have 6"),
    ],
    ids=["no-envs", "many-envs", "size", "low", "high", "joints"],
)
def test_a_specification_that_cannot_be(server, changes, words):
    server.answers["get_spec"] = specification(**changes)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # [KiB]
    with pytest.raises(walker_sim.ConnectionError, match=f"/get_spec at .*: its answer's {words};"):
        gymnasium.make_vec(
            f"walker_sim/{ENV}", NUM_ENVS, transport="ros", master_uri=server.master_uri
        )
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 18
    make_batch(server).reset(seed=1)


@pytest.mark.parametrize("width", [0, 3, 10 * WIDTH])
def test_a_server_that_contradicts_its_id(server, width):
    """The answers match the server's specification, but not the environment's observation size."""
    rows = [0.5] * width
    server.answers["get_spec"] = specification(
        observation_size=width, observation_low=rows, observation_high=rows
    )
    client = _core.Client(ENV, {}, "/walker_sim", server.master_uri, LONG)
    server.answers["reset_batch"] = batch_reset(observations=rows * NUM_ENVS)
    server.answers["step_batch"] = batch_step(observations=rows * NUM_ENVS, final_observations=rows)
    observations, info = np.zeros((NUM_ENVS, WIDTH)), np.zeros((NUM_ENVS, INFO))
    flags = np.zeros((2, NUM_ENVS), bool)
    words = f"{{}} values of observations where {NUM_ENVS * WIDTH} were expected"
    with pytest.raises(walker_sim.ConnectionError, match=words.format(NUM_ENVS * width)):
        client.reset_batch([], [], observations, info)
    assert client.is_lost
    wide = np.zeros((NUM_ENVS, width))
    other = _core.Client(ENV, {}, "/walker_sim", server.master_uri, LONG)
    other.reset_batch([], [], wide, info)
    other.step_batch(np.zeros((NUM_ENVS, 6)), (wide, np.zeros(NUM_ENVS), *flags, info))
    with pytest.raises(walker_sim.ConnectionError, match=words.format(NUM_ENVS * width)):
        other.final_rows(observations, info)


def test_an_environment_that_is_not_there(server):
    """The client checks the index itself, even if the server accepts any index."""
    server.answers["get_spec"] = specification()
    client = _core.Client(ENV, {}, "/walker_sim", server.master_uri, LONG)
    server.answers["reset_batch"] = batch_reset(observations=[0.5] * WIDTH, info=[0.0] * INFO)
    for environment in (NUM_ENVS, LARGEST):
        with pytest.raises(
            IndexError, match=rf"environment {environment}: must be in \[0, {NUM_ENVS - 1}\]"
        ):
            client.reset_batch([environment], [], np.zeros((1, WIDTH)), np.zeros((1, INFO)))
    assert not client.is_lost


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"data": b""}, "0 bytes of data came instead of 18"),
        ({"data": bytes(17)}, "17 bytes of data came instead of 18"),
        ({"data": bytes(19)}, "19 bytes of data came instead of 18"),
        ({"encoding": "32FC1"}, "the picture's encoding is 32FC1 instead of rgb8"),
        ({"width": 2, "height": 3}, "the picture's width is 2 instead of 3"),
        ({"width": 2**31, "height": 2**31}, f"the picture's width is {2**31} instead of 3"),
    ],
    ids=["none", "short", "long", "encoding", "upright", "large"],
)
def test_a_picture_that_is_none(server, changes, words):
    environment = make_single(server, render_mode="rgb_array", width=3, height=2)
    environment.reset(seed=1)
    server.answers["render"] = picture()
    assert environment.render().shape == (2, 3, 3)
    server.answers["render"] = picture(**changes)
    with pytest.raises(walker_sim.ConnectionError, match=f"/render at .*: {words};"):
        environment.render()
    server.answers["render"] = picture()
    assert environment.render().tobytes() == bytes(range(18))
    environment.step(zeros(environment))


# ---------------------------------------------------------------- texts


def test_texts_that_are_not_utf_8(server):
    server.answers["get_spec"] = specification(num_envs=1, engine_path=b"/\xff", version=b"\xc3(")
    client = _core.Client(ENV, {}, "/walker_sim", server.master_uri, LONG)
    assert client.server_specification["engine_path"] == "/\\xff"
    assert client.server_specification["version"] == "\\xc3("
    environment = make_single(server)
    environment.reset(seed=1)
    server.answers["step"] = transition(error=b"it broke: \xff")
    *_, terminated, _, info = environment.step(zeros(environment))
    assert terminated
    assert info["error"] == "it broke: \\xff"
    environment.reset(seed=1)
    server.answers["step"] = outcome(False, b"no\xfe") + transition()[5:]
    with pytest.raises(walker_sim.RequestRefused, match=r"^no\\xfe$"):
        environment.step(zeros(environment))


def test_failures_of_a_batch_that_are_not_utf_8(server):
    environment = make_batch(server, "disabled")
    failure = {"failed_environments": [0], "failures": [b"it broke: \xff"]}
    server.answers["reset_batch"] = batch_reset(**failure)
    _, info = environment.reset(seed=1)
    assert info["error"][0] == "it broke: \\xff"
    server.answers["reset_batch"] = RIGHT["reset_batch"]
    environment.reset(seed=1)
    failure["failed_environments"] = [1]  # the environment whose episode ended
    server.answers["step_batch"] = batch_step(failed_at_reset=[0], **failure)
    *_, info = environment.step(zeros(environment))
    assert info["error"][1] == "it broke: \\xff"


def test_a_specification_of_many_or_long_texts(server):
    server.answers["get_spec"] = specification(info_names=[""] * 3_000_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # [KiB]
    with pytest.raises(walker_sim.ConnectionError, match="has 3000000 texts; must have at most"):
        connect(server.master_uri, LONG)
    server.answers["get_spec"] = specification(
        num_envs=1, parameters={f"{i}" * 100: "\x1b" * 1000 for i in range(4000)}
    )
    with pytest.raises(walker_sim.ServerMismatch, match=r"and 39\d\d more") as mismatch:
        WalkerEnv(ENV, transport="ros", master_uri=server.master_uri)
    assert len(str(mismatch.value)) < 10_000
    assert str(mismatch.value).isprintable()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 18


# ---------------------------------------------------------------- forks


def in_child(call):
    """Returns the repr of `call`'s result in a forked child."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(writer, repr(call()).encode())
        finally:
            os._exit(0)
    os.close(writer)
    with open(reader, encoding="utf-8") as told:
        text = told.read()
    os.waitpid(child, 0)
    return text


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_amid_a_call(server):
    """The child inherits the connection, and a lock that none of its threads will release."""
    environment = make_single(server)
    assert_works(environment)
    server.may_answer.clear()
    stepping = threading.Thread(target=environment.step, args=(zeros(environment),))
    stepping.start()
    server.asked.wait(LONG)

    def told():
        words = []
        for call in (lambda: environment.step(zeros(environment)), environment.unwrapped.get_state):
            try:
                call()
            except walker_sim.ConnectionError as error:
                words.append(str(error))
        return words

    words = in_child(told)
    assert words.count("this client was made before a fork") == 2, words
    server.may_answer.set()
    stepping.join()
    assert in_child(lambda: assert_works(environment)) == "None"
    assert_works(environment)


# ---------------------------------------------------------------- a master that never ends


@pytest.fixture
def dripping_master():
    """A master that sends an endless header field byte by byte. Yields its URI."""
    has_ended = threading.Event()

    def drip(listener):
        with contextlib.suppress(OSError):
            connection, _ = listener.accept()
            with connection:
                connection.sendall(b"HTTP/1.1 200 OK\r\nfield: ")
                while not has_ended.wait(0.002):
                    connection.sendall(b"x")

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=drip, args=(listener,))
        thread.start()
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        has_ended.set()
        listener.shutdown(socket.SHUT_RDWR)
        thread.join()


def connect(uri, timeout):
    return _core.Client(ENV, {}, "/walker_sim", uri, timeout)


def test_a_master_that_never_ends_is_given_up(dripping_master):
    with pytest.raises(walker_sim.ConnectionError, match="timed out; is it running"):
        connect(dripping_master, 0.1)


def test_ctrl_c_ends_a_call_to_a_master_that_never_ends(dripping_master):
    sender = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    sender.start()
    with pytest.raises(KeyboardInterrupt):
        connect(dripping_master, LONG)
    sender.join()
