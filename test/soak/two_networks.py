"""Two networks, as of two machines, and a link between them that delays and loses packets.

Each end of the link is a TUN device in its own network namespace. This process reads the IP packets
that the kernel sends to one end, and writes them to the other end, later or not at all.
"""

import contextlib
import ctypes
import fcntl
import heapq
import os
import random
import select
import socket
import struct
import threading
import time

NEAR, FAR = "10.73.0.1", "10.73.0.2"  # the ends' addresses, invisible elsewhere
MASK = "255.255.255.0"
CLONE_NEWNET = 0x40000000  # from Linux: sched.h, if_tun.h, sockios.h, if.h
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
SIOCSIFFLAGS, SIOCSIFADDR, SIOCSIFNETMASK = 0x8914, 0x8916, 0x891C
IFF_UP = 0x1
MAX_PACKET = 65536  # [bytes]


def _call(name, *arguments):
    """Calls a function of the C library that Python has only from 3.12 on."""
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments):
        number = ctypes.get_errno()
        raise OSError(number, f"{name}: {os.strerror(number)}")


@contextlib.contextmanager
def own_network():
    """Gives this thread, and its children, its own network within the context; OSError without the
    privilege."""
    with open("/proc/thread-self/ns/net", "rb") as before:
        _call("unshare", CLONE_NEWNET)
        try:
            _configure("lo", "127.0.0.1", "255.0.0.0")
            yield
        finally:
            _call("setns", before.fileno(), CLONE_NEWNET)


def _configure(device, address, mask):
    name = device.encode()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for number, value in ((SIOCSIFADDR, address), (SIOCSIFNETMASK, mask)):
            packed = struct.pack("16sHH4s16x", name, socket.AF_INET, 0, socket.inet_aton(value))
            fcntl.ioctl(any_socket, number, packed)
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sH22x", name, IFF_UP))


def open_end(address):
    """Returns a descriptor that reads and writes the IP packets of this thread's network."""
    end = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(end, TUNSETIFF, struct.pack("16sH22x", b"link", IFF_TUN | IFF_NO_PI))
    _configure("link", address, MASK)
    return end


class Link:
    """Forwards packets between two ends. Its attributes may change at any time."""

    def __init__(self, near, far):
        self.delay = (0.0, 0.0)  # minimum and maximum per packet [s]; a range reorders
        self.loss = 0.0  # share of lost packets; 1 is a cut cable
        self.passed = self.lost = 0
        self._other = {near: far, far: near}
        self._under_way = []  # (due time, number, destination, packet)
        self._over = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._over:
            wait = self._under_way[0][0] - time.monotonic() if self._under_way else 0.1
            for end in select.select([*self._other], [], [], min(max(wait, 0), 0.1))[0]:
                self._take(self._other[end], os.read(end, MAX_PACKET))
            while self._under_way and self._under_way[0][0] <= time.monotonic():
                _, _, end, packet = heapq.heappop(self._under_way)
                os.write(end, packet)

    def _take(self, other, packet):
        if random.random() < self.loss:
            self.lost += 1
            return
        self.passed += 1
        due = time.monotonic() + random.uniform(*self.delay)
        heapq.heappush(self._under_way, (due, self.passed, other, packet))

    def close(self):
        self._over = True
        self._thread.join()
        for end in self._other:
            os.close(end)
