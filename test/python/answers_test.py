"""Malformed answers of a server or master raise an error and never access invalid memory."""

import os
import threading

import fake_server as fake
import numpy as np
import pytest
import walker_sim
from fake_server import ENV, INFO, NUM_ENVS, RIGHT, WIDTH, batch_reset, batch_step, specification
from walker_sim import _core
from walker_sim.environment import WalkerEnv
from walkers import make_many

LARGEST = 2**32 - 1
LONG = 60.0  # timeout that only a failing test reaches [s]
LOST = "the server or its episode was lost; reset first"


@pytest.fixture
def server():
    running = fake.FakeServer()
    yield running
    running.close()


def at(server):
    return {"transport": "ros", "master_uri": server.master_uri, "timeout": LONG}


def make_batch(server, autoreset_mode="same_step"):
    server.answers["get_spec"] = specification(autoreset_mode=autoreset_mode)
    return make_many(ENV, NUM_ENVS, autoreset_mode=autoreset_mode, **at(server))


def make_single(server, **options):
    server.answers["get_spec"] = specification(num_envs=1)
    return WalkerEnv(ENV, **at(server), **options)


def connect(server):
    return _core.Client(ENV, {}, "/walker_sim", server.master_uri, LONG)


def zeros(environment):
    return np.zeros(environment.action_space.shape, np.float32)


def assert_works(environment):
    environment.reset(seed=1)
    environment.step(zeros(environment))


CALLS = {
    "reset": lambda environment: environment.reset(seed=1),
    "step": lambda environment: environment.step(zeros(environment)),
}
FEW = [0.5] * (WIDTH - 1)


# test/client/messages_test.cpp has the other answers.
@pytest.mark.parametrize(
    ("service", "answer", "message"),
    [
        ("reset", fake.transition(0, observation=FEW), f"observation has {WIDTH - 1} elements;"),
        ("step", fake.transition(info=[]), f"info has 0 elements; must have {INFO};"),
        ("reset_batch", batch_reset(failures=[""] * 5), "array has 5 texts; must have at most 2"),
        ("step_batch", batch_step(failures=[""] * 5), "array has 5 texts; must have at most 4"),
        ("step_batch", batch_step(failed_at_reset=[1]), "failed_at_reset has 1 elements;"),
    ],
)
def test_invalid_answers(server, service, answer, message):
    name, is_batch, _ = service.partition("_batch")
    environment = make_batch(server) if is_batch else make_single(server)
    assert_works(environment)
    environment.reset(seed=1)
    server.answers[service] = answer
    with pytest.raises(walker_sim.ConnectionError, match=f"its answer's {message}"):
        CALLS[name](environment)
    server.answers[service] = RIGHT[service]
    with pytest.raises(walker_sim.ResetNeeded, match=LOST):
        environment.step(zeros(environment))
    assert_works(environment)


@pytest.mark.parametrize("width", [0, 3, 10 * WIDTH])
def test_answers_of_another_size_than_the_expected_environment(server, width):
    """They match the server's specification, but not the environment's observation size."""
    rows = [0.5] * width
    server.answers["get_spec"] = specification(
        observation_size=width, observation_low=rows, observation_high=rows
    )
    client = connect(server)
    server.answers["reset_batch"] = batch_reset(observations=rows * NUM_ENVS)
    server.answers["step_batch"] = batch_step(observations=rows * NUM_ENVS, final_observations=rows)
    observations, info = np.zeros((NUM_ENVS, WIDTH)), np.zeros((NUM_ENVS, INFO))
    flags = np.zeros((2, NUM_ENVS), bool)
    words = f"{{}} values of observations where {NUM_ENVS * WIDTH} were expected"
    with pytest.raises(walker_sim.ConnectionError, match=words.format(NUM_ENVS * width)):
        client.reset_batch([], [], observations, info)
    assert client.is_lost
    wide = np.zeros((NUM_ENVS, width))
    other = connect(server)
    other.reset_batch([], [], wide, info)
    other.step_batch(np.zeros((NUM_ENVS, 6)), (wide, np.zeros(NUM_ENVS), *flags, info))
    with pytest.raises(walker_sim.ConnectionError, match=words.format(NUM_ENVS * width)):
        other.final_rows(observations, info)


def test_an_index_out_of_range(server):
    """The client checks it even if the server accepts any index."""
    server.answers["get_spec"] = specification()
    client = connect(server)
    server.answers["reset_batch"] = batch_reset(observations=[0.5] * WIDTH, info=[0.0] * INFO)
    for environment in (NUM_ENVS, LARGEST):
        message = rf"environment {environment}: must be in \[0, {NUM_ENVS - 1}\]"
        with pytest.raises(IndexError, match=message):
            client.reset_batch([environment], [], np.zeros((1, WIDTH)), np.zeros((1, INFO)))
    assert not client.is_lost


def test_an_invalid_picture(server):
    environment = make_single(server, render_mode="rgb_array", width=3, height=2)
    environment.reset(seed=1)
    server.answers["render"] = fake.picture(data=bytes(17))
    message = "/render at .*: 17 bytes of data came instead of 18;"
    with pytest.raises(walker_sim.ConnectionError, match=message):
        environment.render()
    server.answers["render"] = fake.picture()
    rgb = environment.render()
    assert (rgb.shape, rgb.tobytes()) == ((2, 3, 3), bytes(range(18)))
    environment.step(zeros(environment))


def test_a_lost_master(server):
    """Open connections need no master; new ones do."""
    environment = make_single(server)
    assert_works(environment)
    server.close()
    assert_works(environment)
    environment.close()
    with pytest.raises(walker_sim.ConnectionError, match=r"^ROS master .*is it running, and is"):
        environment.reset()


# ---------------------------------------------------------------- texts


def test_texts_that_are_not_utf_8(server):
    server.answers["get_spec"] = specification(num_envs=1, engine_path=b"/\xff", version=b"\xc3(")
    client = connect(server)
    assert client.server_specification["engine_path"] == "/\\xff"
    assert client.server_specification["version"] == "\\xc3("
    environment = make_single(server)
    environment.reset(seed=1)
    server.answers["step"] = fake.transition(error=b"it broke: \xff")
    *_, terminated, _, info = environment.step(zeros(environment))
    assert terminated
    assert info["error"] == "it broke: \\xff"
    environment.reset(seed=1)
    server.answers["step"] = fake.outcome(False, b"no\xfe") + fake.transition()[5:]
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


def test_a_specification_with_many_differences(server):
    server.answers["get_spec"] = specification(
        num_envs=1, parameters={f"{i}" * 100: "\x1b" * 1000 for i in range(4000)}
    )
    with pytest.raises(walker_sim.ServerMismatch, match=r"and 39\d\d more") as mismatch:
        WalkerEnv(ENV, **at(server))
    assert len(str(mismatch.value)) < 10_000
    assert str(mismatch.value).isprintable()


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
    with open(reader, encoding="utf-8") as pipe:
        text = pipe.read()
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

    def messages():
        errors = []
        for call in (lambda: environment.step(zeros(environment)), environment.unwrapped.get_state):
            try:
                call()
            except walker_sim.ConnectionError as error:
                errors.append(str(error))
        return errors

    words = in_child(messages)
    assert words.count("this client was made before a fork") == 2, words
    server.may_answer.set()
    stepping.join()
    assert in_child(lambda: assert_works(environment)) == "None"
    assert_works(environment)
