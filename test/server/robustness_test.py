"""A killed or hanging master, subscribers that never read, and shutdown by signals."""

import contextlib
import itertools
import signal
import socket
import threading
import time

import rosgraph
from bare_ros import BareSubscriber
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_processes import Process
from processes import Master, wait_for
from server_harness import DT, STAND, ServerTest, nanoseconds, statuses
from walker_sim.msg import Transition

MAX_EXIT = 15  # wall seconds; a clean exit takes less than 1


class StallingProxy:
    """Forwards connections to a master. After `stall`, open ones transfer nothing any more, as on a
    network that has lost them, while new ones work."""

    def __init__(self, master_uri):
        self._master = master_uri.rpartition("/")[2].split(":")
        self._listener = socket.create_server(("localhost", 0))
        self.uri = f"http://localhost:{self._listener.getsockname()[1]}"
        self._stalled = threading.Event()
        threading.Thread(target=self._accept, daemon=True).start()

    def stall(self):
        self._stalled.set()
        self._stalled = threading.Event()

    def close(self):
        self._listener.close()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                ends = self._listener.accept()[0], socket.create_connection(self._master)
                for source, target in (ends, reversed(ends)):
                    direction = (source, target, self._stalled)
                    threading.Thread(target=self._forward, args=direction, daemon=True).start()

    @staticmethod
    def _forward(source, target, stalled):
        with contextlib.suppress(OSError):
            while content := source.recv(65536):
                if stalled.is_set():
                    return
                target.sendall(content)
            target.shutdown(socket.SHUT_WR)


