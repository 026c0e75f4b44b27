"""A client in its own network: `far_client.py SOCKET SERVER NODE_URI MASTER_URI TIMEOUT`.

It sends its end of the link through the socket, with one byte. Then it answers each input line
with a line of JSON: `begin`, once the link exists; `walk SEED STEPS`, which steps the walker over
ROS and in process; and `received`, which returns what a subscriber of the transitions has received.
"""

import contextlib
import json
import pathlib
import socket
import sys
import threading
import time

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST / "server"), str(TEST / "python")]

import two_networks  # noqa: E402
import walker_sim  # noqa: E402
from bare_ros import BareSubscriber  # noqa: E402
from walk import Pair  # noqa: E402
from walker_sim.msg import Transition  # noqa: E402


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
    control = socket.socket(fileno=int(sys.argv[1]))
    server, node_uri, master_uri, timeout = sys.argv[2:]
    with two_networks.own_network():
        socket.send_fds(control, [b"."], [two_networks.open_end(two_networks.FAR)])
        for line in control.makefile():
            word, *numbers = line.split()
            if word == "begin":
                subscriber, sequence = BareSubscriber(node_uri, "/transition", Transition), []
                threading.Thread(target=listen, args=(subscriber, sequence), daemon=True).start()
                pair = Pair(server, master_uri, float(timeout))
                answer = True
            elif word == "walk":
                answer = walk(pair, *map(int, numbers))
            else:
                answer = sequence[:]
            control.sendall(json.dumps(answer).encode() + b"\n")
        pair.close()


if __name__ == "__main__":
    main()
