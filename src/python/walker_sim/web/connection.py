"""A server's services, none of which can keep the page's loop waiting for ever."""

from __future__ import annotations

import threading
import time
from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray

from walker_sim.srv import GetSpec

CALL_TIMEOUT = 5.0  # [s of wall time]
POLL_INTERVAL = 1.0  # from one question for the specification to the next [s of wall time]


class NoAnswer(RuntimeError):
    """A server has not answered within CALL_TIMEOUT."""


class Services:
    """Calls of the services of a server, given by its node's resolved name."""

    def __init__(self, server: str) -> None:
        self.server = server
        self._call: threading.Thread | None = None

    def __call__(self, name: str, service: Any, **fields: Any) -> Any:
        """Returns the answer. ValueError with the server's reason if it refuses, NoAnswer if it
        hangs, RuntimeError if there is none or the call fails."""
        path = f"{self.server}/{name}"
        if self._call is not None and self._call.is_alive():
            raise NoAnswer(f"{path}: {self.server} has not answered the call before")
        found: list[Any] = []

        def call() -> None:
            try:
                found.append(rospy.ServiceProxy(path, service)(**fields))
            except Exception as error:
                found.append(error)

        self._call = threading.Thread(target=call, daemon=True)
        self._call.start()
        self._call.join(CALL_TIMEOUT)
        if not found:
            raise NoAnswer(f"{path}: no answer within {CALL_TIMEOUT:g} s")
        (answer,) = found
        if isinstance(answer, Exception):
            raise RuntimeError(f"{path}: {answer}") from answer
        if not getattr(answer, "success", True):
            reason = answer.message if hasattr(answer, "message") else answer.status_message
            raise ValueError(f"{path}: {reason}")
        return answer


class ServerMonitor:
    """Asks the server for its specification every POLL_INTERVAL, in a thread of its own, and reads
    its diagnostics.

    `spec` is the latest answer, None before the first. `wanted_factor` is the real-time factor,
    None if another node or the callers of ~step set the pace. `error` is why the last question has
    failed, empty if it has not; a server that hangs has not failed.
    """

    def __init__(self, server: str) -> None:
        self._services = Services(server)
        self._lock = threading.Lock()
        self.error, self._answered_at = "", time.monotonic()
        self.spec: Any = None
        self.is_paused = False
        self.wanted_factor: float | None = None
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._take, queue_size=10)
        threading.Thread(target=self._run, daemon=True).start()

    def unavailable_reason(self) -> str:
        """Returns why the server cannot be called; empty if it can."""
        if not self.error and time.monotonic() > self._answered_at + CALL_TIMEOUT:
            return f"{self._services.server} does not answer"
        return self.error

    def refresh(self) -> None:
        """Gets the specification now: if the server answers, `spec` is no older than this call."""
        with self._lock:
            try:
                self.spec = self._services("get_spec", GetSpec).spec
                self.error, self._answered_at = "", time.monotonic()
            except NoAnswer:
                pass  # `unavailable_reason` says so, by the time of the last answer
            except RuntimeError as error:
                self.error = f"no server {self._services.server} ({error})"

    def _run(self) -> None:
        while not rospy.is_shutdown():
            self.refresh()
            time.sleep(POLL_INTERVAL)

    def _take(self, message: Any) -> None:
        if message._connection_header.get("callerid") != self._services.server:
            return
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name.endswith(": simulation"):
                self.is_paused = values.get("paused") == "True"
            elif status.name.endswith(": pace"):
                wanted = values.get("real_time_factor_wanted", "-")
                self.wanted_factor = None if wanted == "-" else float(wanted)
