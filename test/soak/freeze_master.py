"""The master hangs and resumes: steps go on, new clients time out, and the server can end."""

import signal
import time

import walker_sim
from graph import PROMPT
from walk import Pair

TIMEOUT = 1.0  # client's timeout [s]


def run(soak):
    slowest = 0.0
    with soak.graph() as graph:
        server = graph.server()
        for number in soak.rounds():
            pair = Pair(server.name, graph.uri, 10.0)
            equal = pair.reset(number) and pair.step()  # opens both connections
            graph.master.send(signal.SIGSTOP)
            end = time.monotonic() + soak.random.uniform(0.2, 2.0)
            while time.monotonic() < end:
                begin = time.monotonic()
                equal = pair.step() and equal
                slowest = max(slowest, time.monotonic() - begin)
            soak.check("steps go on, with the right bits", equal, f"round {number}")
            begin, told = time.monotonic(), ""
            try:
                Pair(server.name, graph.uri, TIMEOUT)
            except walker_sim.ConnectionError as error:
                told = str(error)
            took = time.monotonic() - begin
            soak.check(
                "a new client is told of the master at its timeout",
                "master" in told and took < TIMEOUT + 1,
                f"{told} after {took:.2f} s",
            )
            if number % 5 == 4:
                status = server.end(soak.random.choice([signal.SIGINT, signal.SIGTERM]))
                soak.check(
                    f"the server ends within {PROMPT} s when it is told to",
                    status == 0,
                    f"status {status}: {server.output()}",
                )
            graph.master.send(signal.SIGCONT)
            pair.close()
            if server.process.poll() is not None:
                server = graph.server()
            pair = Pair(server.name, graph.uri, 30.0)
            equal = pair.reset(number) and pair.steps(20)
            soak.check("once it goes on new clients are served", equal, f"round {number}")
            pair.close()
    soak.figure("slowest step while the master hangs [s]", f"{slowest:.3f}")
