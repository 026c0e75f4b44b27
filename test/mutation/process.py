"""Processes that end in time, with all that they have started."""

import contextlib
import ctypes
import os
import pathlib
import resource
import signal
import subprocess
import time

PR_SET_CHILD_SUBREAPER = 36
MEMORY = 16 << 30  # of an address space; what a break takes on top is not the machine's [bytes]
GENTLY = 10  # in which a test ends its nodes [s]


def adopt_orphans():
    """What a test leaves behind becomes a child of this process, so that it is found."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end_orphans():
    """Ends all children; to be called where none is wanted any more."""
    while True:
        children = [
            *map(int, pathlib.Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())
        ]
        if not children:
            return
        for child in children:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
            with contextlib.suppress(ChildProcessError):
                os.waitpid(child, 0)


def set_limits():
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


class Process:
    """A command in a session of its own, its output in a file."""

    def __init__(self, command, output, environment=None, folder=None):
        self.begin = time.monotonic()
        self.output = pathlib.Path(output)
        with self.output.open("wb") as file:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env=None if environment is None else {**os.environ, **environment},
                cwd=folder,
                start_new_session=True,
                preexec_fn=set_limits,
            )

    @property
    def seconds(self):
        return time.monotonic() - self.begin

    def status(self):
        """None while it runs."""
        return self._process.poll()

    def wait(self, seconds):
        """Its status; subprocess.TimeoutExpired if it has none by then."""
        return self._process.wait(seconds)

    def text(self):
        return self.output.read_text(encoding="utf-8", errors="replace")

    def end(self):
        """Gently, so that a test ends what it has started; then whatever is left of its group."""
        for number in (signal.SIGINT, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(GENTLY)
