"""Child processes with captured output: nodes, roslaunch, a ROS master, a virtual screen.

Imports the standard library alone, for Pythons without ROS.
"""

import contextlib
import os
import random
import signal
import socket
import subprocess
import tempfile
import time
import xmlrpc.client

TIMEOUT = 30.0  # wall seconds; only a failing test waits that long
STARTUP_TIMEOUT = 90.0  # [s] for a master or a node to serve on a busy machine
EXIT_TIMEOUT = 15  # [s] for a node to exit after a signal
CALLER = "/server_test"


class Failure(AssertionError):
    """A process or a measurement has failed; the text is the reason."""


def wait_for(condition, what, timeout=TIMEOUT, process=None, interval=0.005):
    """Returns the first true value, looking every `interval` seconds. Raises Failure after the
    timeout, or if the process ends; its text has the process's output."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        has_ended = process is not None and not process.is_running()
        if has_ended or time.monotonic() > deadline:
            reason = "the end of its process" if has_ended else f"{timeout} s"
            output = "" if process is None else f"; its output:\n{process.output()}"
            raise Failure(f"still waiting for {what} after {reason}{output}")
        time.sleep(interval)


def free_port():
    """Returns a free port below 32768. From there on, Linux chooses those of nodes and clients, and
    one of these could take the port before the caller listens."""
    for port in random.SystemRandom().sample(range(23000, 32768), 1000):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("localhost", port))
            return port
    raise Failure("no port between 23000 and 32768 is free")


def stat_fields(pid):
    """Fields of /proc/PID/stat from the state on."""
    with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as stat:
        return stat.read().rpartition(")")[2].split()


def children_of(parent):
    """Returns the children's states by PID. An ended child is in state Z until it is waited for."""
    children = {}
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            fields = stat_fields(entry)
        except OSError:
            continue  # it has ended
        if int(fields[1]) == parent:
            children[int(entry)] = fields[0]
    return children


def processor_time(pid):
    """User plus system time [s]."""
    fields = stat_fields(pid)
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class LoggedProcess(subprocess.Popen):
    """A process that the kernel ends with the thread that has started it."""

    def __init__(self, command, options=None, **environment):
        """Starts the command.

        @param options: more arguments of Popen
        @param environment: added to the inherited one, which loses its ROS_NAMESPACE
        """
        inherited = {key: value for key, value in os.environ.items() if key != "ROS_NAMESPACE"}
        self._output = tempfile.NamedTemporaryFile(prefix="walker_sim_test_", suffix=".log")
        super().__init__(
            # Not SIGINT: background processes of a shell ignore it, and their children may, too.
            ["setpriv", "--pdeathsig", "TERM", *map(str, command)],
            env={**inherited, **environment},
            stdin=subprocess.DEVNULL,
            stdout=self._output.file,
            stderr=subprocess.STDOUT,
            **(options or {}),
        )

    def output(self):
        with open(self._output.name, encoding="utf-8", errors="replace") as text:
            return text.read()

    def is_running(self):
        return self.poll() is None

    def processor_time(self):
        return processor_time(self.pid)

    @contextlib.contextmanager
    def halted(self):
        """Halts the process with SIGSTOP until the context ends."""
        self.halt()
        try:
            yield
        finally:
            self.send_signal(signal.SIGCONT)

    def halt(self):
        self.send_signal(signal.SIGSTOP)
        wait_for(lambda: stat_fields(self.pid)[0] == "T", "a process to halt")

    def kill(self):
        super().kill()
        super().wait()

    def end(self, by=signal.SIGTERM, timeout=EXIT_TIMEOUT):
        """Signals the process, even a halted one, and returns its exit status.

        After the timeout, kills it and returns None.
        """
        self.send_signal(signal.SIGCONT)
        self.send_signal(by)
        try:
            return super().wait(timeout)
        except subprocess.TimeoutExpired:
            self.kill()
            return None

    def wait(self, timeout=TIMEOUT):
        """Returns the exit status. After the timeout, kills the process and raises Failure."""
        try:
            return super().wait(timeout)
        except subprocess.TimeoutExpired:
            self.kill()
            what = f"{self.args[3:]} did not end within {timeout} s"
            raise Failure(f"{what}; its output:\n{self.output()}") from None


