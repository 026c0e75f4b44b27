"""This package's nodes as processes, and the services of a server."""

import os
import resource
import signal
import socket
import subprocess
import xmlrpc.client
from urllib.parse import urlparse

import rosgraph
from bare_ros import BareClient
from catkin.find_in_workspaces import find_in_workspaces
from processes import CALLER, TIMEOUT, LoggedProcess, wait_for
from std_srvs.srv import Trigger
from walker_sim import srv

SERVICES = {
    "reset": srv.Reset,
    "step": srv.Step,
    "reset_batch": srv.ResetBatch,
    "step_batch": srv.StepBatch,
    "step_many": srv.StepMany,
    "get_spec": srv.GetSpec,
    "get_worlds": srv.GetWorlds,
    "render": srv.Render,
    "snapshot": srv.Snapshot,
    "restore": srv.Restore,
    "set_real_time_factor": srv.SetRealTimeFactor,
    "set_state": srv.SetState,
    "set_world": srv.SetWorld,
}


def node_path(node_type):
    """Path of the node's executable in the devel or install space."""
    found = find_in_workspaces(["libexec"], "walker_sim", node_type, first_match_only=True)
    if not found:
        raise RuntimeError(f"walker_sim has no executable {node_type}: build it, source the space")
    return found[0]


def run_program(node_type, *arguments, **environment):
    """Runs a program of this package. Returns exit status, stdout and stderr."""
    ended = subprocess.run(
        [node_path(node_type), *arguments],
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=TIMEOUT,
        check=False,
    )
    return ended.returncode, ended.stdout, ended.stderr


def pid_of(name):
    """Process id by the node's own getPid; None if it does not answer."""
    try:
        uri = rosgraph.Master(CALLER).lookupNode(name)
        return xmlrpc.client.ServerProxy(uri).getPid(CALLER)[2]
    except (OSError, rosgraph.MasterException):
        return None


def registered_uri(name, pid):
    """The node's XML-RPC URI, or "" until process `pid` has registered it."""
    return rosgraph.Master(CALLER).lookupNode(name) if pid_of(name) == pid else ""


def memory(pid):
    """Resident set size [bytes]."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def catches(pid, number):
    """Whether the process has a handler for the signal."""
    with open(f"/proc/{pid}/status", encoding="utf-8", errors="replace") as status:
        mask = next(line.split()[1] for line in status if line.startswith("SigCgt"))
    return bool(int(mask, 16) & 1 << number - 1)


class Process(LoggedProcess):
    """A node of this package as a process.

    Cleanups call `end` instead of `kill`, because gcov writes its counters at exit.
    """

    def __init__(self, node_type, name, arguments=(), master_uri=None):
        environment = {"PYTHONUNBUFFERED": "1", "ROSCONSOLE_FORMAT": "[${severity}] ${message}"}
        if master_uri:
            environment["ROS_MASTER_URI"] = master_uri
        self.name = name if name.startswith("/") else "/" + name
        namespace, _, base = self.name.rpartition("/")
        if namespace:
            environment["ROS_NAMESPACE"] = namespace
        super().__init__([node_path(node_type), f"__name:={base}", *arguments], **environment)

    def stop(self, by=signal.SIGINT, timeout=TIMEOUT):
        """Signals the node once it handles signals, and returns its exit status.

        Before, SIGINT may be lost: processes of a background job begin with it ignored.
        """
        wait_for(lambda: not self.is_running() or catches(self.pid, by), f"{self.name} to begin")
        self.send_signal(by)
        return self.wait(timeout)


class ServerProcess(Process):
    """A server with these private parameters and no others."""

    def __init__(self, name, parameters=None, master_uri=None, arguments=()):
        name = name if name.startswith("/") else "/" + name
        self.master = xmlrpc.client.ServerProxy(master_uri or os.environ["ROS_MASTER_URI"])
        self.master.deleteParam(CALLER, name)
        for key, value in (parameters or {}).items():
            code, message, _ = self.master.setParam(CALLER, f"{name}/{key}", value)
            assert code == 1, message
        super().__init__("server", name, arguments, master_uri)

    def wait_until_it_serves(self):
        def serves():
            try:
                self.service_address("set_physics_properties").close()  # registered last
            except OSError:
                return False
            return True

        wait_for(serves, f"{self.name} to serve", process=self)
        return self

    def uri(self):
        """Its XML-RPC URI, as registered at the master."""
        return self.master.lookupNode(CALLER, self.name)[2]

    def service_address(self, service):
        """Connects to the service's port, as registered at the master."""
        code, message, uri = self.master.lookupService(CALLER, f"{self.name}/{service}")
        if code != 1:
            raise ConnectionError(message)
        parts = urlparse(uri)
        return socket.create_connection((parts.hostname, parts.port), timeout=TIMEOUT)

    def client(self, service, service_class=None, **options):
        """@param service_class: None: that of SERVICES, or Trigger"""
        kind = service_class or SERVICES.get(service, Trigger)
        return BareClient(self.service_address(service), f"{self.name}/{service}", kind, **options)
