#!/usr/bin/python3
"""scripts/run launches beside a walker that already runs, and never replaces it."""

import http.server
import os
import subprocess
import threading
import unittest
import xmlrpc.client

from node_processes import ServerProcess
from processes import CALLER, TIMEOUT, Launched, Master, free_port, wait_for

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def choose(*arguments, uri=None):
    """Returns the exit status, the words on stdout, and stderr."""
    environment = {key: value for key, value in os.environ.items() if key != "ROS_MASTER_URI"}
    if uri:
        environment["ROS_MASTER_URI"] = uri
    ended = subprocess.run(
        ["/usr/bin/python3", os.path.join(ROOT, "scripts", "choose_master.py"), *arguments],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=TIMEOUT,
        check=False,
    )
    return ended.returncode, ended.stdout.split(), ended.stderr


class NoMaster(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        self.send_error(404)

    def log_message(self, *_):
        pass


class ChooseMasterTest(unittest.TestCase):
    def test_one_is_started_where_none_answers(self):
        uri = f"http://localhost:{free_port()}"
        self.assertEqual(choose(uri=uri), (0, [uri], ""))

    def test_a_given_one_that_is_none_is_named(self):
        with http.server.HTTPServer(("localhost", 0), NoMaster) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            self.addCleanup(server.shutdown)
            uri = f"http://localhost:{server.server_port}"
            for given, words in (
                (uri, f"no ROS master answers at {uri}"),
                ("localhost:11311", "ROS_MASTER_URI = localhost:11311: must be http://HOST:PORT"),
                ("http://localhost:x", "must be http://HOST:PORT"),
                ("http://no.such.host.invalid:1", "the name no.such.host.invalid is not known"),
            ):
                status, printed, told = choose(uri=given)
                self.assertEqual((status, printed), (1, []), given)
                self.assertIn(words, told)
                self.assertEqual(told.count("\n"), 1, told)
            server.shutdown()


class ChooseNamespaceTest(unittest.TestCase):
    def setUp(self):
        self.master = Master()
        self.addCleanup(self.master.close)

    def choose(self, *arguments):
        status, printed, told = choose(*arguments, uri=self.master.uri)
        self.assertEqual(status, 0, told)
        self.assertEqual(printed[0], self.master.uri)
        self.assertIn(f"using the ROS master at {self.master.uri}\n", told)
        return "".join(printed[1:]), told

    def launch(self, *arguments):
        namespace, _ = self.choose(*arguments)
        given = ["ns:=" + namespace] if namespace else []
        launched = Launched(
            "walker.launch",
            *("agent:=random", "mode:=lockstep", "rviz:=false", "status:=true"),
            *given,
            *arguments,
            ROS_MASTER_URI=self.master.uri,
        )
        self.addCleanup(launched.stop)
        return launched

    def pids(self, namespace=""):
        """Returns the PIDs that a walker's nodes report; None if the master does not know one."""
        found = []
        for name in ("walker_sim", "agent", "status_line"):
            uri = self.master.node_uri(f"{namespace}/{name}")
            if uri is None:
                return None
            found.append(xmlrpc.client.ServerProxy(uri).getPid(CALLER)[2])
        return found

    def test_a_second_walker_starts_beside_the_first_and_both_go_on(self):
        first = self.launch()
        wait_for(self.pids, "the first walker")
        before = self.pids()
        namespace, told = self.choose("env:=Walker2d-v5", "rviz:=true")
        self.assertEqual(namespace, "walker_2")
        self.assertIn("/walker_sim runs there", told)
        self.assertIn("/walker_2/walker_sim (ns:=walker_2)", told)
        second = self.launch()
        wait_for(lambda: self.pids("/walker_2"), "the second walker")
        for launched in (first, second):  # each prints one line per second
            wait_for(
                lambda walker=launched: walker.output().count("BipedalWalker-v3  time") > 1,
                "both to walk",
            )
        self.assertEqual(self.pids(), before)
        self.assertTrue(first.is_running() and second.is_running())
        self.assertEqual(self.choose()[0], "walker_3")
        self.assert_taken_ones_are_refused()

    def assert_taken_ones_are_refused(self):
        for argument, node in (
            ("ns:=walker_2", "/walker_2/walker_sim"),
            ("ns:=/walker_2/", "/walker_2/walker_sim"),
            ("ns:=", "/walker_sim"),
        ):
            status, printed, told = choose(argument, uri=self.master.uri)
            self.assertEqual((status, printed), (1, []))
            self.assertIn(f"run: {argument}: {node} runs on the ROS master at", told)
        self.assertEqual(self.choose("ns:=second")[0], "")  # the user's choice, which is free

    def test_one_that_was_killed_is_in_nobody_s_way(self):
        server = ServerProcess("/walker_sim", {"mode": "lockstep"}, self.master.uri)
        self.addCleanup(server.kill)
        server.wait_until_it_serves()
        self.assertEqual(self.choose()[0], "walker_2")
        server.kill()
        namespace, told = self.choose()
        self.assertEqual(namespace, "")
        self.assertEqual(told.count("\n"), 1, told)

    def test_the_clock_of_another_is_left_alone(self):
        server = ServerProcess("/robot/walker_sim", {"mode": "lockstep"}, self.master.uri)
        self.addCleanup(server.kill)
        server.wait_until_it_serves()
        namespace, told = self.choose()
        self.assertEqual(namespace, "walker_2")
        self.assertIn("/robot/walker_sim runs there", told)
        self.assertEqual(self.choose("publish_clock:=false")[0], "")


if __name__ == "__main__":
    unittest.main()