class RobustnessTest(ServerTest):
    def serve_lockstep(self, **parameters):
        server = self.serve(mode="lockstep", max_episode_steps=0, **parameters)
        self.begin_stepping()
        return server

    def assert_serves(self, steps=5):
        """Time advances by dt with each step."""
        for _ in range(steps):
            before = nanoseconds(self.last)
            super().assert_serves(1)
            self.assertEqual(nanoseconds(self.last), before + DT)

    def test_subscriber_that_never_reads_delays_no_step(self):
        server = self.serve_lockstep()
        frozen = [self.subscribe("/transition", Transition) for _ in range(3)]
        reading = self.subscribe("/transition", Transition)
        for _ in range(3000):
            self.assert_serves(1)
            if self.last.step % 50 == 0:  # before the publisher's queue overflows
                while nanoseconds(reading.next()) < nanoseconds(self.last):
                    pass
        for subscriber in (*frozen, reading):
            subscriber.close()
        self.assert_serves()
        self.assertEqual(server.stop(timeout=MAX_EXIT), 0)

    def test_signals_end_the_server_in_every_mode(self):
        modes = (
            {"mode": "lockstep"},
            {"mode": "free"},
            {"mode": "free", "paused": True},
            {"mode": "free", "real_time_factor": 0.0},
            {"mode": "free", "real_time_factor": 0.001},
            {"mode": "free", "auto_reset": False, "max_episode_steps": 1},
        )
        for end, chosen in ((signal.SIGINT, modes), (signal.SIGTERM, modes[:2])):
            servers = [
                self.serve(f"/server_{i}/walker_sim", publish_clock=False, **parameters)
                for i, parameters in enumerate(chosen)
            ]
            for server, parameters in zip(servers, chosen):
                status = server.stop(end, MAX_EXIT)
                self.assertEqual(status, 0, f"{parameters}, {end}: {server.output()}")
        for names in rosgraph.Master("/robustness_test").getSystemState():
            for name, nodes in names:
                self.assertFalse([n for n in nodes if n.startswith("/server_")], name)

    def test_signals_end_the_server_while_a_client_steps(self):
        calls = (("step", 1, {"action": STAND}), ("step_batch", 64, {"actions": STAND * 64}))
        ends = (signal.SIGINT, signal.SIGTERM)
        for (service, num_envs, fields), end in itertools.product(calls, ends):
            server = self.serve(mode="lockstep", max_episode_steps=0, num_envs=num_envs)
            self.assertTrue(self.call("reset_batch").success)
            step = server.client(service)
            replies, errors = [], []

            def step_to_the_end(step=step, fields=fields, replies=replies, errors=errors):
                try:
                    while True:
                        replies.append(step(**fields).success)
                except OSError as error:
                    errors.append(error)

            client = threading.Thread(target=step_to_the_end)
            client.start()
            wait_for(lambda r=replies: len(r) > 20, "steps")
            self.assertEqual(server.stop(end, MAX_EXIT), 0, server.output())
            client.join(MAX_EXIT)
            self.assertFalse(client.is_alive(), "the client's call hangs")
            self.assertEqual(len(errors), 1, "the client has no error")
            self.assertTrue(all(replies[:20]))

    def test_lockstep_continues_after_the_master_is_killed(self):
        master = self.own_master()
        server = self.serve_lockstep(master_uri=master.uri)
        address = server.service_address("step").getpeername()
        uri = server.uri()
        self.assert_serves()
        master.process.kill()
        begin = time.monotonic()
        self.assert_serves(2000)  # 40 s of simulation time
        self.last = self.reset(has_seed=True, seed=2).transition
        self.assert_serves()
        self.assertLess(time.monotonic() - begin, MAX_EXIT)
        socket.create_connection(address, timeout=MAX_EXIT).close()
        subscriber = BareSubscriber(uri, "/transition", Transition)
        self.assert_serves(50)  # the server may register it some steps later
        while nanoseconds(subscriber.next()) < nanoseconds(self.last):
            pass
        subscriber.close()
        self.assertEqual(server.stop(signal.SIGINT, MAX_EXIT), 0, server.output())

    def own_master(self):
        master = Master()
        self.addCleanup(master.close)
        return master

    def wait_for_pace(self, diagnostics, level, words=""):
        """Reads /diagnostics until the pace has this level and message."""

        def is_reported():
            paces = statuses(diagnostics.next(), "pace")
            return [s for s in paces if s.level == level and words in s.message]

        wait_for(is_reported, f"a pace of level {level} with {words!r}")

    def test_lockstep_continues_while_the_master_hangs(self):
        master = self.own_master()
        server = self.serve_lockstep(master_uri=master.uri)
        diagnostics = self.subscribe("/diagnostics", DiagnosticArray)
        self.wait_for_pace(diagnostics, DiagnosticStatus.OK)
        master.process.halt()
        self.assert_serves(3000)  # 60 s of simulation time, with no confirmed reservation
        self.wait_for_pace(diagnostics, DiagnosticStatus.WARN, "the ROS master does not answer")
        self.last = self.reset(has_seed=True, seed=2).transition
        self.assert_serves(1000)
        master.process.send_signal(signal.SIGCONT)  # time is reserved again
        self.wait_for_pace(diagnostics, DiagnosticStatus.OK)
        self.assertEqual(server.output().count("the ROS master does not answer"), 1)
        self.assert_serves(2000)
        last = nanoseconds(self.last)
        server.kill()
        server = self.serve_lockstep(master_uri=master.uri)
        self.assertGreater(nanoseconds(self.last), last)
        master.process.halt()
        self.assertEqual(server.stop(timeout=MAX_EXIT), 0, server.output())

    def test_free_running_continues_after_the_master_is_killed_or_hangs(self):
        # A server is stepping when its master is killed, and paused when it begins to hang.
        for is_hanging, end in ((False, signal.SIGTERM), (True, signal.SIGINT)):
            master = self.own_master()
            factor, steps = (100.0, 3000) if is_hanging else (10.0, 150)
            server = self.serve(master_uri=master.uri, real_time_factor=factor, paused=is_hanging)
            unpause = self.client("unpause")
            transitions = self.subscribe("/transition", Transition)
            if is_hanging:
                master.process.halt()
                self.assertTrue(unpause().success)
            else:
                master.process.kill()
            first = nanoseconds(transitions.next())
            while nanoseconds(transitions.next()) < first + steps * DT:
                pass
            self.assertEqual(server.stop(end, MAX_EXIT), 0, server.output())

    def test_a_signal_ends_the_server_whose_connections_to_the_master_stall(self):
        proxy = StallingProxy(self.own_master().uri)
        self.addCleanup(proxy.close)
        server = self.serve_lockstep(master_uri=proxy.uri)
        proxy.stall()
        self.assertEqual(server.stop(signal.SIGTERM, MAX_EXIT), 0, server.output())
        self.assertIn("A connection stalls", server.output())

    def test_signals_end_a_starting_server_while_the_master_hangs(self):
        master = self.own_master()
        master.process.halt()
        servers = [Process("server", f"/server_{i}", (), master.uri) for i in range(2)]
        for server, end in zip(servers, (signal.SIGINT, signal.SIGTERM)):
            self.addCleanup(server.end)
            self.assertEqual(server.stop(end, MAX_EXIT), 0, server.output())
