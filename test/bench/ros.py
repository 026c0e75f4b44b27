"""Starts and stops a ROS master and nodes as processes, without a ROS library."""

import contextlib
import os
import random
import signal
import socket
import subprocess
import time
import xmlrpc.client

from measure import Failure

PATIENCE = 60  # timeout for starting and stopping; roslaunch waits 15 s for each node [s]
POLL = 0.005  # [s]


def start(command, log, cores=None, **options):
    """Starts a process that ends with this one, in a session of its own as from another terminal:
    Linux divides the processor among sessions. Appends its output to the file `log`."""
    pinned = [] if cores is None else ["taskset", "--cpu-list", ",".join(map(str, cores))]
    with open(log, "ab") as output:
        return subprocess.Popen(
            ["setpriv", "--pdeathsig", "INT", *pinned, *map(str, command)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            **options,
        )


def stop(process):
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def await_true(condition, what, process=None):
    """Raises Failure naming `what` on a timeout, or if the process ends."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if process is not None and process.poll() is not None:
            raise Failure(f"{what}: the process ended with status {process.returncode}")
        if time.monotonic() > end:
            raise Failure(f"{what}: not within {PATIENCE} s")
        time.sleep(POLL)


def free_port():
    """Returns a free port below 32768. From there on, Linux chooses those of nodes and clients, and
    one of these could take the port before the caller listens."""
    for port in random.SystemRandom().sample(range(23000, 32768), 1000):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("localhost", port))
            return port
    raise Failure("no port between 23000 and 32768 is free")


class Master:
    """A master on a free port. Sets ROS_MASTER_URI for processes started in its context."""

    def __init__(self, settings):
        self.folder, self.programs = settings.folder, settings.programs
        self._processes = contextlib.ExitStack()

    def __enter__(self):
        port = free_port()
        uri = f"http://localhost:{port}"
        os.environ.update(ROS_MASTER_URI=uri, ROS_HOSTNAME="localhost", ROS_HOME=str(self.folder))
        for name in ("ROS_IP", "ROS_LOG_DIR", "ROS_NAMESPACE"):
            os.environ.pop(name, None)
        self._master = xmlrpc.client.ServerProxy(uri)
        try:
            process = self.process(["roscore", "-p", port])
            await_true(lambda: self._call("getUri") is not None, "roscore", process)
        except BaseException:
            self._processes.close()
            raise
        return self

    def __exit__(self, *_):
        self._processes.close()

    def _call(self, method, *arguments, node=None):
        """Calls the master, or the node with this proxy. Returns None if the call fails."""
        try:
            code, _, value = getattr(node or self._master, method)("/bench", *arguments)
        except OSError:
            return None
        return value if code == 1 else None

    def process(self, command, cores=None, **options):
        process = start(command, self.folder / "nodes.log", cores, **options)
        self._processes.callback(stop, process)
        return process

    def has_service(self, name):
        return self._call("lookupService", name) is not None

    def await_service(self, name, process):
        await_true(lambda: self.has_service(name), f"service {name}", process)

    def has_subscriber(self, topic):
        """Whether a node subscribes to the topic and still runs."""
        _, subscribers, _ = self._call("getSystemState") or ((), (), ())
        uris = (self._call("lookupNode", node) for node in dict(subscribers).get(topic, ()))
        nodes = (xmlrpc.client.ServerProxy(uri) for uri in uris if uri)
        return any(self._call("getPid", node=node) for node in nodes)

    def server(self, program="server", namespace="/", cores=None, **parameters):
        """Starts a server and waits for its services. Returns its name and process."""
        private = [f"_{name}:={value}" for name, value in parameters.items()]
        command = [self.programs / program, f"__ns:={namespace}", *private]
        process = self.process(command, cores)
        name = f"{namespace.rstrip('/')}/walker_sim"
        self.await_service(f"{name}/get_spec", process)
        return name, process


def call_service(name):
    try:
        subprocess.run(
            ["rosservice", "call", name], check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE
        )
    except subprocess.SubprocessError as error:
        raise Failure(f"service {name}: {error}") from None


def diagnostics(count, period):
    """Returns the next messages on /diagnostics, each as one dict of all its values."""
    import yaml  # imported here, because only this function needs it

    command = ["rostopic", "echo", "-n", str(count), "/diagnostics"]
    try:
        done = subprocess.run(
            command, stdout=subprocess.PIPE, encoding="utf-8", timeout=count * period + PATIENCE
        )
    except subprocess.TimeoutExpired:
        raise Failure(f"fewer than {count} reports on /diagnostics") from None
    reports = [document for document in yaml.safe_load_all(done.stdout) if document]
    if len(reports) != count:
        raise Failure(f"{len(reports)} reports on /diagnostics; must be {count}")
    return [
        {pair["key"]: pair["value"] for status in report["status"] for pair in status["values"]}
        for report in reports
    ]