class Launched(LoggedProcess):
    """roslaunch of a launch file of this package."""

    def __init__(self, name, *arguments, **environment):
        super().__init__(["roslaunch", "walker_sim", name, *arguments], **environment)

    def pids(self):
        return list(children_of(self.pid))

    def stop(self):
        self.send_signal(signal.SIGINT)
        return self.wait()


class Processes(contextlib.ExitStack):
    """Processes that `close` ends, the last first."""

    def __init__(self, by=signal.SIGTERM, **options):
        """@param by: signal that ends a process
        @param options: more arguments of Popen for each process
        """
        super().__init__()
        self.environment, self._by, self._options = {}, by, options

    def start(self, command, cores=None, environment=(), **options):
        """Starts a process, on these cores alone if they are given."""
        pinned = [] if cores is None else ["taskset", "--cpu-list", ",".join(map(str, cores))]
        environment = {**self.environment, **dict(environment)}
        process = LoggedProcess([*pinned, *command], {**self._options, **options}, **environment)
        self.callback(process.end, self._by, TIMEOUT)  # roslaunch waits 15 s for a node
        return process


class Master(Processes):
    """A ROS master on a free port, and processes that end with it."""

    def __init__(
        self,
        programs=None,
        host="localhost",
        exports=False,
        command=("rosmaster", "--core"),
        **options,
    ):
        """Starts the master.

        @param programs: the folder of the nodes
        @param exports: whether this process, too, gets the variables of ROS for this master
        @param command: starts a master on the port after -p
        """
        super().__init__(**options)
        self.programs = programs
        port = free_port()
        self.uri = f"http://{host}:{port}"
        self._proxy = xmlrpc.client.ServerProxy(self.uri)
        home = self.enter_context(tempfile.TemporaryDirectory(prefix="walker_sim_ros_"))
        self.environment = {"ROS_MASTER_URI": self.uri, "ROS_HOSTNAME": host, "ROS_HOME": home}
        if exports:
            for name in ("ROS_IP", "ROS_LOG_DIR", "ROS_NAMESPACE"):
                os.environ.pop(name, None)
            os.environ.update(self.environment)
        try:
            self.process = self.start([*command, "-p", port])
            self._await(lambda: self.ask("getUri"), "the ROS master", self.process)
        except BaseException:
            self.close()
            raise

    @staticmethod
    def _await(condition, what, process):
        wait_for(condition, what, STARTUP_TIMEOUT, process)

    def ask(self, method, *arguments):
        """Returns the value of the master's answer; None on an error."""
        try:
            code, _, value = getattr(self._proxy, method)(CALLER, *arguments)
        except (OSError, xmlrpc.client.Error):
            return None
        return value if code == 1 else None

    def node_uri(self, name):
        return self.ask("lookupNode", name)

    def service_uri(self, name):
        return self.ask("lookupService", name)

    def await_service(self, name, process):
        self._await(lambda: self.service_uri(name), f"service {name}", process)

    def server(self, namespace="", program="server", cores=None, **parameters):
        """Starts a server and waits until it serves; in lock-step unless the parameters differ."""
        name = f"{namespace}/walker_sim"
        self.ask("deleteParam", name)  # the master keeps the previous server's parameters
        private = {"mode": "lockstep", **parameters}
        words = [f"_{key}:={value}" for key, value in private.items()]
        last = f"{name}/set_physics_properties"  # the last service that it registers
        before = self.service_uri(last)  # a killed server's registration remains
        process = self.start([self.programs / program, f"__ns:={namespace or '/'}", *words], cores)
        process.name = name
        self._await(lambda: self.service_uri(last) not in (None, before), name, process)
        return process


def start_screen(start, size):
    """Starts an X server with a virtual screen. Returns the name of its display.

    @param start: function of a command and Popen's pass_fds
    """
    read, write = os.pipe()
    # -displayfd: the server chooses a free display and writes its number.
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{size}x24", "-nolisten", "tcp"]
    start(command, pass_fds=[write])
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    if not number:
        raise Failure("Xvfb has not started; its package is xvfb")
    return f":{number}"
