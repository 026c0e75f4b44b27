"""The master is killed: connected clients go on, new clients get an error, the server can end."""

import signal
import threading
import time

import walker_sim
from graph import SHUTDOWN_TIMEOUT
from walk import Pair

TIMEOUT = 2.0  # client's timeout [s]


def run(soak):
    for number in soak.rounds():
        with soak.graph() as graph:
            server = graph.server()
            pair = Pair(server.name, graph.uri, TIMEOUT)
            equal = pair.reset(number) and pair.step()  # opens both connections
            killer = threading.Timer(soak.random.uniform(0, 0.1), graph.master.kill)
            killer.start()
            while killer.is_alive():
                equal = pair.step() and equal
            killer.join()
            equal = pair.steps(300) and equal and pair.reset(number) and pair.steps(20)
            soak.check("steps and resets go on, with the right bits", equal, f"round {number}")
            begin, message = time.monotonic(), ""
            try:
                Pair(server.name, graph.uri, TIMEOUT)
            except walker_sim.ConnectionError as error:
                message = str(error)
            soak.check(
                "a new client gets an error that names the master, within its timeout",
                "master" in message and time.monotonic() - begin < TIMEOUT + 1,
                message,
            )
            pair.close()
            by = soak.random.choice([signal.SIGINT, signal.SIGTERM])
            status = server.end(by)
            soak.check(
                f"the server ends within {SHUTDOWN_TIMEOUT} s after a signal",
                status == 0,
                f"status {status} after {by.name}: {server.output()}",
            )
