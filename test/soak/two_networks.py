"""Two networks, as of two machines, and a link between them that delays and loses packets.

Each end of the link is a TUN device in a network namespace of its own. What the system sends there
this process reads as IP packets, and hands on to the other end, later or not at all.
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

NEAR, FAR = "10.73.0.1", "10.73.0.2"  # the ends' addresses, which nothing else can see
MASK = "255.255.255.0"
CLONE_NEWNET = 0x40000000  # these are Linux's: sched.h, if_tun.h, sockios.h, if.h
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
SIOCSIFFLAGS, SIOCSIFADDR, SIOCSIFNETMASK = 0x8914, 0x8916, 0x891C
IFF_UP = 0x1
MOST = 65536  # bytes of a packet


def _call(name, *arguments):
    """Of the C library, for Python has it from 3.12 on alone."""
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments):
        number = ctypes.get_errno()
        raise OSError(number, f"{name}: {os.strerror(number)}")


@contextlib.contextmanager
def own_network():
    """Within it this thread, and what it starts, has a network of its own; OSError without the
    right to have one."""
    with open("/proc/thread-self/ns/net", "rb") as before:
        _call("unshare", CLONE_NEWNET)
        try:
            _configure("lo", "127.0.0.1", "255.0.0.0")
            yield
        finally:
            _call("setns", before.fileno(), CLONE_NEWNET)


def _configure(device, address, mask):
    """Gives it the address, and switches it on."""
    name = device.encode()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for number, value in ((SIOCSIFADDR, address), (SIOCSIFNETMASK, mask)):
            packed = struct.pack("16sHH4s16x", name, socket.AF_INET, 0, socket.inet_aton(value))
            fcntl.ioctl(any_socket, number, packed)
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sH22x", name, IFF_UP))


def open_end(address):
    """A descriptor from which IP packets are read, and written to, for this thread's network."""
    end = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(end, TUNSETIFF, struct.pack("16sH22x", b"link", IFF_TUN | IFF_NO_PI))
    _configure("link", address, MASK)
    return end


class Link:
    """Hands packets on between two ends, by what its attributes say at the time."""

    def __init__(self, near, far):
        self.delay = (0.0, 0.0)  # of each packet, least and most, so that some overtake others [s]
        self.loss = 0.0  # the share that is lost; 1 is a cut cable
        self.passed = self.lost = 0
        self._other = {near: far, far: near}
        self._under_way = []  # (when to hand on, number, where to, packet)
        self._over = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._over:
            wait = self._under_way[0][0] - time.monotonic() if self._under_way else 0.1
            for end in select.select([*self._other], [], [], min(max(wait, 0), 0.1))[0]:
                self._take(self._other[end], os.read(end, MOST))
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
