#!/usr/bin/python3
"""The service port: valid and invalid TCPROS."""

import resource
import socket
import struct
import subprocess
import sys
import threading
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
from walker_sim.msg import EnvironmentSpec, EpisodeRecord
from walker_sim.srv import GetSpec, Render, Reset, Restore, Step

STAND = [1.0, 1.0, -1.0, 1.0]  # the walker stands astride for thousands of steps
MEGABYTE = 1 << 20


class ServicePortTest(ServerTest):
    def setUp(self):
        self.serve(mode="lockstep", max_episode_steps=0)
        self.reset = self.server.client("reset", Reset)
        self.step = self.server.client("step", Step)
        self.last = self.reset(has_seed=True, seed=1).transition
        # Creates roscpp's threads and buffers before a test measures memory.
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
        """Connects and sends a header."""
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

    # ------------------------------------------------------------ headers

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

    def test_a_header_that_nobody_means_ends_the_connection(self):
        for size in (MEGABYTE, 0xFFFFFFFF):
            connection = self.server.service_address("step")
            connection.sendall(struct.pack("<I", size))
            self.assertEqual(
                read_header(connection)["error"],
                f"connection header: a header of {size} bytes; at most 65536 are taken",
            )
            self.assert_closed(connection)
            connection.close()
        self.assert_serves()

    def test_who_sends_no_header_is_closed(self):
        served = self.opened(persistent="1")
        read_header(served)
        idle = [self.server.service_address("step") for _ in range(3)]
        idle[1].sendall(header_bytes(self.fields())[:20])
        for connection in idle:
            self.addCleanup(connection.close)
            self.assert_closed(connection)  # within the socket's timeout
        served.sendall(self.step.request_bytes(action=STAND))  # after its header a client may idle
        self.last = self.receive_answer(served).transition
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
            time.sleep(0.0005)  # so that each byte arrives alone
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

    def test_a_request_that_is_too_long_is_refused_at_its_length(self):
        for size in (65537, 100 * MEGABYTE, 1_000_000_001, 0xFFFFFFFF):
            connection = self.opened(persistent="1")
            read_header(connection)
            connection.sendall(struct.pack("<I", size))
            self.assertEqual(
                self.receive_answer(connection),
                f"service /walker_sim/step: a request of {size} bytes; at most 65536 are taken",
            )
        before = memory(self.server.pid)
        for persistent in ("1", "0"):  # the server discards the rest
            connection = self.opened(persistent=persistent)
            read_header(connection)
            connection.sendall(struct.pack("<I", 100 * MEGABYTE) + bytes(100 * MEGABYTE))
            self.assertIn("at most 65536 are taken", self.receive_answer(connection))
            if persistent == "0":
                self.assert_closed(connection)
                continue
            connection.sendall(self.step.request_bytes(action=STAND))
            self.last = self.receive_answer(connection).transition
        self.assertLess(memory(self.server.pid) - before, 10 * MEGABYTE)
        with self.assertRaisesRegex(rospy.ServiceException, "at most 65536 are taken"):
            rospy.ServiceProxy("/walker_sim/step", Step)([0.0] * MEGABYTE)
        self.assert_serves()

    def test_as_much_as_its_type_needs_is_taken(self):
        for action, words in (
            ([0.0] * 8191, "action has 8191 values; must have 4"),
            ([0.0] * 8192, "a request of 65540 bytes; at most 65536 are taken"),
        ):
            try:
                told = self.step(action=action).status_message
            except RuntimeError as error:
                told = str(error)
            self.assertIn(words, told)
        restore = self.server.client("restore", Restore)
        most = 1_000_000 * 5 * 8  # bytes of the longest episode's actions and checksums
        reply = restore(record=EpisodeRecord(actions=[0.0] * 1_000_000 * 4))
        self.assertIn("id =  in the record", reply.status_message)
        restore.connection.sendall(struct.pack("<I", most + 2 * MEGABYTE))
        with self.assertRaisesRegex(RuntimeError, "/walker_sim/restore: a request of"):
            restore.receive()
        restore.close()
        # An empty string takes 4 bytes on the wire and eight times as many in memory.
        spec = EnvironmentSpec(parameter_names=[""] * 5000)
        with self.assertRaisesRegex(RuntimeError, "an array has 5000 elements; at most 4096"):
            self.server.client("restore", Restore)(record=EpisodeRecord(spec=spec))
        self.assert_serves()

    def test_requests_in_a_row_are_not_moved_about(self):
        small = struct.pack("<I", 1024) + b"\xff" * 1024
        large = struct.pack("<I", 30 * MEGABYTE) + b"\xff" * (30 * MEGABYTE)
        restore = self.server.client("restore", Restore)
        self.addCleanup(restore.close)

        def receive(count):
            for _ in range(count):
                with self.assertRaisesRegex(RuntimeError, "ends within a field"):
                    restore.receive()

        begin = self.server.processor_time()
        for _ in range(20_000):
            restore.connection.sendall(small)
            receive(1)
        one_by_one = self.server.processor_time() - begin
        begin = self.server.processor_time()
        row = threading.Thread(target=restore.connection.sendall, args=(large + small * 20_000,))
        row.start()
        receive(20_001)
        row.join()
        # Moving the remaining 20 MB after each answer would take a hundred times as long.
        self.assertLess(self.server.processor_time() - begin, 5 * one_by_one + 0.2)
        self.assert_serves()

    def test_who_says_that_no_more_comes_gets_every_answer(self):
        connection = self.opened(persistent="1")
        connection.sendall(self.step.request_bytes(action=STAND) * 50)
        connection.shutdown(socket.SHUT_WR)
        read_header(connection)
        for _ in range(50):
            self.last.step += 1
            self.assertEqual(self.receive_answer(connection).transition.step, self.last.step)
        self.assert_closed(connection)
        render = self.server.client("render", Render)  # its answer is pending for a while
        render.connection.sendall(render.request_bytes() * 3)
        render.connection.shutdown(socket.SHUT_WR)
        for _ in range(3):
            self.assertEqual(render.receive().image.width, 600)
        self.assert_closed(render.connection)
        render.close()
        self.assert_serves()

    # ------------------------------------------------------------ harmful clients

    def test_unfinished_requests_hold_so_much_together_and_no_more(self):
        before = memory(self.server.pid)
        piece = bytes(30 * MEGABYTE)
        clients = []
        for _ in range(20):  # 600 MB
            client = self.server.client("restore", Restore)
            self.addCleanup(client.close)
            client.connection.sendall(struct.pack("<I", len(piece) + 1) + piece)
            clients.append(client)
            self.assert_serves(1)
            self.assertLess(memory(self.server.pid) - before, 450 * MEGABYTE)
        with self.assertRaisesRegex(RuntimeError, "all together may hold 268435456"):
            clients[0].receive()
        for client in (clients[0], clients[-1]):  # one whose request was dropped, one not
            client.connection.sendall(b"\0")
            if client is clients[-1]:
                with self.assertRaisesRegex(RuntimeError, "the request is longer than its type"):
                    client.receive()
            client.connection.sendall(struct.pack("<I", 0))
            with self.assertRaisesRegex(RuntimeError, "ends within a field"):
                client.receive()
        self.assert_serves()

    def test_unread_pictures_hold_so_much_together_and_no_more(self):
        before = memory(self.server.pid)
        clients = []
        for _ in range(40):  # 480 MB
            client = self.server.client("render", Render)
            self.addCleanup(client.close)
            client.connection.sendall(
                client.request_bytes(
                    parameter_names=["width", "height"], parameter_values=["2000", "2000"]
                )
            )
            clients.append(client)
        patient = self.server.client("render", Render)
        self.assertEqual(patient().image.width, 600)  # drawn after all others
        self.assert_serves()
        self.assertLess(memory(self.server.pid) - before, 450 * MEGABYTE)
        self.assertEqual(clients[-1].receive().image.width, 2000)
        with self.assertRaises(ConnectionError):
            clients[0].receive()
        patient.close()
        self.assert_serves()

    def test_there_is_a_limit_of_connections(self):
        self.assertEqual(self.server.stop(), 0, self.server.output())
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (400, hard))
        try:
            self.setUp()
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        crowd = [self.server.client("step", Step) for _ in range(200 - 2)]
        for client in crowd:
            self.addCleanup(client.close)
        with self.assertRaisesRegex(ConnectionError, "the services have 200 clients"):
            self.server.client("step", Step)
        self.assert_serves()
        crowd.pop().close()

        def accepted():
            try:
                self.server.client("step", Step).close()
            except ConnectionError:
                return False
            return True

        wait_for(accepted, "a place to be free")
        self.assert_serves()

    def test_what_clients_send_does_not_fill_the_log(self):
        before = len(self.server.output())
        for _ in range(2000):
            connection = self.opened(service="/nothing" + "x" * 50_000)
            self.assertIn("[... 49808 bytes left out ...]", read_header(connection)["error"])
            connection.close()
            connection = self.opened(persistent="1")
            read_header(connection)
            connection.sendall(b"\xff" * 4)
            self.receive_answer(connection)
            connection.close()
        told = self.server.output()[before:]
        self.assertRegex(told, r"\(and \d+ more since the last such line\)")
        self.assertLess(len(told), 100_000)
        self.assert_serves()

    def test_what_clients_send_writes_no_lines_of_its_own(self):
        evil = "/x\n[ERROR] all is lost\x1b[2J\x9b31m"
        time.sleep(1.1)  # so that the throttle passes the next refusal
        connection = self.opened(callerid=evil, service=evil)
        error = read_header(connection)["error"]
        self.assertIn("/x\\n[ERROR] all is lost\\x1b[2J\\xc2\\x9b31m asks for", error)
        wait_for(lambda: "all is lost" in self.server.output(), "the log")
        self.assertNotIn("\n[ERROR] all is lost", self.server.output())
        self.assertNotIn("\x1b[2J", self.server.output())
        client = self.server.client("render", Render)
        for fields in (
            {"encoding": "\n\x1b[2J" + "x" * 20_000},
            {"parameter_names": ["\n\x1b[2J" + "x" * 20_000], "parameter_values": ["1"]},
            {"parameter_names": ["width"], "parameter_values": ["\n\x1b[2J" + "x" * 20_000]},
        ):
            told = client(**fields).status_message
            self.assertIn("\\n\\x1b[2J", told)
            self.assertNotIn("\n", told)
            self.assertIn("bytes left out", told)
            self.assertLess(len(told), 1200)
        client.close()
        self.assert_serves()

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
        while time.monotonic() - quiet_since < 0.5:  # until every socket's buffer is full
            for connection in stuck:
                try:
                    sent += connection.send(bytes(4 * 1024))  # a thousand empty requests
                    quiet_since = time.monotonic()
                except BlockingIOError:
                    pass
            self.assert_serves(1)
            self.assertLess(sent, 200 * MEGABYTE, "it reads on and on")
        self.assertLess(memory(self.server.pid) - before, 50 * MEGABYTE)
        # A client that reads late still gets every answer.
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
