"""50 subscribers: each receives every step in order, and the walker's bits stay correct."""

import functools
import selectors
import struct
import threading

import usage
from bare_ros import BareSubscriber
from graph import await_true
from walk import Pair
from walker_sim.msg import Transition

SUBSCRIBERS = 50


class Readers:
    def __init__(self, uri):
        self._selector = selectors.DefaultSelector()
        self._over = False
        self.subscribers = [
            BareSubscriber(uri, "/transition", Transition) for _ in range(SUBSCRIBERS)
        ]
        self.seen = {subscriber: [] for subscriber in self.subscribers}
        self._bytes = {subscriber: b"" for subscriber in self.subscribers}
        for subscriber in self.subscribers:
            self._selector.register(subscriber.connection, selectors.EVENT_READ, subscriber)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self):
        while not self._over:
            for key, _ in self._selector.select(0.1):
                subscriber = key.data
                data = self._bytes[subscriber] + subscriber.connection.recv(1 << 20)
                while len(data) >= 8 and len(data) >= 4 + struct.unpack_from("<I", data)[0]:
                    size, sequence = struct.unpack_from("<II", data)
                    self.seen[subscriber].append(sequence)
                    data = data[4 + size :]
                self._bytes[subscriber] = data

    def have(self, count):
        return all(len(seen) >= count for seen in self.seen.values())

    def close(self):
        self._over = True
        self._thread.join()
        for subscriber in self.subscribers:
            subscriber.close()


def run(soak):
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        pair.reset(0)
        pair.step()
        before = usage.now(server.pid)
        readers = Readers(graph.node_uri(server.name))
        watched, latency, told = usage.Usage(server.pid), usage.Latency(), 0
        soak.begin()
        while told == 0 or soak.goes_on():
            equal = True
            for _ in range(50):  # less than the queue size
                with latency:
                    equal = pair.step() and equal
            soak.check("the bits are right", equal)
            told += 50
            await_true(functools.partial(readers.have, told), "all subscribers to have all steps")
            watched.sample()
        whole = all(seen == list(range(seen[0], seen[0] + told)) for seen in readers.seen.values())
        soak.check(f"each of {SUBSCRIBERS} subscribers gets each step once and in order", whole)
        watched.judge(soak.tally, "the server", f"{told:,} steps to {SUBSCRIBERS} subscribers")
        latency.judge(soak.tally, f"a step beside {SUBSCRIBERS} subscribers")
        readers.close()
        pair.steps(5)  # the server notices closed connections when it writes
        watched.judge_handles(soak.tally, "the server", before)
        pair.close()
