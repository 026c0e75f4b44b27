"""ROS over plain sockets, for what no client library offers.

That is: incomplete requests, subscribers that do not read, calls without a master, and masters that
a test kills.
"""

import io
import mmap
import os
import signal
import socket
import struct
import subprocess
import sys
import time
import xmlrpc.client

import rosgraph
from ros import free_port

TIMEOUT = 30.0  # wall seconds; only a failing test waits that long
CALLER = "/server_test"


def wait_for(condition, what, timeout=TIMEOUT):
    """Returns the first true value; raises AssertionError with `what` after the timeout."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f"timed out after {timeout} s waiting for {what}")
        time.sleep(0.005)


def wait_for_service(name):
    """Waits until the service is registered at the master."""
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    wait_for(lambda: master.lookupService(CALLER, name)[0] == 1, name)


def receive_exactly(connection, size):
    data = b""
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise ConnectionError("the peer closed the connection")
        data += part
    return data


def header_bytes(fields):
    lines = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(body)) + body


def read_header(connection):
    size = struct.unpack("<I", receive_exactly(connection, 4))[0]
    body = receive_exactly(connection, size)
    fields = {}
    while body:
        size = struct.unpack("<I", body[:4])[0]
        key, _, value = body[4 : 4 + size].decode().partition("=")
        fields[key] = value
        body = body[4 + size :]
    return fields


def exchange_headers(connection, peer_class, **fields):
    """Sends a client's or subscriber's header. Returns the peer's."""
    types = {"md5sum": peer_class._md5sum, "type": peer_class._type}
    connection.sendall(header_bytes({**fields, **types}))
    return read_header(connection)


class BareClient:
    """A persistent service client on a socket, without a master or a node."""

    def __init__(self, connection, service, service_class, caller=CALLER):
        self.connection = connection
        # With Nagle's algorithm a second request would wait for the ACK of the first.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._class = service_class
        answer = exchange_headers(
            connection, service_class, callerid=caller, service=service, persistent="1"
        )
        if "error" in answer:
            raise ConnectionError(answer["error"])

    def request_bytes(self, **fields):
        buffer = io.BytesIO()
        self._class._request_class(**fields).serialize(buffer)
        return struct.pack("<I", len(buffer.getvalue())) + buffer.getvalue()

    def __call__(self, **fields):
        self.send(**fields)
        return self.receive()

    def send(self, **fields):
        """Sends a request, whose response `receive` returns. Several may be in flight."""
        self.connection.sendall(self.request_bytes(**fields))

    def receive(self):
        """Waits for the response to the oldest request in flight."""
        fine = receive_exactly(self.connection, 1)
        size = struct.unpack("<I", receive_exactly(self.connection, 4))[0]
        data = receive_exactly(self.connection, size)
        if fine != b"\x01":
            raise RuntimeError(f"the server dropped the reply: {data.decode(errors='replace')}")
        return self._class._response_class().deserialize(data)

    def close(self):
        self.connection.close()


class SharedConnection:
    """The memory that a server shares on its local socket (src/wire/channel.h), like a socket.

    Wakes the server at each write, and polls instead of being woken.
    """

    CAPACITY = 1 << 16
    READ, BYTES = 64, 128  # offsets in a ring; that of the written count is 0
    ANSWERS = BYTES + CAPACITY  # offset of the second ring

    def __init__(self, port):
        self.local = socket.socket(socket.AF_UNIX)
        self.local.settimeout(TIMEOUT)
        self.local.connect(f"\0walker_sim/{port}")
        _, (descriptor,), _, _ = socket.recv_fds(self.local, 1, 1)
        self.memory = mmap.mmap(descriptor, 2 * self.ANSWERS)
        os.close(descriptor)

    def count(self, offset):
        return struct.unpack_from("<I", self.memory, offset)[0]

    def set_count(self, offset, value):
        struct.pack_into("<I", self.memory, offset, value % 2**32)

    def setsockopt(self, *_):
        pass

    def sendall(self, data):
        for byte in data:
            written = self.count(0)
            wait_for(lambda n=written: n - self.count(self.READ) < self.CAPACITY, "room")
            self.memory[self.BYTES + written % self.CAPACITY] = byte
            self.set_count(0, written + 1)
        self.local.send(b"x")

    def recv(self, size):
        read = self.count(self.ANSWERS + self.READ)
        wait_for(lambda: self.count(self.ANSWERS) != read, "an answer in shared memory")
        size = min(size, self.count(self.ANSWERS) - read)
        begin = self.ANSWERS + self.BYTES
        data = bytes(self.memory[begin + (read + i) % self.CAPACITY] for i in range(size))
        self.set_count(self.ANSWERS + self.READ, read + size)
        self.local.send(b"x")
        return data

    def close(self):
        self.local.close()
        self.memory.close()


class BareSubscriber:
    """A subscriber on a socket, without a master: reads one publisher's messages in order."""

    def __init__(self, publisher_uri, topic, message_class):
        publisher = xmlrpc.client.ServerProxy(publisher_uri)
        code, text, protocol = publisher.requestTopic(CALLER, topic, [["TCPROS"]])
        assert code == 1, text
        self._class = message_class
        self.connection = socket.create_connection((protocol[1], protocol[2]), timeout=TIMEOUT)
        header = exchange_headers(
            self.connection, message_class, callerid=CALLER, topic=topic, tcp_nodelay="1"
        )
        assert "error" not in header, header

    def next(self):
        size = struct.unpack("<I", receive_exactly(self.connection, 4))[0]
        return self._class().deserialize(receive_exactly(self.connection, size))

    def close(self):
        self.connection.close()


class OwnMaster:
    """A ROS master that a test can kill or halt."""

    def __init__(self):
        self.port = free_port()
        self.uri = f"http://localhost:{self.port}"
        code = "import rosmaster; rosmaster.rosmaster_main()"
        self._process = subprocess.Popen(
            [sys.executable, "-c", code, "--core", "-p", str(self.port)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        wait_for(self._answers, "the test's own master")

    def _answers(self):
        try:
            rosgraph.Master(CALLER, self.uri).getPid()
        except OSError:
            return False
        return True

    def hang(self):
        """Halts the master: the kernel still accepts connections, but nothing answers."""
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self):
        self._process.send_signal(signal.SIGCONT)

    def kill(self):
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
