"""A client in a network of its own: `far_client.py SOCKET SERVER NODE_URI MASTER_URI TIMEOUT`.

It sends its end of the link through the socket, with a byte. Then it reads lines, and answers each
with one of JSON: `begin`, once the link is there; `walk SEED STEPS`, which steps the walker over
ROS and in process; and `got`, what a subscriber of the transitions has got.
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
    """Keeps the numbers of the messages' headers, for as long as there are any."""
    subscriber.connection.settimeout(None)
    with contextlib.suppress(OSError):
        while True:
            sequence.append(subscriber.next().header.seq)


def walk(pair, seed, steps):
    """Whether all was equal until an error, the error if there was one, how long its call took."""
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
