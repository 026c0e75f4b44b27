"""Invalid XML-RPC calls, and roscpp's own services: a node answers each and survives."""

import socket
import unittest
import xmlrpc.client
from urllib.parse import urlparse

import rosservice
from bare_ros import BareClient, BareSubscriber, header_bytes, wait_for_service
from node_processes import Process, registered_uri
from processes import CALLER, wait_for
from roscpp.srv import GetLoggers, SetLoggerLevel
from rosgraph_msgs.msg import Log

NODES = {
    "server": ["_mode:=lockstep"],
    "service_agent": ["_server:=nobody"],
    "topic_agent": ["_server:=nobody"],
    "status_line": [],
}
METHODS = [
    "getBusStats", "getBusInfo", "getMasterUri", "getPid", "getSubscriptions", "getPublications",
    "paramUpdate", "publisherUpdate", "requestTopic", "system.listMethods", "system.methodHelp",
    "no_such_method",
]  # fmt: skip
STRANGE = [
    "a b", "", "/", "~x", "//", "1", "\x7f", "x" * 100_000, 0, -1, 2**31 - 1, 0.5, True, [], {},
    [[]], [""], ["http://:0"], ["http://nowhere"], [1], {"a": [{}]}, xmlrpc.client.Binary(b"\x00"),
]  # fmt: skip
UDPROS_HEADER = header_bytes({"callerid": CALLER, "topic": "/rosout", "md5sum": "*", "type": "*"})


class SlaveApiTest(unittest.TestCase):
    def start(self, node):
        process = Process(node, f"/{node}_asked", NODES[node])
        self.addCleanup(process.end)
        self.name = process.name
        self.uri = wait_for(lambda: registered_uri(process.name, process.pid), process.name)
        wait_for_service(f"{process.name}/set_logger_level")  # registered last
        return process

    def assert_runs(self, process, what):
        code, _, pid = xmlrpc.client.ServerProxy(self.uri).getPid(CALLER)
        self.assertEqual((code, pid), (1, process.pid), f"{what}: {process.output()}")

    def ask(self, method, *arguments):
        """Returns the answer or the fault."""
        try:
            return getattr(xmlrpc.client.ServerProxy(self.uri), method)(*arguments)
        except xmlrpc.client.Fault as fault:
            return fault

    def post(self, body):
        """Posts arbitrary bytes. Returns the answer, which may be incomplete or empty."""
        parts = urlparse(self.uri)
        with socket.create_connection((parts.hostname, parts.port), timeout=30) as connection:
            head = f"POST / HTTP/1.1\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"
            connection.sendall(head.encode() + body)
            connection.shutdown(socket.SHUT_WR)  # EOF: nothing follows
            answer = b""
            while True:
                part = connection.recv(1 << 16)
                if not part:
                    return answer
                answer += part

    def test_invalid_name_is_answered_with_a_fault(self):
        for node in NODES:
            process = self.start(node)
            fault = self.ask("paramUpdate", CALLER, "a b", 1)
            self.assertIsInstance(fault, xmlrpc.client.Fault, node)
            self.assertIn("a b", fault.faultString)
            self.assertEqual(self.ask("paramUpdate", CALLER, "/a", 1)[0], 1)
            self.assert_runs(process, node)
            self.assertEqual(process.stop(), 0)

    def test_node_survives_arbitrary_arguments(self):
        for node in ("server", "status_line"):
            process = self.start(node)
            for method in METHODS:
                for strange in STRANGE:
                    for arguments in (
                        [],
                        [strange],
                        [CALLER, strange],
                        [CALLER, "/transition", strange],
                        [CALLER, strange, strange],
                        [CALLER, strange, [strange]],
                        [CALLER, strange, strange, strange],
                    ):
                        self.ask(method, *arguments)
                self.assert_runs(process, method)
            self.assertEqual(process.stop(), 0)

    def test_invalid_datagram_sizes_are_refused(self):
        process = self.start("server")
        for size in (-(2**31), -1, 0, 1, 8, 9, 63, 2**31 - 1):
            header = xmlrpc.client.Binary(UDPROS_HEADER[4:])
            protocol = ["UDPROS", header, "localhost", 9, size]
            self.ask("requestTopic", CALLER, "/rosout", [protocol])
            self.assert_runs(process, size)
        # Publishing now reaches every subscription that the node has accepted.
        logger = self.client("set_logger_level", SetLoggerLevel)
        subscriber = BareSubscriber(self.uri, "/rosout", Log)
        logger(logger="ros", level="debug")
        subscriber.next()
        self.assert_runs(process, "a message")
        self.assertEqual(process.stop(), 0)

    def test_node_survives_malformed_requests(self):
        process = self.start("server")
        deep = b"<value><array><data>"
        multicall = (
            b"<methodCall><methodName>system.multicall</methodName><params><param><value><array>"
            b"<data><value><struct><member><name>methodName</name><value>system.multicall</value>"
            b"</member><member><name>params</name><value><array><data></data></array></value>"
            b"</member></struct></value></data></array></value></param></params></methodCall>"
        )
        call = b"<methodCall><methodName>paramUpdate</methodName><params><param>"
        member = b"<value><struct><member><name></value></name>"
        for body in (
            multicall,
            call + deep * 200_000,
            call + member * 200_000,
            call + b"</param>",
            b"<methodCall>",
            b"\x00" * 1000,
            b"x",
        ):
            self.post(body)
            self.assert_runs(process, body[:100])
        self.assertIn(b"must not be within another", self.post(multicall))
        self.assertIn(b"must be at most", self.post(call + deep * 200_000))
        self.assertEqual(process.stop(), 0)

    def client(self, name, service_class):
        service = f"{self.name}/{name}"
        uri = urlparse(rosservice.get_service_uri(service))
        connection = socket.create_connection((uri.hostname, uri.port), timeout=30)
        client = BareClient(connection, service, service_class)
        self.addCleanup(client.close)
        return client

    def test_loggers_are_listed_and_set_repeatedly(self):
        for node in NODES:
            process = self.start(node)
            loggers = self.client("get_loggers", GetLoggers)
            level = self.client("set_logger_level", SetLoggerLevel)
            for wanted in ("debug", "info", "warn", "error", "fatal", "info"):
                level(logger="ros.walker_sim", level=wanted)
                for _ in range(5):
                    found = {one.name: one.level for one in loggers().loggers}
                    self.assertEqual(found["ros.walker_sim"], wanted)
                    self.assertEqual(found["ros"], "info")
                    self.assertEqual(found["ros.roscpp.superdebug"], "warn")
            self.assert_runs(process, "loggers")
            self.assertEqual(process.stop(), 0, process.output())

    def test_node_survives_arbitrary_logger_names(self):
        process = self.start("status_line")
        level = self.client("set_logger_level", SetLoggerLevel)
        strange = ("", ".", "..", "ros.", ".ros", "a b", "x" * 100_000, "\x00", "ros" + ".a" * 1000)
        for name in strange:
            level(logger=name, level="info")
        with self.assertRaises(RuntimeError):
            level(logger="ros", level="loud")
        self.assert_runs(process, "names")
        self.assertEqual(process.stop(), 0, process.output())
