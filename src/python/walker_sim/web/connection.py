"""A server's topics and services, none of which can keep a page waiting for ever."""

from __future__ import annotations

import queue
import threading
import time
from typing import Any, Callable

import rospy
from diagnostic_msgs.msg import DiagnosticArray

from walker_sim.srv import GetSpec

PATIENCE = 5.0  # with one call [s of wall time]
LOOK_INTERVAL = 1.0  # between looks at the server [s of wall time]


class Services:
    """Calls of the services of a server, given by its node's resolved name."""

    def __init__(self, server: str) -> None:
        self.server = server
        self._call: threading.Thread | None = None

    def __call__(self, name: str, service: Any, **fields: Any) -> Any:
        """Returns the answer. RuntimeError if there is none within PATIENCE, ValueError with the
        server's reason if it refuses."""
        path = f"{self.server}/{name}"
        if self._call is not None and self._call.is_alive():  # of a server that hangs
            raise RuntimeError(f"{path}: {self.server} has not answered the call before")
        found: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def call() -> None:
            try:
                found.put(rospy.ServiceProxy(path, service)(**fields))
            except Exception as error:
                found.put(error)

        self._call = threading.Thread(target=call, daemon=True)
        self._call.start()
        try:
            answer = found.get(timeout=PATIENCE)
        except queue.Empty:
            raise RuntimeError(f"{path}: no answer within {PATIENCE:g} s") from None
        self._call.join()
        if isinstance(answer, Exception):
            raise RuntimeError(f"{path}: {answer}") from answer
        if not getattr(answer, "success", True):
            reason = answer.message if hasattr(answer, "message") else answer.status_message
            raise ValueError(f"{path}: {reason}")
        return answer


class Watch:
    """Asks the server for its specification every LOOK_INTERVAL, in a thread of its own, and reads
    its diagnostics.

    `spec` is the latest answer, None before the first. `wanted_factor` is the real-time factor,
    None if another node or the callers of ~step set the pace.
    """

    def __init__(self, server: str) -> None:
        self._services = Services(server)
        self.spec: Any = None
        self.is_paused = False
        self.wanted_factor: float | None = None
        self._error, self._answered_at = "", time.monotonic()
        self._lock = threading.Lock()
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._take, queue_size=10)
        threading.Thread(target=self._run, daemon=True).start()

    def trouble(self) -> str:
        """Returns why the server cannot be called; empty if it can."""
        if not self._error and time.monotonic() > self._answered_at + PATIENCE:
            return f"{self._services.server} does not answer"
        return self._error

    def look(self) -> None:
        """Gets the specification now: afterwards `spec` is no older than this call."""
        with self._lock:
            try:
                self.spec = self._services("get_spec", GetSpec).spec
                self._error, self._answered_at = "", time.monotonic()
            except RuntimeError as error:
                self._error = f"no server {self._services.server} ({error})"

    def _run(self) -> None:
        while not rospy.is_shutdown():
            self.look()
            time.sleep(LOOK_INTERVAL)

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


class Subscriptions:
    """Topics of a namespace, from which messages come only between `begin` and `end`. Each has its
    type, a function, and how many messages wait at most."""

    def __init__(
        self, space: str, topics: dict[str, tuple[Any, Callable[[Any], None], int]]
    ) -> None:
        self._space, self._topics = space, topics
        self._subscribers: list[rospy.Subscriber] = []

    def begin(self) -> None:
        for name, (kind, take, size) in self._topics.items():
            path = name if name.startswith("/") else f"{self._space}/{name}"
            self._subscribers.append(
                rospy.Subscriber(path, kind, take, queue_size=size, tcp_nodelay=True)
            )

    def end(self) -> None:
        while self._subscribers:
            self._subscribers.pop().unregister()
