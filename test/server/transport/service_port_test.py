"""The service port: valid and invalid TCPROS."""

import itertools
import resource
import socket
import struct
import threading
import time

import rospy
from bare_ros import BareClient, header_bytes, read_header, receive_reply
from node_processes import ServerProcess, memory
from processes import CALLER, TIMEOUT, wait_for
from server_harness import STAND, ServerTest
from walker_sim.msg import EnvironmentSpec, EpisodeRecord
from walker_sim.srv import GetSpec, Step

MEGABYTE = 1 << 20
RST_ON_CLOSE = struct.pack("ii", 1, 0)  # for SO_LINGER


def start_server(name="/walker_sim"):
    parameters = {"mode": "lockstep", "max_episode_steps": 0, "publish_clock": name != "/own"}
    return ServerProcess(name, parameters).wait_until_it_serves()


class ServicePortTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        cls.shared = start_server()

    @classmethod
    def tearDownClass(cls):
        status = cls.shared.stop()
        assert status == 0, cls.shared.output()

    def setUp(self):
        self.use(self.shared)

    def use(self, server):
        self.server = server
        self.begin_stepping()
        # Creates roscpp's threads and buffers before a test measures memory.
        self.assert_serves(20)

    def use_own(self):
        """Starts a server for this test alone."""
        server = start_server("/own")
        self.addCleanup(server.end)
        self.use(server)

    def fields(self, **changes):
        fields = {"callerid": CALLER, "service": "/walker_sim/step", "md5sum": Step._md5sum}
        return {**fields, **changes}

    def connected(self, data=b""):
        """Connects and sends these bytes."""
        connection = self.server.service_address("step")
        self.addCleanup(connection.close)
        connection.sendall(data)
        return connection

    def opened(self, **changes):
        """Connects and exchanges headers. Returns the connection and the server's header."""
        connection = self.connected(header_bytes(self.fields(**changes)))
        return connection, read_header(connection)

    def receive_answer(self, connection, service=Step):
        fine, data = receive_reply(connection)
        return service._response_class().deserialize(data) if fine else data.decode()

    def assert_closed(self, connection):
        self.assertEqual(connection.recv(1), b"")

    def test_header_describes_the_service(self):
        for md5sum in (Step._md5sum, "*"):
            self.assertEqual(
                self.opened(md5sum=md5sum, probe="1")[1],
                {
                    "callerid": "/walker_sim",
                    "md5sum": Step._md5sum,
                    "type": "walker_sim/Step",
                    "request_type": "walker_sim/StepRequest",
                    "response_type": "walker_sim/StepResponse",
                },
            )

    def test_invalid_header_is_refused_with_the_reason(self):
        cases = [
            (struct.pack("<II", 8, 99) + b"four", "longer than the header"),
            (
                struct.pack("<I", MEGABYTE),
                f"a header of {MEGABYTE} bytes; at most 65536 are accepted",
            ),
            (b"\xff" * 4, "a header of 4294967295 bytes; at most 65536 are accepted"),
            (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", "at most 65536 are accepted"),
        ]
        for changes, what in (
            ({"service": "/walker_sim/nothing"}, "/walker_sim/nothing"),
            ({"md5sum": "0" * 32}, f"{'0' * 32}.*{Step._md5sum}"),
        ):
            cases.append((header_bytes(self.fields(**changes)), what))
        for missing in ("service", "md5sum", "callerid"):
            fields = self.fields()
            del fields[missing]
            cases.append((header_bytes(fields), f"{missing} is missing"))
        for data, what in cases:
            connection = self.connected(data)
            self.assertRegex(read_header(connection)["error"], what)
            self.assert_closed(connection)
        self.assert_serves()

    def test_connection_without_a_header_times_out(self):
        served, _ = self.opened(persistent="1")
        idle = [self.connected(data) for data in (b"", header_bytes(self.fields())[:20])]
        for connection in idle:
            self.assert_closed(connection)  # within the socket's timeout
        served.sendall(self.step.request_bytes(action=STAND))  # after its header a client may idle
        self.last = self.receive_answer(served).transition
        self.assert_serves()

    def test_connection_is_persistent_only_on_request(self):
        request = self.step.request_bytes(action=STAND)
        once, _ = self.opened()
        once.sendall(request)
        self.last = self.receive_answer(once).transition
        self.assert_closed(once)
        for persistent in ("1", "true"):
            often, _ = self.opened(persistent=persistent)
            for _ in range(3):
                often.sendall(request)
                self.assertEqual(self.receive_answer(often).transition.step, self.last.step + 1)
                self.last.step += 1
            self.assert_serves()

    def test_requests_may_be_joined_or_split(self):
        request = self.step.request_bytes(action=STAND)
        connection, _ = self.opened(persistent="1")
        connection.sendall(request * 50)
        for _ in range(50):
            self.last.step += 1
            self.assertEqual(self.receive_answer(connection).transition.step, self.last.step)
        connection = self.connected()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in header_bytes(self.fields()) + request:
            connection.sendall(bytes([byte]))
            time.sleep(0.0005)  # so that each byte arrives alone
        read_header(connection)
        self.last = self.receive_answer(connection).transition
        self.assert_serves()

    def test_rest_of_an_oversized_request_is_discarded(self):
        before = memory(self.server.pid)
        for persistent in ("1", "0"):  # the server discards the rest
            connection, _ = self.opened(persistent=persistent)
            connection.sendall(struct.pack("<I", 100 * MEGABYTE) + bytes(100 * MEGABYTE))
            self.assertIn("at most 65536 are accepted", self.receive_answer(connection))
            if persistent == "0":
                self.assert_closed(connection)
                continue
            connection.sendall(self.step.request_bytes(action=STAND))
            self.last = self.receive_answer(connection).transition
        self.assertLess(memory(self.server.pid) - before, 10 * MEGABYTE)
        with self.assertRaisesRegex(rospy.ServiceException, "at most 65536 are accepted"):
            rospy.ServiceProxy("/walker_sim/step", Step)([0.0] * MEGABYTE)
        self.assert_serves()

    def test_limit_of_a_request_depends_on_its_type(self):
        self.assertIn("must have 4", self.step(action=[0.0] * 8191).status_message)
        with self.assertRaisesRegex(RuntimeError, "a request of 65540 bytes; at most 65536"):
            self.step(action=[0.0] * 8192)
        restore = self.client("restore")
        # Bytes of the longest episode's actions and checksums, and of the most pushes.
        limit = 1_000_000 * (5 * 8 + 32)
        reply = restore(record=EpisodeRecord(actions=[0.0] * 1_000_000 * 4))
        self.assertIn("id =  in the record", reply.status_message)
        restore.connection.sendall(struct.pack("<I", limit + 2 * MEGABYTE))
        with self.assertRaisesRegex(RuntimeError, "/walker_sim/restore: a request of"):
            restore.receive()
        # An empty string takes 4 bytes on the wire and eight times as many in memory.
        spec = EnvironmentSpec(parameter_names=[""] * 5000)
        with self.assertRaisesRegex(RuntimeError, "an array has 5000 elements; at most 4096"):
            self.client("restore")(record=EpisodeRecord(spec=spec))
        self.assert_serves()

    def test_many_queued_requests_take_linear_time(self):
        small = struct.pack("<I", 1024) + b"\xff" * 1024
        large = struct.pack("<I", 30 * MEGABYTE) + b"\xff" * (30 * MEGABYTE)
        restore = self.client("restore")

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

    def test_idle_server_uses_no_processor_time(self):
        self.assert_serves(100)
        begin = self.server.processor_time()
        time.sleep(1)
        self.assertLess(self.server.processor_time() - begin, 0.2)

    def test_answers_are_sent_after_a_half_close(self):
        connection, _ = self.opened(persistent="1")
        connection.sendall(self.step.request_bytes(action=STAND) * 50)
        connection.shutdown(socket.SHUT_WR)
        for _ in range(50):
            self.last.step += 1
            self.assertEqual(self.receive_answer(connection).transition.step, self.last.step)
        self.assert_closed(connection)
        render = self.client("render")  # its answer is pending for a while
        render.connection.sendall(render.request_bytes() * 3)
        render.connection.shutdown(socket.SHUT_WR)
        for _ in range(3):
            self.assertEqual(render.receive().image.width, 600)
        self.assert_closed(render.connection)
        self.assert_serves()

    def test_client_that_disconnects_harms_no_other(self):
        request = self.step.request_bytes(action=STAND)
        header = header_bytes(self.fields(persistent="1"))
        cases = [b"", b"\x99\x00", header[:40], header, header + request[:20]]
        cases += [header + struct.pack("<I", 60_000), header + struct.pack("<I", 1 << 31)]
        lingering = []
        for data in cases:
            for how in ("close", "reset", "linger"):
                connection = self.server.service_address("step")
                connection.sendall(data)
                if how == "reset":
                    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
                if how == "linger":
                    lingering.append(connection)
                else:
                    connection.close()
                self.assert_serves(2)
        for _ in range(300):
            lingering.append(self.server.service_address("step"))
        self.assert_serves()
        for connection in lingering:
            connection.close()
        self.assert_serves()

    def test_client_may_disconnect_before_the_answer(self):
        for _ in range(50):
            client = self.server.client("step")
            client.send(action=STAND)
            client.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
            client.close()

        def queue_is_empty():  # requests of closed connections may still be queued
            one = self.step(action=STAND)
            time.sleep(0.2)
            self.last = self.step(action=STAND).transition
            return self.last.step == one.transition.step + 1

        wait_for(queue_is_empty, "the queued steps")
        self.assert_serves()

    def test_concurrent_calls_form_one_sequence(self):
        steps = {}

        def call(client):
            steps[client] = [client(action=STAND).transition.step for _ in range(200)]
            client.close()

        clients = [self.server.client("step") for _ in range(8)]
        threads = [threading.Thread(target=call, args=(client,)) for client in clients]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for own in steps.values():
            self.assertEqual(own, sorted(own), "each client's calls keep their order")
        first = self.last.step + 1
        self.assertEqual(
            sorted(itertools.chain(*steps.values())), list(range(first, first + 8 * 200))
        )
        self.last = self.step(action=STAND).transition

    def test_memory_of_unfinished_requests_is_limited(self):
        before = memory(self.server.pid)
        piece = bytes(30 * MEGABYTE)
        clients = []
        for _ in range(20):  # 600 MB
            client = self.client("restore")
            client.connection.sendall(struct.pack("<I", len(piece) + 1) + piece)
            clients.append(client)
            self.assert_serves(1)
            self.assertLess(memory(self.server.pid) - before, 450 * MEGABYTE)
        with self.assertRaisesRegex(RuntimeError, "all clients together may hold 268435456"):
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

    def test_memory_of_unread_pictures_is_limited(self):
        before = memory(self.server.pid)
        clients = []
        for _ in range(40):  # 480 MB
            client = self.client("render")
            client.connection.sendall(
                client.request_bytes(
                    parameter_names=["width", "height"], parameter_values=["2000", "2000"]
                )
            )
            clients.append(client)
        patient = self.client("render")
        self.assertEqual(patient().image.width, 600)  # drawn after all others
        self.assert_serves()
        self.assertLess(memory(self.server.pid) - before, 450 * MEGABYTE)
        self.assertEqual(clients[-1].receive().image.width, 2000)
        with self.assertRaises(ConnectionError):
            clients[0].receive()
        self.assert_serves()

    def test_number_of_connections_is_limited(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (400, hard))
        try:
            self.use_own()
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        others = [self.client("step") for _ in range(200 - 2)]
        with self.assertRaisesRegex(ConnectionError, "the services have 200 clients"):
            self.server.client("step")
        self.assert_serves()
        others.pop().close()

        def accepted():
            try:
                self.server.client("step").close()
            except ConnectionError:
                return False
            return True

        wait_for(accepted, "a free place")
        self.assert_serves()

    def test_log_lines_about_clients_are_throttled(self):
        before = len(self.server.output())
        for _ in range(2000):
            connection, header = self.opened(service="/nothing" + "x" * 50_000)
            self.assertIn("[... 49808 bytes left out ...]", header["error"])
            connection.close()
            connection, _ = self.opened(persistent="1")
            connection.sendall(b"\xff" * 4)
            self.receive_answer(connection)
            connection.close()
        added = self.server.output()[before:]
        self.assertRegex(added, r"\(and \d+ more since the last such line\)")
        self.assertLess(len(added), 100_000)
        self.assert_serves()

    def test_control_characters_from_clients_are_escaped(self):
        evil = "/x\n[ERROR] all is lost\x1b[2J\x9b31m"
        time.sleep(1.1)  # so that the throttle passes the next refusal
        error = self.opened(callerid=evil, service=evil)[1]["error"]
        self.assertIn("/x\\n[ERROR] all is lost\\x1b[2J\\xc2\\x9b31m asks for", error)
        wait_for(lambda: "all is lost" in self.server.output(), "the log")
        self.assertNotIn("\n[ERROR] all is lost", self.server.output())
        self.assertNotIn("\x1b[2J", self.server.output())
        self.assert_serves()

    def test_client_that_never_reads_delays_no_other(self):
        before = memory(self.server.pid)
        silent = []
        for _ in range(3):
            connection = self.server.service_address("get_spec")
            self.addCleanup(connection.close)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            service = {"service": "/walker_sim/get_spec", "md5sum": GetSpec._md5sum}
            connection.sendall(header_bytes(self.fields(**service, persistent="1")))
            connection.setblocking(False)
            silent.append(connection)
        sent = 0
        quiet_since = time.monotonic()
        while time.monotonic() - quiet_since < 0.5:  # until every socket's buffer is full
            for connection in silent:
                try:
                    sent += connection.send(bytes(64 * 1024))  # 16,384 empty requests
                    quiet_since = time.monotonic()
                except BlockingIOError:
                    pass
            self.assert_serves(1)
            self.assertLess(sent, 200 * MEGABYTE, "it reads on and on")
        self.assertLess(memory(self.server.pid) - before, 50 * MEGABYTE)
        # A client that reads late still gets every answer.
        silent[0].setblocking(True)
        silent[0].settimeout(TIMEOUT)
        read_header(silent[0])
        for _ in range(40):  # slowly, through a window of 4 KB
            spec = self.receive_answer(silent[0], GetSpec).spec
            self.assertEqual(spec.id, "BipedalWalker-v3")
        self.assert_serves()

    def test_connected_clients_are_served_without_free_descriptors(self):
        self.use_own()
        address = self.server.service_address("step").getpeername()
        resource.prlimit(self.server.pid, resource.RLIMIT_NOFILE, (64, 64))
        others = [socket.create_connection(address, timeout=TIMEOUT) for _ in range(100)]
        wait_for(lambda: "No further client" in self.server.output(), "the descriptors to end")
        self.assert_serves(100)
        for connection in others:
            connection.close()

        def accepted():
            connection = socket.create_connection(address, timeout=TIMEOUT)
            client = BareClient(connection, "/own/step", Step)
            self.last = client(action=STAND).transition
            client.close()
            return True

        wait_for(accepted, "a new client")
        self.assert_serves()
