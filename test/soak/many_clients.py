"""Clients that connect, call once and disconnect, one after another."""

import socket

import usage
from bare_ros import CALLER, header_bytes, read_header, receive_exactly
from kill_client import request_bytes
from walker_sim.srv import Reset, Step


def run(soak):
    with soak.graph() as graph:
        server = graph.server(max_episode_steps=0)
        reset = graph.client(f"{server.name}/reset", Reset)
        address = graph.address(f"{server.name}/step")
        fields = {"callerid": CALLER, "service": f"{server.name}/step", "md5sum": Step._md5sum}
        request = header_bytes(fields) + request_bytes([1.0, 1.0, -1.0, 1.0])
        reset(has_seed=True, seed=1)
        before = usage.now(server.pid)
        watched, latency, clients, steps, wrong = usage.Usage(server.pid), usage.Latency(), 0, 0, 0
        soak.begin()
        while clients == 0 or soak.goes_on():
            if clients % 1000 == 0:
                reset(has_seed=True, seed=1)
                steps = 0
            with latency:
                reply = call_once(address, request)
            clients += 1
            steps += 1
            wrong += not (reply.success and reply.transition.step == steps)
            watched.sample()
        soak.check("each client's one call is made once", wrong == 0, f"{wrong} of {clients}")
        watched.check(soak.tally, "the server", f"{clients:,} clients")
        watched.check_handles(soak.tally, "the server", before)
        latency.check(soak.tally, "connecting and a step")
        soak.figure("clients one after the other", f"{clients:,}")


def call_once(address, request):
    """Calls on a connection that the server closes after its answer."""
    with socket.create_connection(address, timeout=30) as connection:
        connection.sendall(request)
        read_header(connection)
        fine, size = receive_exactly(connection, 1), receive_exactly(connection, 4)
        data = receive_exactly(connection, int.from_bytes(size, "little"))
        assert fine == b"\x01", data
        assert connection.recv(1) == b"", "more than an answer"
    return Step._response_class().deserialize(data)
