"""ROS over plain sockets, for what no client library offers.

That is: incomplete requests, subscribers that do not read, and calls without a master.
"""

import io
import mmap
import os
import socket
import struct
import xmlrpc.client

from processes import CALLER, TIMEOUT, wait_for


def wait_for_service(name, process=None):
    """Waits until the service is registered at the master, or the process ends."""
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    wait_for(lambda: master.lookupService(CALLER, name)[0] == 1, name, process=process)


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


def request_bytes(service_class, **fields):
    buffer = io.BytesIO()
    service_class._request_class(**fields).serialize(buffer)
    return struct.pack("<I", len(buffer.getvalue())) + buffer.getvalue()


def receive_reply(connection):
    """Returns whether the server has replied, and the response's bytes or the reason."""
    fine, size = struct.unpack("<BI", receive_exactly(connection, 5))
    return fine, receive_exactly(connection, size)


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
        return request_bytes(self._class, **fields)

    def __call__(self, **fields):
        self.send(**fields)
        return self.receive()

    def send(self, **fields):
        """Sends a request, whose response `receive` returns. Several may be in flight."""
        self.connection.sendall(self.request_bytes(**fields))

    def receive(self):
        """Waits for the response to the oldest request in flight."""
        fine, data = receive_reply(self.connection)
        if not fine:
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
