"""The server is stopped for seconds: an error at the client's timeout, or the correct answer."""

import signal
import threading
import time

import walker_sim
from graph import await_true
from walk import Pair

TIMEOUT = 1.0  # client's timeout [s]
SLACK = 1.0


def run(soak):
    timeouts = 0
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, TIMEOUT)
        for number in soak.rounds():
            pair.reset(number)
            pair.steps(5)
            # Far enough from the timeout to make the outcome certain.
            pause = soak.random.choice([0.3, 2.5 * TIMEOUT])
            server.send(signal.SIGSTOP)
            waker = threading.Timer(pause, server.send, [signal.SIGCONT])
            begin = time.monotonic()
            waker.start()
            try:
                equal, told = pair.step(), ""
            except walker_sim.ConnectionError as error:
                equal, told = True, str(error)
            took = time.monotonic() - begin
            if pause > TIMEOUT:
                timeouts += 1
                soak.check(
                    "a server that is silent for longer than the timeout is told of, at it",
                    "timed out" in told and TIMEOUT <= took < TIMEOUT + SLACK,
                    f"{told!r} after {took:.2f} s",
                )
            else:
                soak.check(
                    "a server that is silent for less gives the right answer", equal and not told
                )
            waker.join()
            equal = await_true(lambda: works_again(pair), "the server to go on")
            soak.check("once it goes on the bits are right", equal == "equal", f"round {number}")
        pair.close()
    soak.figure("timeouts among them", timeouts)


def works_again(pair):
    try:
        return "equal" if pair.reset(7) and pair.steps(20) else "other"
    except walker_sim.ConnectionError:
        return ""
