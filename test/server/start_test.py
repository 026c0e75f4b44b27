"""Parameters at the start: refusals with their messages, and accepted values."""

import os
import signal
import subprocess
import tempfile
from xmlrpc.client import Binary

import rospy
from node_processes import Process, node_path
from processes import wait_for
from server_harness import ServerTest, builtin_model, write_model

WALKER2D = {"env": "Walker2d-v5"}
# Refused parameters, and words of the message. config_template_test.cpp has all ranges,
# world_test.cpp all worlds, and parameters_test.cpp and private_parameters_test.cpp all kinds of
# invalid values.
REFUSED = [
    ({"env": "BipedalWalker-v9"}, ["env", "BipedalWalker-v9", "BipedalWalker-v3"]),
    ({"env": 3}, ["env", "3"]),
    ({"real_time_facto": 1.0}, ["real_time_facto", "real_time_factor"]),
    ({"nested": {"thing": 1}}, ["nested"]),
    ({"mode": "turbo"}, ["mode", "turbo", "free", "lockstep"]),
    ({"num_envs": 100001}, ["num_envs", "100001", "[1, 100000]"]),
    ({"num_envs": "many"}, ["num_envs", "many"]),
    ({"num_envs": 2, "mode": "free"}, ["num_envs", "2", "must be 1", "lockstep"]),
    ({"shown_environment": 1}, ["shown_environment = 1", "[0, 0]", "num_envs = 1"]),
    ({"shown_environment": 8, "num_envs": 8}, ["shown_environment = 8", "[0, 7]"]),
    ({"autoreset_mode": "never"}, ["autoreset_mode", "never", "next_step, same_step or disabled"]),
    ({"seed": "0x10"}, ["seed", "0x10", "18446744073709551615"]),
    ({"seed": [float("nan")]}, ["seed", ".nan", "18446744073709551615"]),
    ({"world": "moom"}, ["parameter world = moom", "neither a preset", "did you mean moon?"]),
    ({"world": "{gravity: -5"}, ["parameter world = {gravity: -5"]),
    ({"world": "/nowhere/world.yaml"}, ["/nowhere/world.yaml", "neither a preset", "YAML file"]),
    ({"world": "/dev/zero"}, ["world /dev/zero: must be a preset or a regular YAML file"]),
    ({"world": {"gravity": [-5, -9]}}, ["world parameter gravity = [-5.0, -9.0]", "low <= high"]),
    ({"world": 5}, ["world", "5", "text"]),
    ({**WALKER2D, "world": "high_stump_height"}, ["stump_height", "must be in [0.02, 1.0] m"]),
    ({"real_time_factor": "1.0e4"}, ["real_time_factor = 10000.0", "[0.0, 1000.0]"]),
    ({"realtime_priority": 100}, ["realtime_priority = 100", "[0, 99]"]),
    ({"num_envs": "1.5e0"}, ["num_envs = 1.5", "an integer in [1, 100000]"]),
    ({"camera_width": 0}, ["camera_width", "0", "[1, 4096]"]),
    ({"width": 600}, ["width", "unknown", "camera_width"]),
    ({"auto_reset": "maybe"}, ["auto_reset", "maybe"]),
    ({"wait_for_recorder": "a b"}, ["wait_for_recorder = a b", "name of a node"]),
    ({**WALKER2D, "hardcore": False}, ["hardcore", "unknown"]),
    ({**WALKER2D, "frame_skip": 0}, ["frame_skip", "0", "1"]),
    ({**WALKER2D, "healthy_z_range": [2.0, 0.8]}, ["healthy_z_range", "[2.0, 0.8]"]),
    ({**WALKER2D, "healthy_z_range": [1, [2]]}, ["healthy_z_range", "element 1", "a number"]),
    ({"seed": [str(2**53 + 1)]}, ["seed", str(2**53 + 1), "an integer below 2^53"]),
    ({"hardcore": Binary(b"yes")}, ["hardcore", "true or false, a number, a text or a list"]),
    ({"env": "Walker2d-v4", "xml_file": "model.xml"}, ["xml_file", "model.xml", "unknown"]),
]
TAKEN_NAMES = ["odom", "lidar", "base_link"]
LOCKSTEP = {"mode": "lockstep", "publish_clock": False}
MAX_SERVERS = 8


