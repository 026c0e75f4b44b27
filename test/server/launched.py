"""Child processes with captured output, roslaunch among them; a virtual screen."""

import contextlib
import os
import signal
import subprocess
import tempfile

from bare_ros import TIMEOUT, wait_for

EXIT_TIMEOUT = 15  # [s] for a node to exit after a signal


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


class LoggedProcess:
    def __init__(self, command, options=None, **environment):
        """Starts the command.

        @param options: more arguments of Popen
        @param environment: added to the inherited one, which loses its ROS_NAMESPACE
        """
        inherited = {key: value for key, value in os.environ.items() if key != "ROS_NAMESPACE"}
        self._output = tempfile.NamedTemporaryFile(prefix="walker_sim_test_", suffix=".log")
        self._process = subprocess.Popen(
            command,
            env={**inherited, **environment},
            stdin=subprocess.DEVNULL,
            stdout=self._output.file,
            stderr=subprocess.STDOUT,
            **(options or {}),
        )

    @property
    def pid(self):
        return self._process.pid

    def output(self):
        with open(self._output.name, encoding="utf-8", errors="replace") as text:
            return text.read()

    def is_running(self):
        return self._process.poll() is None

    def processor_time(self):
        return processor_time(self.pid)

    @contextlib.contextmanager
    def halted(self):
        """Halts the process with SIGSTOP until the context ends."""
        self._process.send_signal(signal.SIGSTOP)
        try:
            wait_for(lambda: stat_fields(self.pid)[0] == "T", "a process to halt")
            yield
        finally:
            self._process.send_signal(signal.SIGCONT)

    def kill(self):
        if self.is_running():
            self._process.kill()
        self._process.wait()

    def end(self, by=signal.SIGTERM, timeout=EXIT_TIMEOUT):
        """Signals the process, even a halted one, and returns its exit status.

        After the timeout, kills it and returns None.
        """
        if self.is_running():
            self._process.send_signal(signal.SIGCONT)
            self._process.send_signal(by)
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.kill()
            return None


class Launched(LoggedProcess):
    """roslaunch of a launch file of this package."""

    def __init__(self, name, *arguments, **environment):
        # If the test is killed, the kernel sends SIGINT to roslaunch.
        super().__init__(
            ["setpriv", "--pdeathsig", "INT", "roslaunch", "walker_sim", name, *arguments],
            **environment,
        )

    def pids(self):
        return list(children_of(self._process.pid))

    def stop(self):
        """Returns the exit status. After the timeout, kills it and raises AssertionError."""
        status = self.end(signal.SIGINT, TIMEOUT)
        assert status is not None, f"roslaunch did not end within {TIMEOUT} s:\n{self.output()}"
        return status


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
        raise AssertionError("Xvfb has not started; its package is xvfb")
    return f":{number}"
