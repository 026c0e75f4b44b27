#!/usr/bin/python3
"""Clients that vanish or send garbage, a lost or hanging master, and prompt shutdown."""

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

import rosgraph
import rostest
from bare_ros import BareSubscriber, OwnMaster, header_bytes, wait_for
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from server_harness import DT, Process, ServerTest, nanoseconds
from std_srvs.srv import Trigger
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
PROMPT = 15  # wall seconds; a clean exit takes less than 1

TIGHT_LOOP = """
import sys
sys.path.insert(0, sys.argv[1])
from bare_ros import BareClient
import socket
from walker_sim.srv import Step
step = BareClient(
    socket.create_connection(("localhost", int(sys.argv[2])), timeout=30), sys.argv[3], Step
)
step(action=[1.0, 1.0, -1.0, 1.0])
print("steps", flush=True)
while True:
    step(action=[1.0, 1.0, -1.0, 1.0])
"""


class RobustnessTest(ServerTest):
    def serve_lockstep(self, **parameters):
        server = self.serve(mode="lockstep", max_episode_steps=0, **parameters)
        self.reset = server.client("reset", Reset)
        self.step = server.client("step", Step)
        self.last = self.reset(has_seed=True, seed=1).transition
        return server

    def assert_serves(self, steps=5):
        """Steps with the first client; no other client has moved the walker."""
        for _ in range(steps):
            reply = self.step(action=STAND)
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual(reply.transition.step, self.last.step + 1)
            self.assertEqual(nanoseconds(reply.transition), nanoseconds(self.last) + DT)
            self.last = reply.transition

    def handshake(self, service_class=Step, name="step", **changes):
        fields = {
            "callerid": "/vandal",
            "service": f"/walker_sim/{name}",
            "md5sum": service_class._md5sum,
            "persistent": "1",
        }
        return header_bytes({**fields, **changes})

    def test_half_a_request_harms_nobody(self):
        server = self.serve_lockstep()
        action = struct.pack("<II4d", 36, 4, *STAND)
        cases = {
            "nothing": b"",
            "half a length": b"\x99\x00",
            "half a header": self.handshake()[:40],
            "a header, no request": self.handshake(),
            "half a request": self.handshake() + action[:20],
            "a length of 4 GB": self.handshake() + b"\xff\xff\xff\xff",
            "a header of 4 GB": b"\xff\xff\xff\xff",
            "a length of 900 MB": self.handshake() + struct.pack("<I", 900_000_000),
            "an array longer than its message": self.handshake()
            + struct.pack("<II4d", 36, 4_000_000, *STAND),
            "rubbish": bytes(range(256)) * 8,
            "HTTP": b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            "another MD5 sum": self.handshake(md5sum="0" * 32) + action,
            "another service": self.handshake(service="/walker_sim/nothing") + action,
        }
        lingering = []
        for case, data in cases.items():
            for way in ("close", "reset", "linger"):
                connection = server.service_address("step")
                try:
                    connection.sendall(data)
                    if way == "reset":  # close() sends an RST
                        linger = struct.pack("ii", 1, 0)
                        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
                except OSError:
                    pass  # the server may have closed it already
                if way == "linger":
                    lingering.append(connection)
                else:
                    connection.close()
                self.assert_serves(2)
            self.assertTrue(server.is_running(), f"{case}: {server.output()}")
            newcomer = server.client("step", Step)
            self.step, veteran = newcomer, self.step
            self.assert_serves(2)
            self.step = veteran
            newcomer.close()
        for connection in lingering:
            connection.close()
        self.assert_serves()
        self.assertEqual(server.stop(timeout=PROMPT), 0)

    def test_a_client_that_goes_before_the_reply_harms_nobody(self):
        server = self.serve_lockstep()
        for _ in range(50):
            client = server.client("step", Step)
            client.send(action=STAND)
            linger = struct.pack("ii", 1, 0)
            client.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
            client.close()

        def only_ours():  # requests of closed connections may still be queued
            one = self.step(action=STAND)
            time.sleep(0.2)
            self.last = self.step(action=STAND).transition
            return self.last.step == one.transition.step + 1

        wait_for(only_ours, "the steps of the others to be over")
        self.assert_serves()
        self.assertEqual(server.stop(timeout=PROMPT), 0)

    def test_clients_killed_in_tight_loops_harm_nobody(self):
        server = self.serve_lockstep()
        files = f"/proc/{server.pid}/fd"
        before = len(os.listdir(files))
        address = server.service_address("step")
        port = address.getpeername()[1]
        address.close()
        failures, rounds, stop = [], [0], threading.Event()

        def step_on():
            while not stop.is_set():
                reply = self.step(action=STAND)
                if not reply.success:
                    failures.append(reply.status_message)
                    return
                rounds[0] += 1

        other = threading.Thread(target=step_on)
        other.start()
        try:
            for _ in range(20):
                here = os.path.dirname(os.path.realpath(__file__))
                client = subprocess.Popen(
                    [sys.executable, "-c", TIGHT_LOOP, here, str(port), "/walker_sim/step"],
                    stdout=subprocess.PIPE,
                )
                self.assertEqual(client.stdout.readline(), b"steps\n")
                done = rounds[0]
                client.kill()
                client.wait()
                client.stdout.close()
                wait_for(lambda n=done: rounds[0] > n or failures, "the other client's steps")
        finally:
            stop.set()
            other.join()
        self.assertEqual(failures, [])
        self.last = self.step(action=STAND).transition
        self.assert_serves()
        wait_for(lambda: len(os.listdir(files)) <= before + 1, "the server to close their sockets")
        self.assertEqual(server.stop(timeout=PROMPT), 0)

    def test_a_subscriber_that_does_not_read_holds_nobody_up(self):
        server = self.serve_lockstep()
        uri = rosgraph.Master("/robustness_test").lookupNode(server.name)
        frozen = [BareSubscriber(uri, "/transition", Transition) for _ in range(3)]
        reading = BareSubscriber(uri, "/transition", Transition)
        for _ in range(3000):
            self.assert_serves(1)
            if self.last.step % 50 == 0:  # before the publisher's queue overflows
                while nanoseconds(reading.next()) < nanoseconds(self.last):
                    pass
        for subscriber in (*frozen, reading):
            subscriber.close()
        self.assert_serves()
        self.assertEqual(server.stop(timeout=PROMPT), 0)

    def test_it_ends_promptly(self):
        for parameters in (
            {"mode": "lockstep"},
            {"mode": "free"},
            {"mode": "free", "paused": True},
            {"mode": "free", "real_time_factor": 0.0},
            {"mode": "free", "real_time_factor": 0.001},
            {"mode": "free", "auto_reset": False, "max_episode_steps": 1},
        ):
            for end in (signal.SIGINT, signal.SIGTERM):
                server = self.serve(**parameters)
                status = server.stop(end, PROMPT)
                self.assertEqual(status, 0, f"{parameters}, {end}: {server.output()}")
                services = dict(rosgraph.Master("/robustness_test").getSystemState()[2])
                self.assertNotIn("/walker_sim/step", services, "its services remain")

    def test_it_ends_promptly_while_clients_step(self):
        for end in (signal.SIGINT, signal.SIGTERM):
            server = self.serve_lockstep()

            def step_to_the_end():
                try:
                    while True:
                        self.step(action=STAND)
                except OSError:
                    pass

            client = threading.Thread(target=step_to_the_end)
            client.start()
            time.sleep(0.2)
            self.assertEqual(server.stop(end, PROMPT), 0, server.output())
            client.join(PROMPT)
            self.assertFalse(client.is_alive(), "the client's call hangs")

    def test_in_lockstep_it_outlives_the_master(self):
        for end in (signal.SIGINT, signal.SIGTERM):
            master = OwnMaster()
            self.addCleanup(master.kill)
            server = self.serve(master_uri=master.uri, mode="lockstep", max_episode_steps=0)
            self.reset = server.client("reset", Reset)
            self.step = server.client("step", Step)
            address = server.service_address("step").getpeername()
            uri = rosgraph.Master("/robustness_test", master.uri).lookupNode(server.name)
            self.last = self.reset(has_seed=True, seed=1).transition
            self.assert_serves()
            master.kill()
            begin = time.monotonic()
            self.assert_serves(2000)  # 40 s of simulation time
            self.last = self.reset(has_seed=True, seed=2).transition
            self.assert_serves()
            self.assertLess(time.monotonic() - begin, PROMPT)
            socket.create_connection(address, timeout=PROMPT).close()
            subscriber = BareSubscriber(uri, "/transition", Transition)
            self.assert_serves(50)  # the server may register it some steps later
            while nanoseconds(subscriber.next()) < nanoseconds(self.last):
                pass
            subscriber.close()
            self.assertTrue(server.is_running(), server.output())
            self.assertEqual(server.stop(end, PROMPT), 0, server.output())

    def test_free_running_it_outlives_the_master(self):
        for factor, end in ((1.0, signal.SIGINT), (0.0, signal.SIGTERM)):
            master = OwnMaster()
            self.addCleanup(master.kill)
            server = self.serve(master_uri=master.uri, real_time_factor=factor)
            uri = rosgraph.Master("/robustness_test", master.uri).lookupNode(server.name)
            subscriber = BareSubscriber(uri, "/transition", Transition)
            subscriber.next()
            master.kill()
            begin = time.monotonic()
            first = nanoseconds(subscriber.next())
            while nanoseconds(subscriber.next()) < first + 150 * DT:
                self.assertLess(time.monotonic() - begin, 2 * PROMPT)
            subscriber.close()
            self.assertTrue(server.is_running(), server.output())
            self.assertEqual(server.stop(end, PROMPT), 0, server.output())

    def own_master(self):
        master = OwnMaster()
        self.addCleanup(master.kill)
        return master

    def subscribe(self, master, topic, message_class):
        uri = rosgraph.Master("/robustness_test", master.uri).lookupNode(self.server.name)
        subscriber = BareSubscriber(uri, topic, message_class)
        self.addCleanup(subscriber.close)
        return subscriber

    def wait_for_pace(self, diagnostics, level, words=""):
        """Reads /diagnostics until the pace has this level and message."""

        def is_told():
            told = [s for s in diagnostics.next().status if s.name.endswith(": pace")]
            return [s for s in told if s.level == level and words in s.message]

        wait_for(is_told, f"a pace of level {level} that says {words}")

    def test_in_lockstep_it_steps_on_while_the_master_hangs(self):
        master = self.own_master()
        last = 0
        for end in (signal.SIGINT, signal.SIGTERM):
            server = self.serve_lockstep(master_uri=master.uri)
            self.assertGreater(nanoseconds(self.last), last)
            diagnostics = self.subscribe(master, "/diagnostics", DiagnosticArray)
            self.wait_for_pace(diagnostics, DiagnosticStatus.OK)
            master.hang()
            self.assert_serves(3000)  # 60 s of simulation time, with no confirmed reservation
            self.wait_for_pace(diagnostics, DiagnosticStatus.WARN, "the ROS master does not answer")
            self.last = self.reset(has_seed=True, seed=2).transition
            self.assert_serves(3000)
            self.assertEqual(server.output().count("the ROS master does not answer"), 1)
            last = nanoseconds(self.last)
            self.assertEqual(server.stop(end, PROMPT), 0, server.output())
            master.go_on()

    def test_once_the_master_goes_on_time_is_reserved_again(self):
        master = self.own_master()
        server = self.serve_lockstep(master_uri=master.uri)
        diagnostics = self.subscribe(master, "/diagnostics", DiagnosticArray)
        master.hang()
        self.assert_serves(2000)
        self.wait_for_pace(diagnostics, DiagnosticStatus.WARN, "the ROS master does not answer")
        master.go_on()
        self.wait_for_pace(diagnostics, DiagnosticStatus.OK)
        self.assertEqual(server.output().count("the ROS master does not answer"), 1)
        self.assert_serves(2000)
        last = nanoseconds(self.last)
        server.kill()
        self.serve_lockstep(master_uri=master.uri)
        self.assertGreater(nanoseconds(self.last), last)

    def test_free_running_it_steps_on_while_the_master_hangs(self):
        master = self.own_master()
        server = self.serve(master_uri=master.uri, real_time_factor=100.0, paused=True)
        unpause = server.client("unpause", Trigger)
        transitions = self.subscribe(master, "/transition", Transition)
        master.hang()
        self.assertTrue(unpause().success)
        first = nanoseconds(transitions.next())
        wait_for(lambda: nanoseconds(transitions.next()) > first + 3000 * DT, "a minute to pass")
        self.assertEqual(server.stop(signal.SIGINT, PROMPT), 0, server.output())

    def test_it_ends_at_its_start_while_the_master_hangs(self):
        master = self.own_master()
        master.hang()
        for end in (signal.SIGINT, signal.SIGTERM):
            server = Process("server", "walker_sim", (), master.uri)
            self.addCleanup(server.end)
            wait_for(lambda s=server: catches(s.pid, signal.SIGTERM), "its handlers")
            self.assertEqual(server.stop(end, PROMPT), 0, server.output())


def catches(pid, number):
    with open(f"/proc/{pid}/status", encoding="ascii") as file:
        caught = next(line for line in file if line.startswith("SigCgt"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1)


if __name__ == "__main__":
    rostest.rosrun("walker_sim", "robustness_test", RobustnessTest, sys.argv)
