"""A ROS master for one part, and its nodes; all of them end with the part."""

import contextlib
import ctypes
import io
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import xmlrpc.client
from urllib.parse import urlparse

from bare_ros import CALLER, BareClient, wait_for
from launched import LoggedProcess
from ros import free_port
from walker_sim.srv import Step

ROOT = pathlib.Path(__file__).resolve().parents[2]
STARTUP_TIMEOUT = 90  # [s]; only a failing part waits this long
PR_SET_CHILD_SUBREAPER = 36


def adopt_orphans():
    """Makes orphaned descendants children of this process, so that none is overlooked."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def command_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return []


def await_true(condition, what, timeout=STARTUP_TIMEOUT):
    return wait_for(condition, what, timeout)


def step_request(action):
    buffer = io.BytesIO()
    Step._request_class(action=action).serialize(buffer)
    return struct.pack("<I", len(buffer.getvalue())) + buffer.getvalue()


class Node(LoggedProcess):
    name = ""

    def __init__(self, command, options, **environment):
        # Not SIGINT: background processes of a shell ignore it, and their children may, too.
        command = ["setpriv", "--pdeathsig", "TERM", *map(str, command)]
        super().__init__(command, options, **environment)


class Graph(contextlib.ExitStack):
    def __init__(self, programs, host="localhost"):
        super().__init__()
        folder = self.enter_context(tempfile.TemporaryDirectory(prefix="walker_sim_soak_"))
        self.programs = programs
        self.port = free_port()
        self.uri = f"http://{host}:{self.port}"
        self.environment = {
            "ROS_MASTER_URI": self.uri,
            "ROS_HOSTNAME": host,
            "ROS_HOME": folder,
            "PYTHONUNBUFFERED": "1",
            "ROSCONSOLE_FORMAT": "[${severity}] ${message}",
        }
        self.start_master()

    def start_master(self):
        code = "import rosmaster; rosmaster.rosmaster_main()"
        self.master = self.start([sys.executable, "-c", code, "--core", "-p", self.port])
        await_true(lambda: self.ask("getUri"), "a master")

    def start(self, command, environment=(), **options):
        node = Node(command, options, **{**self.environment, **dict(environment)})
        self.callback(node.end)
        return node

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

    def ask(self, method, *arguments):
        """Returns the value of the master's answer; None on an error."""
        try:
            with xmlrpc.client.ServerProxy(self.uri) as master:
                code, _, value = getattr(master, method)(CALLER, *arguments)
        except (OSError, xmlrpc.client.Error):
            return None
        return value if code == 1 else None

    def forget(self, node, topic):
        with xmlrpc.client.ServerProxy(self.uri) as master:
            master.unregisterSubscriber(node, topic, self.node_uri(node) or "")

    def service_uri(self, service):
        return self.ask("lookupService", service)

    def server(self, namespace="", **parameters):
        """Starts a server and waits until it serves; in lock-step unless the parameters differ."""
        private = {"mode": "lockstep", **parameters}
        words = [f"_{name}:={value}" for name, value in private.items()]
        name = f"{namespace}/walker_sim"
        self.ask("deleteParam", name)  # the master keeps the previous server's parameters
        last = f"{name}/set_physics_properties"  # the last service that it registers
        before = self.service_uri(last)
        node = self.start([self.programs / "server", f"__ns:={namespace or '/'}", *words])
        node.name = name

        def serves():
            if not node.is_running():
                raise RuntimeError(f"{name} ended at its start:\n{node.output()}")
            return self.service_uri(last) not in (None, before)

        await_true(serves, f"{name} to serve")
        return node

    def address(self, service):
        parts = urlparse(self.service_uri(service))
        return parts.hostname, parts.port

    def client(self, service, service_class, timeout=STARTUP_TIMEOUT):
        """Returns a client with its own connection, without a ROS library."""
        connection = socket.create_connection(self.address(service), timeout=timeout)
        return BareClient(connection, service, service_class)

    def node_uri(self, name):
        return self.ask("lookupNode", name)
