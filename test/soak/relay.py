"""A relay between client and server that delays, stalls and cuts, and a master that leads clients
through it. Plain sockets need neither privileges nor kernel features."""

import contextlib
import random
import socket
import struct
import threading
import time
import xmlrpc.client
import xmlrpc.server


class Relay:
    """Forwards connections to an address. Its attributes may change at any time."""

    def __init__(self, address):
        self.delay = (0.0, 0.0)  # minimum and maximum per piece [s]
        self.piece = 65536  # maximum bytes per piece
        self.stalls = threading.Event()  # while set, forwards nothing
        self._address, self._connections = address, set()
        self._listener = socket.create_server(("localhost", 0))
        self.port = self._listener.getsockname()[1]
        self._start(self._accept)

    @staticmethod
    def _start(call, *arguments):
        threading.Thread(target=call, args=arguments, daemon=True).start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(self._address)
                self._connections |= {client, server}
                for one, other in ((client, server), (server, client)):
                    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._start(self._pass, one, other)

    def _pass(self, source, sink):
        with contextlib.suppress(OSError, ValueError):
            while True:
                data = source.recv(65536)
                while data:
                    time.sleep(random.uniform(*self.delay))
                    while self.stalls.is_set():
                        time.sleep(0.01)
                    sink.sendall(data[: self.piece])
                    data = data[self.piece :]
                    if not data:
                        break
                else:
                    break
        for one in (source, sink):
            self._connections.discard(one)
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def cut(self):
        """Shuts all connections down; closing them sends an RST."""
        for one in [*self._connections]:
            with contextlib.suppress(OSError):
                one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                one.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._listener.close()
        self.stalls.clear()
        self.cut()


class Leading(xmlrpc.server.SimpleXMLRPCServer):
    def __init__(self, real_uri, port):
        super().__init__(("localhost", 0), logRequests=False, allow_none=True)
        self._real, self._port = real_uri, port
        self.uri = f"http://localhost:{self.server_address[1]}"
        self.register_function(self._look_up, "lookupService")
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def _look_up(self, caller, service):
        with xmlrpc.client.ServerProxy(self._real) as real:
            code, text, uri = real.lookupService(caller, service)
        return code, text, f"rosrpc://localhost:{self._port}" if code == 1 else uri

    def close(self):
        self.shutdown()
        self.server_close()
