"""Listening addresses of the nodes: loopback only if ROS_HOSTNAME or ROS_IP is loopback."""

import contextlib
import os
import signal
import socket
import struct
from unittest import mock

from bare_ros import wait_for_service
from node_processes import Process
from processes import wait_for
from server_harness import ServerTest

LISTEN = "0A"  # the state in /proc/net/tcp
LAST = "/server_here/set_physics_properties"  # the last service that is registered


def ports(pid):
    """Returns (host, port) of each listening TCP socket of a process."""
    links = []
    for name in os.listdir(f"/proc/{pid}/fd"):
        with contextlib.suppress(FileNotFoundError):  # it has been closed
            links.append(os.readlink(f"/proc/{pid}/fd/{name}"))
    sockets = {link[len("socket:[") : -1] for link in links if link.startswith("socket:[")}
    found = []
    for table, family, words in (("tcp", socket.AF_INET, 1), ("tcp6", socket.AF_INET6, 4)):
        with open(f"/proc/{pid}/net/{table}", encoding="ascii") as file:
            for line in list(file)[1:]:
                fields = line.split()
                if fields[3] == LISTEN and fields[9] in sockets:
                    host, port = fields[1].split(":")
                    raw = struct.pack(
                        f"={words}I", *struct.unpack(f">{words}I", bytes.fromhex(host))
                    )
                    found.append((socket.inet_ntop(family, raw), int(port, 16)))
    return found


class ListeningTest(ServerTest):
    def hosts_of(self, node, count):
        what = f"{count} ports of {node.name}"
        wait_for(lambda: len(ports(node.pid)) >= count, what, process=node)
        return {host for host, _ in ports(node.pid)}

    def start_node(self, node_type, **environment):
        """Starts a node without the test's own ROS_HOSTNAME and ROS_IP."""
        names = {"ROS_HOSTNAME", "ROS_IP"}
        inherited = {key: value for key, value in os.environ.items() if key not in names}
        with mock.patch.dict(os.environ, {**inherited, **environment}, clear=True):
            node = Process(node_type, f"/{node_type}_here")
        self.addCleanup(node.end)
        return node

    def test_nodes_listen_on_loopback_only(self):
        server = self.start_node("server", ROS_HOSTNAME="localhost")
        wait_for_service(LAST)
        for node, count in [
            (server, 3),  # XML-RPC, topics, services
            (self.start_node("topic_agent", ROS_HOSTNAME="localhost"), 2),
            (self.start_node("service_agent", ROS_IP="127.0.0.1"), 2),
            (self.start_node("status_line", ROS_HOSTNAME="localhost"), 2),
        ]:
            with self.subTest(node.name):
                self.assertEqual(self.hosts_of(node, count), {"127.0.0.1"})
                self.assertEqual(node.stop(signal.SIGINT), 0, node.output())
        self.assertIn("this machine alone (ROS_HOSTNAME = localhost)", server.output())

    def test_server_listens_on_ipv6_loopback(self):
        nobody = "http://localhost:1"  # the test's master is IPv4 only; the ports open before
        server = self.start_node("server", ROS_HOSTNAME="::1", ROS_IPV6="on", ROS_MASTER_URI=nobody)
        self.assertEqual(self.hosts_of(server, 2), {"::1"})

    def test_server_logs_that_others_can_reach_it(self):
        other = {"ROS_IP": "192.0.2.1"}  # reserved for documentation by RFC 5737
        server = self.start_node("server", **other)
        wait_for_service(LAST)
        self.assertEqual(self.hosts_of(server, 3), {"0.0.0.0"})
        self.assertEqual(server.stop(signal.SIGINT), 0, server.output())
        self.assertIn(
            "every address of this machine, as 192.0.2.1 (ROS_IP = 192.0.2.1)", server.output()
        )