class StartTest(ServerTest):
    def test_invalid_parameters_end_the_server_with_their_names(self):
        for first in range(0, len(REFUSED), MAX_SERVERS):
            cases = REFUSED[first : first + MAX_SERVERS]
            servers = [
                self.start(f"/refused_{number}", **{**LOCKSTEP, **parameters})
                for number, (parameters, _) in enumerate(cases)
            ]
            for server, (parameters, words) in zip(servers, cases):
                self.assert_refused(server, parameters, words)

    def assert_refused(self, server, parameters, words):
        self.assertEqual(server.wait(), 1, f"{parameters}: {server.output()}")
        fatal = [line for line in server.output().splitlines() if "FATAL" in line]
        self.assertEqual(len(fatal), 1, f"{parameters}: {server.output()}")
        for word in words:
            self.assertIn(word, fatal[0], parameters)

    def test_a_priority_holds_for_the_thread_that_steps_alone_or_is_refused(self):
        is_permitted = subprocess.run(["chrt", "--fifo", "50", "true"], check=False).returncode == 0
        parameters = {**LOCKSTEP, "realtime_priority": 50}
        server = self.start("/prior", **parameters)
        if not is_permitted:
            self.assert_refused(server, parameters, ["realtime_priority = 50", "rtprio 50"])
            return

        def has_priority(thread):
            is_first_in_first_out = os.sched_getscheduler(thread) & os.SCHED_FIFO != 0
            return is_first_in_first_out and os.sched_getparam(thread).sched_priority == 50

        wait_for(lambda: has_priority(server.pid), "the priority")
        server.wait_until_it_serves()
        others = {int(name) for name in os.listdir(f"/proc/{server.pid}/task")} - {server.pid}
        self.assertGreater(len(others), 2)
        self.assertEqual([thread for thread in others if has_priority(thread)], [])

    def test_invalid_model_ends_the_server_with_the_reason(self):
        model, foot = builtin_model(), 'body name="foot"'
        for text, words in (
            ("<mujoco><worldbody>", ["xml_file", "XML parse error", "worldbody"]),
            *(
                (model.replace(foot, f'body name="{name}"'), [f"link {name}", "another frame"])
                for name in TAKEN_NAMES
            ),
        ):
            parameters = {**LOCKSTEP, **WALKER2D, "xml_file": write_model(self, text)}
            server = self.start("/refused", **parameters)
            self.assert_refused(server, parameters, words)

    def endless_model(self, path):
        """Writes a model whose compilation blocks on a FIFO.

        Returns a function that waits until a process compiles the model. It returns a predicate:
        whether that process still runs.
        """
        pipe = os.path.join(os.path.dirname(path), "pipe.xml")
        os.mkfifo(pipe)
        with open(path, "w", encoding="utf-8") as file:
            file.write("<mujoco><include file='pipe.xml'/></mujoco>")

        def open_it():
            try:
                return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)  # fails without a reader
            except OSError:
                return None

        def begun():
            writer = wait_for(open_it, "the compilation")
            self.addCleanup(os.close, writer)

            def goes_on():
                try:
                    return os.write(writer, b" ") > 0
                except BrokenPipeError:
                    return False

            return goes_on

        return begun

    def assert_ends(self, node, number, begun):
        goes_on = begun()
        self.assertEqual(node.stop(number), 0, node.output())
        wait_for(lambda: not goes_on(), "the end of the compilation")
        self.assertNotIn("FATAL", node.output())

    def test_signals_end_a_server_that_compiles_a_model(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            path = write_model(self, "")
            begun = self.endless_model(path)
            server = self.start("/endless", **LOCKSTEP, **WALKER2D, xml_file=path)
            self.assert_ends(server, number, begun)

    def test_signals_end_an_agent_that_compiles_a_model(self):
        parameters = {**LOCKSTEP, **WALKER2D, "xml_file": write_model(self, builtin_model())}
        self.start("/compiled", **parameters).wait_until_it_serves()
        begun = self.endless_model(parameters["xml_file"])
        agent = Process("service_agent", "/agent", ["_server:=/compiled"])
        self.addCleanup(agent.end)
        self.assert_ends(agent, signal.SIGINT, begun)

    def test_signals_end_describe_while_it_compiles_a_model(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            path = write_model(self, "")
            begun = self.endless_model(path)
            command = [node_path("describe"), "Walker2d-v5", f"xml_file={path}"]
            with subprocess.Popen(command) as describe:
                self.addCleanup(describe.kill)
                goes_on = begun()
                describe.send_signal(number)
            self.assertEqual(describe.returncode, -number)
            wait_for(lambda goes_on=goes_on: not goes_on(), "the end of the compilation")

    def test_robot_description_of_another_robot_is_a_warning(self):
        rospy.set_param("/robot_description", '<robot name="x"><link name="torso"/></robot>')
        self.addCleanup(rospy.delete_param, "/robot_description")
        for parameters, missing in ((WALKER2D, "thigh"), ({}, "hull")):
            server = self.start("/described", **LOCKSTEP, **parameters)
            wait_for(lambda server=server: "WARN" in server.output(), "the warning")
            self.assertEqual(server.stop(), 0)
            warnings = [line for line in server.output().splitlines() if "WARN" in line]
            self.assertEqual(len(warnings), 1, server.output())
            self.assertIn(f"/robot_description has no link {missing}", warnings[0])

    def specification(self, **parameters):
        server = self.start("/taken", **LOCKSTEP, **parameters)
        server.wait_until_it_serves()
        spec = server.client("get_spec")().spec
        self.assertEqual(server.stop(), 0)
        return spec

    def test_world_is_a_preset_a_file_a_text_or_a_mapping(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "my world.yaml")
            with open(path, "w", encoding="utf-8") as file:
                file.write("# a comment\ngravity: -1.62\n")
            for world in ("moon", path, "{gravity: -1.62}", {"gravity": -1.62}):
                spec = self.specification(world=world)
                found = [(p.name, p.low, p.high) for p in spec.world.parameters]
                self.assertEqual(found, [("gravity", -1.62, -1.62)], world)
        for world in ("", "gymnasium", "{}"):
            spec = self.specification(world=world)
            self.assertEqual((spec.world.preset, spec.world.parameters), ("gymnasium", []), world)

    def test_parameters_of_other_nodes_are_ignored(self):
        rospy.set_param("/taken_too/unknown", 1)
        self.specification()
