#!/usr/bin/python3
"""The port behind the services: TCPROS as clients may speak it, and as nobody should."""

import resource
import socket
import struct
import subprocess
import sys
import time

import rosgraph
import rospy
import rosservice
import rostest
from bare_ros import (
    CALLER,
    PATIENCE,
    BareClient,
    header_bytes,
    read_header,
    receive_exactly,
    wait_for,
)
from server_harness import ServerTest, memory
from std_srvs.srv import Empty, Trigger
from walker_sim.srv import GetSpec, Reset, Step

STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
MEGABYTE = 1 << 20


class ServicePortTest(ServerTest):
    def setUp(self):
        self.serve(mode="lockstep", max_episode_steps=0)
        self.reset = self.server.client("reset", Reset)
        self.step = self.server.client("step", Step)
        self.last = self.reset(has_seed=True, seed=1).transition
        # Begun by now are the threads and buffers that roscpp begins with.
        self.assert_serves(20)

    def tearDown(self):
        self.reset.close()
        self.step.close()
        self.assertEqual(self.server.stop(), 0, self.server.output())

    def assert_serves(self, steps=3):
        for _ in range(steps):
            reply = self.step(action=STAND)
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual(reply.transition.step, self.last.step + 1)
            self.last = reply.transition

    def fields(self, **changes):
        fields = {"callerid": CALLER, "service": "/walker_sim/step", "md5sum": Step._md5sum}
        return {**fields, **changes}

    def opened(self, **changes):
        """A connection whose header is sent."""
        connection = self.server.service_address("step")
        self.addCleanup(connection.close)
        connection.sendall(header_bytes(self.fields(**changes)))
        return connection

    def receive_answer(self, connection, service=Step):
        fine, size = struct.unpack("<BI", receive_exactly(connection, 5))
        data = receive_exactly(connection, size)
        return service._response_class().deserialize(data) if fine else data.decode()

    def assert_closed(self, connection):
        self.assertEqual(connection.recv(1), b"")

    # ------------------------------------------------------------ the beginning

    def test_its_header_tells_the_service(self):
        for md5sum in (Step._md5sum, "*"):
            connection = self.opened(md5sum=md5sum, probe="1")
            self.assertEqual(
                read_header(connection),
                {
                    "callerid": "/walker_sim",
                    "md5sum": Step._md5sum,
                    "type": "walker_sim/Step",
                    "request_type": "walker_sim/StepRequest",
                    "response_type": "walker_sim/StepResponse",
                },
            )

    def test_its_header_says_what_is_wrong(self):
        cases = (
            ({"service": "/walker_sim/nothing"}, "/walker_sim/nothing"),
            ({"md5sum": "0" * 32}, f"{'0' * 32}.*{Step._md5sum}"),
        )
        for changes, what in cases:
            connection = self.opened(**changes)
            self.assertRegex(read_header(connection)["error"], what)
            self.assert_closed(connection)
        for missing in ("service", "md5sum", "callerid"):
            connection = self.server.service_address("step")
            fields = self.fields()
            del fields[missing]
            connection.sendall(header_bytes(fields))
            self.assertRegex(read_header(connection)["error"], f"{missing} is missing")
            self.assert_closed(connection)
            connection.close()
        connection = self.server.service_address("step")
        connection.sendall(struct.pack("<II", 8, 99) + b"four")
        self.assertRegex(read_header(connection)["error"], "longer than the header")
        self.assert_closed(connection)
        connection.close()
        self.assert_serves()

    def test_a_length_that_nobody_means_ends_the_connection(self):
        connection = self.server.service_address("step")
        connection.sendall(struct.pack("<I", MEGABYTE))  # of a header
        self.assert_closed(connection)
        connection.close()
        connection = self.opened(persistent="1")
        read_header(connection)
        connection.sendall(struct.pack("<I", 1_000_000_001))
        self.assert_closed(connection)
        self.assert_serves()

    # ------------------------------------------------------------ calls

    def test_a_connection_lasts_one_call_or_many(self):
        request = self.step.request_bytes(action=STAND)
        once = self.opened()
        read_header(once)
        once.sendall(request)
        self.last = self.receive_answer(once).transition
        self.assert_closed(once)
        for persistent in ("1", "true"):
            often = self.opened(persistent=persistent)
            read_header(often)
            for _ in range(3):
                often.sendall(request)
                self.assertEqual(self.receive_answer(often).transition.step, self.last.step + 1)
                self.last.step += 1
            self.assert_serves()

    def test_calls_in_one_piece_or_in_many(self):
        request = self.step.request_bytes(action=STAND)
        connection = self.opened(persistent="1")
        read_header(connection)
        connection.sendall(request * 50)
        for _ in range(50):
            self.last.step += 1
            self.assertEqual(self.receive_answer(connection).transition.step, self.last.step)
        connection = self.server.service_address("step")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in header_bytes(self.fields()) + request:
            connection.sendall(bytes([byte]))
            time.sleep(0.0005)  # so that each arrives by itself
        read_header(connection)
        self.last = self.receive_answer(connection).transition
        connection.close()
        self.assert_serves()

    def test_a_request_that_is_none_is_answered_with_the_reason(self):
        connection = self.opened(persistent="1")
        read_header(connection)
        before = memory(self.server.pid)
        for body, reason in (
            (b"", "ends within a field"),
            (struct.pack("<I", 4) + b"half", "ends within a field"),
            (struct.pack("<I", 0xFFFFFFFF), "ends within a field"),
            (struct.pack("<I", 0x20000001) + b"8 bytes.", "ends within a field"),
            (struct.pack("<I4dB", 4, *STAND, 0), "longer than its type"),
        ):
            connection.sendall(struct.pack("<I", len(body)) + body)
            self.assertRegex(self.receive_answer(connection), reason)
        self.assertLess(memory(self.server.pid) - before, 50 * MEGABYTE)
        connection.sendall(self.step.request_bytes(action=STAND))
        self.last = self.receive_answer(connection).transition
        self.assert_serves()

    def test_the_reason_reaches_clients_of_services_without_room_for_it(self):
        with self.assertRaisesRegex(rospy.ServiceException, "lockstep"):
            rospy.ServiceProxy("/walker_sim/unpause_physics", Empty)()

    # ------------------------------------------------------------ clients that harm

    def test_who_never_reads_holds_nobody_up(self):
        before = memory(self.server.pid)
        stuck = []
        for _ in range(3):
            connection = self.server.service_address("get_spec")
            self.addCleanup(connection.close)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.sendall(
                header_bytes(
                    {
                        "callerid": CALLER,
                        "service": "/walker_sim/get_spec",
                        "md5sum": GetSpec._md5sum,
                        "persistent": "1",
                    }
                )
            )
            connection.setblocking(False)
            stuck.append(connection)
        sent = 0
        quiet_since = time.monotonic()
        while time.monotonic() - quiet_since < 0.5:  # until no more goes in anywhere
            for connection in stuck:
                try:
                    sent += connection.send(bytes(4 * 1024))  # a thousand empty requests
                    quiet_since = time.monotonic()
                except BlockingIOError:
                    pass
            self.assert_serves(1)
            self.assertLess(sent, 200 * MEGABYTE, "it reads on and on")
        self.assertLess(memory(self.server.pid) - before, 50 * MEGABYTE)
        # One that reads after all gets every answer.
        stuck[0].setblocking(True)
        stuck[0].settimeout(PATIENCE)
        read_header(stuck[0])
        for _ in range(1000):
            spec = self.receive_answer(stuck[0], GetSpec).spec
            self.assertEqual(spec.id, "BipedalWalker-v3")
        self.assert_serves()

    def test_a_length_alone_takes_no_memory(self):
        before = memory(self.server.pid)
        for _ in range(20):
            connection = self.opened(persistent="1")
            read_header(connection)
            connection.sendall(struct.pack("<I", 900_000_000) + bytes(1000))
        self.assert_serves()
        self.assertLess(memory(self.server.pid) - before, 50 * MEGABYTE)

    def test_many_connections(self):
        for _ in range(1500):
            self.server.service_address("step").close()
        idle = [self.server.service_address("step") for _ in range(300)]
        self.assert_serves()
        for connection in idle:
            connection.close()
        self.assert_serves()

    def test_without_descriptors_left_it_serves_whom_it_has(self):
        address = self.server.service_address("step").getpeername()
        resource.prlimit(self.server.pid, resource.RLIMIT_NOFILE, (64, 64))
        crowd = [socket.create_connection(address, timeout=PATIENCE) for _ in range(100)]
        wait_for(lambda: "No further client" in self.server.output(), "the descriptors to end")
        self.assert_serves(100)
        for connection in crowd:
            connection.close()

        def accepted():
            connection = socket.create_connection(address, timeout=PATIENCE)
            newcomer = BareClient(connection, "/walker_sim/step", Step)
            self.last = newcomer(action=STAND).transition
            newcomer.close()
            return True

        wait_for(accepted, "a new client")
        self.assert_serves()

    # ------------------------------------------------------------ ROS's own clients

    def test_rosservice_and_rospy(self):
        names = rosservice.get_service_list(node="/walker_sim")
        self.assertLessEqual({"/walker_sim/step", "/walker_sim/pause"}, set(names))
        self.assertEqual(rosservice.get_service_node("/walker_sim/step"), "/walker_sim")
        self.assertEqual(rosservice.get_service_type("/walker_sim/step"), "walker_sim/Step")
        self.assertEqual(rosservice.get_service_args("/walker_sim/step"), "action")
        command = ["rosservice", "call", "/walker_sim/step", str(STAND)]
        told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        self.last.step += 1
        self.assertIn(f"step: {self.last.step}\n", told)
        for persistent in (True, False):
            rospy.wait_for_service("/walker_sim/step", timeout=PATIENCE)
            proxy = rospy.ServiceProxy("/walker_sim/step", Step, persistent=persistent)
            for _ in range(3):
                self.assertEqual(proxy(STAND).transition.step, self.last.step + 1)
                self.last.step += 1
            proxy.close()
        self.assertTrue(rospy.ServiceProxy("/walker_sim/pause", Trigger)().success)
        self.assert_serves()

    def test_a_client_with_another_definition_is_told_so(self):
        with self.assertRaisesRegex(rospy.ServiceException, Step._md5sum):
            rospy.ServiceProxy("/walker_sim/step", Reset)(True, 1)
        self.assert_serves()

    def test_nothing_stays_at_the_master(self):
        self.assertEqual(self.server.stop(), 0)
        services = [name for name, _ in rosgraph.Master(CALLER).getSystemState()[2]]
        self.assertEqual([name for name in services if name.startswith("/walker_sim/")], [])


if __name__ == "__main__":
    rospy.init_node("service_port_test")
    rostest.rosrun("walker_sim", "service_port_test", ServicePortTest, sys.argv)
