"""A launch file as a process that a test ends as Ctrl-C does."""

import contextlib
import os
import signal
import subprocess
import tempfile

from bare_ros import PATIENCE, wait_for


def stat_fields(pid):
    """What the system tells of a process, from its state on."""
    with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as stat:
        return stat.read().rpartition(")")[2].split()


def children_of(parent):
    """Process numbers, at present."""
    children = []
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            fields = stat_fields(entry)
        except OSError:
            continue  # gone meanwhile
        if int(fields[1]) == parent:
            children.append(int(entry))
    return children


class LoggedProcess:
    """A process whose output is kept."""

    def __init__(self, command, **environment):
        """The environment is added to this process's, but for its ROS_NAMESPACE."""
        inherited = {key: value for key, value in os.environ.items() if key != "ROS_NAMESPACE"}
        self._output = tempfile.NamedTemporaryFile(prefix="walker_sim_test_", suffix=".log")
        self._process = subprocess.Popen(
            command,
            env={**inherited, **environment},
            stdin=subprocess.DEVNULL,
            stdout=self._output.file,
            stderr=subprocess.STDOUT,
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
        """User and system time that it has taken [s]."""
        fields = stat_fields(self.pid)
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    @contextlib.contextmanager
    def halted(self):
        """It does nothing meanwhile, and has no say in it."""
        self._process.send_signal(signal.SIGSTOP)
        try:
            wait_for(lambda: stat_fields(self.pid)[0] == "T", "a process to halt")
            yield
        finally:
            self._process.send_signal(signal.SIGCONT)


class Launched(LoggedProcess):
    """roslaunch of a launch file of this package."""

    def __init__(self, name, *arguments, **environment):
        # A test that is killed cannot stop it: then the system does.
        super().__init__(
            ["setpriv", "--pdeathsig", "INT", "roslaunch", "walker_sim", name, *arguments],
            **environment,
        )

    def pids(self):
        """Of the nodes that it has started."""
        return children_of(self._process.pid)

    def stop(self):
        """The exit status; an exception when it does not end in time (then it is killed)."""
        if self.is_running():
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(PATIENCE)
        finally:
            self._process.kill()
