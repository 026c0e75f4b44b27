"""The network delays, fragments, stalls and breaks: correct bits, or an error in time."""

import functools
import threading
import time

import walker_sim
from graph import await_true
from relay import Leading, Relay
from walk import Pair

TIMEOUT = 2.0  # client's timeout [s]
SLACK = 1.0


def run(soak):
    with soak.graph() as graph:
        server = graph.server()
        relay = Relay(graph.address(f"{server.name}/step"))
        graph.callback(relay.close)
        master = Leading(graph.uri, relay.port)
        graph.callback(master.close)
        pair = Pair(server.name, master.uri, TIMEOUT)
        for number in soak.rounds():
            max_delay, relay.piece = soak.random.choice([(0.02, 65536), (0.001, 100), (0.0, 7)])
            relay.delay = (0.0, max_delay)
            equal = await_true(
                functools.partial(works, pair, number), "the server behind the network"
            )
            soak.check(
                "with delays and in pieces the bits are right",
                equal == "equal",
                f"{relay.delay}, {relay.piece} bytes",
            )
            relay.delay = (0.0, 0.0)
            if number % 2:
                stall(soak, relay, pair)
            else:
                cut(soak, relay, pair)
        relay.piece = 65536
        equal = await_true(lambda: works(pair, 0), "the server behind the network")
        soak.check("in the end it serves, with the right bits", equal == "equal")
        pair.close()


def stall(soak, relay, pair):
    relay.stalls.set()
    begin, message = time.monotonic(), ""
    try:
        pair.step()
    except walker_sim.ConnectionError as error:
        message = str(error)
    took = time.monotonic() - begin
    soak.check(
        "on a stalled network the call fails at the client's timeout",
        "timed out" in message and TIMEOUT <= took < TIMEOUT + SLACK,
        f"{message!r} after {took:.2f} s",
    )
    relay.stalls.clear()


def cut(soak, relay, pair):
    cutter = threading.Timer(soak.random.uniform(0, 0.1), relay.cut)
    cutter.start()
    message, equal, end = "", True, time.monotonic() + 30
    while not message and time.monotonic() < end:
        try:
            equal = pair.step() and equal
        except walker_sim.ConnectionError as error:
            message = str(error)
    cutter.join()
    soak.check("up to a cut the bits are right", equal)
    # A step that a stall has delayed may arrive amid these steps, too.
    is_named = "/walker_sim" in message or "somebody else has moved" in message
    soak.check("on a cut network the call fails with the reason", is_named, message)


def works(pair, seed):
    try:
        return "equal" if pair.reset(seed) and pair.steps(10) else "other"
    except walker_sim.ConnectionError:
        time.sleep(0.02)
        return ""
