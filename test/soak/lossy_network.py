"""Server and client on two networks that delay, reorder and lose packets.

The client is a process of its own, which runs this file: `main` below.
"""

import contextlib
import json
import os
import socket
import sys
import threading
import time

import two_networks
import walker_sim
from bare_ros import BareSubscriber
from graph import await_true
from walk import Pair
from walker_sim.msg import Transition

TIMEOUT = 5.0  # client's timeout [s]
SLACK = 1.0
CONDITIONS = [(0.0, 0.05), (0.01, 0.01), (0.03, 0.002)]  # packet loss, maximum delay [s]


def lossy_network(soak):
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(two_networks.own_network())
            near = two_networks.open_end(two_networks.NEAR)
        except OSError as error:
            soak.leave_out(f"without networks of its own ({error})")
            return
        graph = stack.enter_context(soak.graph(two_networks.NEAR))
        server = graph.server()
        far, made = Far(graph, server), []
        near_subscriber = BareSubscriber(graph.node_uri(server.name), "/transition", Transition)
        threading.Thread(target=listen, args=(near_subscriber, made), daemon=True).start()
        link = two_networks.Link(near, far.end)
        stack.callback(link.close)
        far.ask("begin")
        for number in soak.rounds():
            loss, max_delay = soak.random.choice(CONDITIONS)
            link.delay, link.loss = (0.0, max_delay), loss
            found = far.ask("walk", soak.random.randrange(1 << 32), 20)
            soak.check(
                "with delays and losses: the right bits, or an error in time",
                found["equal"] and (not found["error"] or is_expected(found)),
                f"{loss}, {max_delay} s: {found}",
            )
            if number % 4 == 3:
                link.loss = 1.0
                found = far.ask("walk", 0, 1)
                soak.check(
                    "on a cut cable the call fails at the client's timeout",
                    is_in_time(found),
                    found,
                )
            link.delay, link.loss = (0.0, 0.0), 0.0
            found = await_true(lambda: served(far), "the server behind the network")
            soak.check("mended, it serves with the right bits", found["equal"], found)
            received = await_true(
                lambda: received_by(far, made), "a far subscriber to have the last step"
            )
            in_order = received == [*range(received[0], received[0] + len(received))]
            soak.check(
                "a far subscriber gets each step once and in order", in_order, received[-100:]
            )
        soak.figure("packets that passed; lost", f"{link.passed:,}; {link.lost:,}")
        soak.figure("steps that a far subscriber has received", f"{len(received):,}")
        far.close()
        near_subscriber.close()


def is_expected(found):
    """Whether the error is expected. A failed call's request may arrive after the next call."""
    return "had failed; reset first" in found["error"] or is_in_time(found)


def is_in_time(found):
    return "timed out" in found["error"] and found["took"] < TIMEOUT + SLACK


def received_by(far, made):
    """Returns what the far subscriber has received, once it has the near subscriber's last."""
    latest = made[-1]
    received = far.ask("received")
    return received if received and received[-1] >= latest else None


def served(far):
    found = far.ask("walk", 1, 10)
    return not found["error"] and found


class Far:
    def __init__(self, graph, server):
        ours, theirs = socket.socketpair()
        uris = [graph.node_uri(server.name), graph.uri]
        command = [sys.executable, __file__, theirs.fileno(), server.name, *uris]
        path = {"PYTHONPATH": os.pathsep.join(sys.path)}
        self._node = graph.start(command, environment=path, pass_fds=[theirs.fileno()])
        theirs.close()
        _, ends, _, _ = socket.recv_fds(ours, 1, 1)
        self.end = ends[0]
        self._control, self._answers = ours, ours.makefile()

    def ask(self, *words):
        self._control.sendall(" ".join(map(str, words)).encode() + b"\n")
        line = self._answers.readline()
        if not line:
            raise RuntimeError(f"the far client ended:\n{self._node.output()}")
        return json.loads(line)

    def close(self):
        self._answers.close()
        self._control.close()
        self._node.end()


def listen(subscriber, sequence):
    subscriber.connection.settimeout(None)
    with contextlib.suppress(OSError):
        while True:
            sequence.append(subscriber.next().header.seq)


def walk(pair, seed, steps):
    """Returns whether all was equal up to an error, the error, and the duration of its call."""
    equal, begin = True, time.monotonic()
    try:
        equal = pair.reset(seed)
        for _ in range(steps):
            begin = time.monotonic()
            equal = pair.step() and equal
    except walker_sim.ConnectionError as error:
        return {"equal": equal, "error": str(error), "took": time.monotonic() - begin}
    return {"equal": equal, "error": "", "took": 0.0}


def main():
    """A client in its own network.

    It sends its end of the link through the socket, with one byte. Then it answers each input line
    with a line of JSON: `begin`, once the link exists; `walk SEED STEPS`, which steps the walker
    over ROS and in process; and `received`, which returns what a subscriber of the transitions has
    received.
    """
    control = socket.socket(fileno=int(sys.argv[1]))
    server, node_uri, master_uri = sys.argv[2:]
    with two_networks.own_network():
        socket.send_fds(control, [b"."], [two_networks.open_end(two_networks.FAR)])
        for line in control.makefile():
            word, *numbers = line.split()
            if word == "begin":
                subscriber, sequence = BareSubscriber(node_uri, "/transition", Transition), []
                threading.Thread(target=listen, args=(subscriber, sequence), daemon=True).start()
                pair = Pair(server, master_uri, TIMEOUT)
                answer = True
            elif word == "walk":
                answer = walk(pair, *map(int, numbers))
            else:
                answer = sequence[:]
            control.sendall(json.dumps(answer).encode() + b"\n")
        pair.close()


if __name__ == "__main__":
    main()
