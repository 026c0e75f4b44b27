"""Clients by shared memory, beside one of TCP.

test/wire/channel_test.cpp has the unit tests of the memory.
"""

import contextlib
import itertools
import os
import resource

from bare_ros import BareClient, SharedConnection
from processes import wait_for
from server_harness import STAND, ServerTest
from walker_sim.srv import GetSpec, Step


class SharedMemoryTest(ServerTest):
    def setUp(self):
        self.serve(mode="lockstep", max_episode_steps=0)
        self.begin_stepping()
        self.assert_serves(20)  # opens all descriptors before a test counts them

    def tearDown(self):
        self.assertEqual(self.server.stop(), 0, self.server.output())

    def shared_connection(self):
        with self.server.service_address("step") as connection:
            return SharedConnection(connection.getpeername()[1])

    @contextlib.contextmanager
    def assert_sessions_end(self):
        """No session that begins in the context remains."""
        descriptors = f"/proc/{self.server.pid}/fd"
        before = len(os.listdir(descriptors))
        yield
        wait_for(lambda: len(os.listdir(descriptors)) <= before, "the end of the sessions")
        self.assert_serves()

    def shared_client(self, service, service_class):
        return BareClient(self.shared_connection(), f"{self.server.name}/{service}", service_class)

    def test_serves_a_client_by_shared_memory(self):
        client = self.shared_client("step", Step)
        self.addCleanup(client.close)
        for _ in range(20):
            self.last = client(action=STAND).transition
            self.assert_serves()

    def test_a_client_by_shared_memory_delays_nobody(self):
        with self.assert_sessions_end():
            client = self.shared_client("get_spec", GetSpec)
            # Its unread answers are longer than the ring.
            client.connection.sendall(100 * client.request_bytes())
            self.assert_serves(50)
            for _ in range(100):
                self.assertEqual(client.receive().spec.id, "BipedalWalker-v3")
            client.connection.sendall(100 * client.request_bytes())
            self.assert_serves()
            client.close()  # without reading them

    def test_wrong_counts_in_shared_memory_end_the_session(self):
        rings, offsets = (0, SharedConnection.ANSWERS), (0, SharedConnection.READ)
        with self.assert_sessions_end():
            for ring, offset in itertools.product(rings, offsets):
                client = self.shared_client("get_spec", GetSpec)
                connection = client.connection
                connection.sendall(client.request_bytes()[:2])
                connection.set_count(ring + offset, 2**31)
                connection.local.send(b"x")
                self.assert_serves()
                client.close()

    def test_ends_the_sessions_of_clients_without_a_header(self):
        with self.assert_sessions_end():
            for _ in range(50):
                self.shared_connection().close()

    def test_a_limit_of_file_sizes_leaves_tcp(self):
        resource.prlimit(self.server.pid, resource.RLIMIT_FSIZE, (65536, 65536))
        with self.assertRaises(ValueError):  # EOF instead of memory
            self.shared_connection()
        self.assert_serves()
