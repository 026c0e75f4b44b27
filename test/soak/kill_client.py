"""Clients are killed amid their calls: other clients are unaffected, and nothing leaks."""

import io
import struct
import sys
import time

import usage
from bare_ros import CALLER, header_bytes
from graph import await_true
from walk import Pair
from walker_sim.srv import Step

# Sends the header, then the request in a loop. Does not import this package, to start sooner.
VICTIM = """
import socket, sys
host, port, header, request = sys.argv[1:]
connection = socket.create_connection((host, int(port)))
connection.sendall(bytes.fromhex(header))
print("runs", flush=True)
while True:
    connection.sendall(bytes.fromhex(request))
    connection.recv(4096)
"""


def request_bytes(action):
    buffer = io.BytesIO()
    Step._request_class(action=action).serialize(buffer)
    return struct.pack("<I", len(buffer.getvalue())) + buffer.getvalue()


def run(soak):
    with soak.graph() as graph:
        server = graph.server()
        pair = Pair(server.name, graph.uri, 10.0)
        pair.reset(1)
        pair.step()
        fields = {"callerid": CALLER, "service": f"{server.name}/step", "persistent": "1"}
        header = header_bytes({**fields, "md5sum": Step._md5sum})
        host, port = graph.address(f"{server.name}/step")
        before = usage.now(server.pid)
        request = request_bytes([0.1, -0.1, 0.2, 0.0])
        for number in soak.rounds():
            words = [host, port, header.hex(), request.hex()]
            victim = graph.start([sys.executable, "-S", "-c", VICTIM, *words])
            end = time.monotonic() + 30
            while "runs" not in victim.output() and time.monotonic() < end:
                time.sleep(0.002)
            time.sleep(soak.random.uniform(0, 0.05))
            victim.kill()
            # The server still executes a request that it has received. Once it serves a later
            # client, the victim's connection is no longer in the backlog.
            graph.client(f"{server.name}/step", Step).close()
            await_true(lambda: usage.now(server.pid)[1] <= before[1], "its connection to go")
            equal = pair.reset(soak.random.randrange(1 << 32)) and pair.steps(20)
            soak.check("another client's bits are right", equal, f"round {number}")
        soak.check("the server runs", server.process.poll() is None, server.output())
        usage.Usage(server.pid).check_handles(soak.tally, "the server", before)
        pair.close()
