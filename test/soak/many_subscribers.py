"""50 subscribers that receive every step in order, and 15 that never read: the walker's bits stay
correct."""

import functools
import selectors
import struct
import threading

import usage
from bare_ros import BareSubscriber
from graph import await_true
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walk import Pair
from walker_sim.msg import Transition

SUBSCRIBERS = 50
SILENT = {"/transition": Transition, "/tf": TFMessage, "/state_markers": MarkerArray}
SILENT_EACH = 5


class Readers:
    def __init__(self, uri):
        self._selector = selectors.DefaultSelector()
        self._over = False
        self.subscribers = [
            BareSubscriber(uri, "/transition", Transition) for _ in range(SUBSCRIBERS)
        ]
        self.received = {subscriber: [] for subscriber in self.subscribers}
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
                    self.received[subscriber].append(sequence)
                    data = data[4 + size :]
                self._bytes[subscriber] = data

    def have(self, count):
        return all(len(received) >= count for received in self.received.values())

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
        uri = graph.node_uri(server.name)
        readers = Readers(uri)
        silent = [
            BareSubscriber(uri, t, kind) for t, kind in SILENT.items() for _ in range(SILENT_EACH)
        ]
        watched, latency, steps = usage.Usage(server.pid), usage.Latency(), 0
        soak.begin()
        while steps == 0 or soak.goes_on():
            equal = True
            for _ in range(50):  # less than the queue size
                with latency:
                    equal = pair.step() and equal
            soak.check("the bits are right", equal)
            steps += 50
            await_true(functools.partial(readers.have, steps), "all subscribers to have all steps")
            watched.sample()
        in_order = all(r == list(range(r[0], r[0] + steps)) for r in readers.received.values())
        soak.check(f"each of {SUBSCRIBERS} subscribers gets each step once and in order", in_order)
        watched.check(soak.tally, "the server", f"{steps:,} steps to {SUBSCRIBERS} subscribers")
        latency.check(soak.tally, f"a step beside {SUBSCRIBERS + len(silent)} subscribers")
        readers.close()
        for subscriber in silent:
            subscriber.close()
        pair.steps(5)  # the server notices closed connections when it writes
        watched.check_handles(soak.tally, "the server", before)
        pair.close()
