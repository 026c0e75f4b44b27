"""A ROS master for one part, and its nodes; all of them end with the part."""

import ctypes
import functools
import os
import pathlib
import socket
import subprocess
import sys
from urllib.parse import urlparse

from bare_ros import BareClient
from processes import STARTUP_TIMEOUT, Master, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
PR_SET_CHILD_SUBREAPER = 36


def adopt_orphans():
    """Makes orphaned descendants children of this process, so that none is overlooked."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def command_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return []


await_true = functools.partial(wait_for, timeout=STARTUP_TIMEOUT)


class Graph(Master):
    def run(self, *arguments, environment=(), **options):
        """Runs a command of `python -m walker_sim` to its end; returns it with its output."""
        return subprocess.run(
            [sys.executable, "-m", "walker_sim", *map(str, arguments)],
            env={**os.environ, **self.environment, **dict(environment)},
            capture_output=True,
            text=True,
            check=False,
            **options,
        )

    def address(self, service):
        parts = urlparse(self.service_uri(service))
        return parts.hostname, parts.port

    def client(self, service, service_class):
        """Returns a client with its own connection, without a ROS library."""
        connection = socket.create_connection(self.address(service), timeout=STARTUP_TIMEOUT)
        return BareClient(connection, service, service_class)
