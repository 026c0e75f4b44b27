"""Starting nodes: arguments, closed standard descriptors, an unreachable master."""

import itertools
import os
import signal
import subprocess
import tempfile
import unittest

from bare_ros import wait_for_service
from catkin.find_in_workspaces import find_in_workspaces
from node_processes import Process, node_path, registered_uri, run_program
from processes import TIMEOUT, free_port, wait_for

NODES = ["server", "service_agent", "topic_agent", "status_line"]
PROGRAMS = ["describe", "replay"]
# Refused arguments, and words of the message; node_arguments_test.cpp has more.
REFUSED = {
    "__name:=walker-1": "argument __name:=walker-1: is not a valid name",
    "__name:=a/b": "a/b",
    "Walker2d-v5": "must be _PARAMETER:=VALUE or NAME:=NAME; see --help",
    "__master:=nowhere": "__master:=nowhere: must be the ROS master's address",
    "_no_such:=1": "parameter no_such = 1: unknown",
}
CLOSED = [*itertools.combinations(range(3), 1), *itertools.combinations(range(3), 2), (0, 1, 2)]


def start_closed(descriptors, command, **options):
    """Starts a process with these standard descriptors closed."""
    closing = " ".join(f"{number}{'<' if number == 0 else '>'}&-" for number in descriptors)
    return subprocess.Popen(
        ["bash", "-c", f'exec "$@" {closing}', "bash", *command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        **options,
    )


class CommandLineTest(unittest.TestCase):
    def assert_refused(self, node, argument, words, **environment):
        status, out, error = run_program(node, argument, **environment)
        case = f"{node} {argument}: {status} {out} {error}"
        self.assertEqual(status, 1, case)
        lines = error.splitlines()
        self.assertEqual(len(lines), 1, case)
        self.assertIn("FATAL", lines[0], case)
        self.assertIn(words, lines[0], case)

    def test_invalid_arguments_are_refused_by_every_node(self):
        for node in NODES:
            for argument, words in REFUSED.items():
                self.assert_refused(node, argument, words)

    def test_invalid_master_uri_is_refused(self):
        for node in NODES:
            for uri in ("", "localhost", "http://localhost:port", "http://localhost:70000"):
                words = f"ROS_MASTER_URI = {uri}: must be"
                self.assert_refused(node, "__name:=lost", words, ROS_MASTER_URI=uri)

    def test_help_of_every_node(self):
        for node in NODES:
            for option in ("--help", "-h"):
                status, out, error = run_program(node, option, ROS_MASTER_URI="")
                self.assertEqual((status, error), (0, ""))
                self.assertIn(f"Usage: rosrun walker_sim {node}", out)
        out = run_program("server", "_env:=Walker2d-v5", "--help")[1]
        for words in ("_env:=BipedalWalker-v3", "_mode:=free", " hardcore ", "docs/"):
            self.assertIn(words, out)

    def test_nodes_run_with_closed_standard_descriptors(self):
        for node in NODES:
            processes = {}
            for closed in CLOSED:
                name = f"/{node}_without_{''.join(map(str, closed))}"
                command = [node_path(node), f"__name:={name[1:]}"]
                if node == "server":
                    command += ["_env:=Walker2d-v5", "_mode:=lockstep", "_publish_clock:=false"]
                processes[name, closed] = process = start_closed(closed, command)
                self.addCleanup(process.wait)
                self.addCleanup(process.kill)
            for (name, closed), process in processes.items():
                wait_for(lambda n=name, p=process: registered_uri(n, p.pid), name)
                for number in closed:
                    target = os.readlink(f"/proc/{process.pid}/fd/{number}")
                    self.assertEqual(target, os.devnull, f"{name}: descriptor {number}")
                if node == "server":
                    wait_for_service(f"{name}/set_physics_properties")  # registered last
                process.terminate()
                self.assertEqual(process.wait(TIMEOUT), 0, name)

    def test_programs_run_with_closed_standard_descriptors(self):
        for program in PROGRAMS:
            for closed in CLOSED:
                process = start_closed(closed, [node_path(program), "--help"])
                self.assertEqual(process.wait(TIMEOUT), 0, f"{program} without {closed}")

    def test_rviz_for_a_prefix_has_standard_descriptors(self):
        # A stand-in for rviz, which view.py executes, checks the descriptors that it inherits.
        code = (
            "#!/usr/bin/python3\nimport os, sys\n"
            "sys.exit(any(os.readlink(f'/proc/self/fd/{n}') != os.devnull for n in range(3)))\n"
        )
        folder = self.enter(tempfile.TemporaryDirectory())
        rviz = os.path.join(folder, "rviz")
        with open(rviz, "w", encoding="utf-8") as file:
            file.write(code)
        os.chmod(rviz, 0o755)
        template = find_in_workspaces(["share"], "walker_sim", "config/walker2d.rviz")[0]
        environment = {**os.environ, "ROS_HOME": folder}
        environment["PATH"] = folder + os.pathsep + environment["PATH"]
        for closed in CLOSED:
            process = start_closed(
                closed, [node_path("view.py"), template, "robot"], env=environment
            )
            self.assertEqual(process.wait(TIMEOUT), 0, closed)

    def enter(self, context):
        value = context.__enter__()
        self.addCleanup(context.__exit__, None, None, None)
        return value

    def test_signals_end_a_node_without_a_master(self):
        # A parameter is set before the node registers: ROS waits for the master elsewhere.
        all_arguments = ([], ["_env:=Walker2d-v5"])
        for node, arguments in itertools.product(NODES, all_arguments):
            ends = {}
            for number in (signal.SIGINT, signal.SIGTERM):
                uri = f"http://localhost:{free_port()}"
                ends[number] = Process(node, f"/{node}_lost", arguments, uri)
                self.addCleanup(ends[number].end)
            for number, process in ends.items():
                words = "Failed to contact master"
                wait_for(lambda p=process, w=words: w in p.output(), words, process=process)
                self.assertEqual(process.stop(number, timeout=15), 0, process.output())
                self.assertNotIn("FATAL", process.output())
