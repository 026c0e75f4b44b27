#!/usr/bin/python3
"""walker.launch starts what its arguments say. Parses it as roslaunch does; starts none."""

import itertools
import os
import sys
import unittest
from unittest import mock

import roslib.packages
import yaml
from roslaunch.arg_dump import get_args
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.xmlloader import XmlLoader

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
LAUNCH_FILE = os.path.join(ROOT, "launch", "walker.launch")
TEMPLATE = os.path.join(ROOT, "config", "server.yaml")
# What the package's interface names.
ARGUMENTS = [
    *("env", "mode", "agent", "num_envs", "seed", "real_time_factor", "xml_file", "config"),
    *("use_sim_time", "rviz", "paused", "ns", "gui", "headless", "debug", "verbose", "output"),
    *("required", "respawn", "recording"),
]
SEEDS_THAT_ARRIVE = "0 6 9 19 21 32"

sys.path.insert(0, os.path.join(ROOT, "src", "nodes"))
sys.dont_write_bytecode = True
import view  # noqa: E402


class Launch:
    """What roslaunch would start with these arguments."""

    def __init__(self, *arguments, display=None):
        environment = {} if display is None else {"DISPLAY": display}
        with mock.patch.dict(os.environ, environment):
            if display is None:
                os.environ.pop("DISPLAY", None)
            self.config = ROSLaunchConfig()
            XmlLoader().load(LAUNCH_FILE, self.config, argv=list(arguments), verbose=False)
        self.nodes = {node.namespace + node.name: node for node in self.config.nodes}
        self.parameters = {name: p.value for name, p in self.config.params.items()}

    def types(self):
        """The nodes' types by their full names."""
        return {name: node.type for name, node in self.nodes.items()}


class LaunchTest(unittest.TestCase):
    """One test per promise of the interface's section Launch."""

    def test_has_all_arguments_each_with_a_doc(self):
        arguments = get_args([LAUNCH_FILE])
        for name in ARGUMENTS:
            self.assertIn(name, arguments)
        for name, (doc, _default) in arguments.items():
            self.assertTrue(doc, name + " has no doc")

    def test_defaults_are_the_interface_s(self):
        parameters = Launch().parameters
        expected = {
            "env": "BipedalWalker-v3",
            "mode": "free",
            "num_envs": 1,
            "seed": "",
            "real_time_factor": 1.0,
            "paused": False,
            "publish_clock": True,
        }
        server = {
            name[len("/walker_sim/") :]: value
            for name, value in parameters.items()
            if name.startswith("/walker_sim/")
        }
        self.assertEqual(server, expected)
        self.assertIs(parameters["/use_sim_time"], True)
        self.assertIn('<robot name="bipedal_walker">', parameters["/robot_description"])

    def test_each_agent_drives_in_each_mode(self):
        for agent, mode in itertools.product(["none", "heuristic", "random"], ["free", "lockstep"]):
            with self.subTest(agent=agent, mode=mode):
                launch = Launch("agent:=" + agent, "mode:=" + mode)
                self.assertEqual(launch.parameters["/walker_sim/mode"], mode)
                types = launch.types()
                self.assertEqual(types["/walker_sim"], "server")
                if agent == "none":
                    self.assertNotIn("/agent", types)
                    continue
                driver = {"free": "topic_agent", "lockstep": "service_agent"}[mode]
                self.assertEqual(types["/agent"], driver)
                self.assertEqual(launch.parameters["/agent/agent"], agent)

    def test_every_node_of_ours_exists(self):
        types = set()
        for mode, prefix in itertools.product(["free", "lockstep"], ["", "second"]):
            launch = Launch(
                "agent:=random",
                "mode:=" + mode,
                "tf_prefix:=" + prefix,
                "status:=true",
                display=":9",
            )
            types |= {n.type for n in launch.config.nodes if n.package == "walker_sim"}
        self.assertEqual(
            types, {"server", "topic_agent", "service_agent", "status_line", "view.py"}
        )
        for node_type in types:
            self.assertTrue(roslib.packages.find_node("walker_sim", node_type), node_type)

    def test_heuristic_is_shown_where_it_arrives(self):
        launch = Launch("agent:=heuristic")
        self.assertEqual(launch.parameters["/agent/seeds"], SEEDS_THAT_ARRIVE)
        self.assertIs(
            launch.parameters["/walker_sim/auto_reset"], False, "two would begin each episode"
        )

    def test_others_have_the_server_s_seeds(self):
        for arguments in (
            ["agent:=random"],
            ["agent:=heuristic", "seed:=7"],
            ["agent:=heuristic", "env:=BipedalWalkerHardcore-v3"],
        ):
            with self.subTest(arguments=arguments):
                launch = Launch(*arguments)
                self.assertEqual(launch.parameters["/agent/seeds"], "")
                self.assertNotIn("/walker_sim/auto_reset", launch.parameters)

    def test_a_seed_of_64_bits_stays_a_text(self):
        launch = Launch("seed:=18446744073709551615")
        self.assertEqual(launch.parameters["/walker_sim/seed"], "18446744073709551615")

    def test_arguments_reach_the_server(self):
        launch = Launch(
            "env:=BipedalWalkerHardcore-v3",
            "num_envs:=2",
            "real_time_factor:=0",
            "paused:=true",
            "xml_file:=model.xml",
            "use_sim_time:=false",
            "agent:=random",
            "output:=log",
        )
        for name, value in {
            "/walker_sim/env": "BipedalWalkerHardcore-v3",
            "/walker_sim/num_envs": 2,
            "/walker_sim/real_time_factor": 0.0,
            "/walker_sim/paused": True,
            "/walker_sim/xml_file": "model.xml",
            "/use_sim_time": False,
            "/agent/real_time_factor": 0.0,
        }.items():
            self.assertEqual(launch.parameters[name], value, name)
        self.assertEqual(launch.nodes["/walker_sim"].output, "log")

    def test_parameters_of_an_earlier_start_are_cleared(self):
        self.assertIn("/walker_sim/", Launch().config.clear_params)

    def test_a_file_s_values_hold_where_an_argument_keeps_its_default(self):
        with open(TEMPLATE, encoding="utf-8") as file:
            template = yaml.safe_load(file)
        parameters = Launch("config:=" + TEMPLATE, "mode:=lockstep").parameters
        for name, value in template.items():
            expected = "lockstep" if name == "mode" else value
            self.assertEqual(parameters["/walker_sim/" + name], expected, name)

    def test_a_second_walker_needs_its_namespace_only(self):
        launch = Launch("ns:=second", "agent:=heuristic", "recording:=true", display=":9")
        for name in launch.nodes:
            self.assertTrue(name.startswith("/second/"), name)
        self.assertEqual(launch.parameters["/second/tf_prefix"], "second")
        self.assertIs(launch.parameters["/second/walker_sim/publish_clock"], False)
        self.assertIn("/second/robot_description", launch.parameters)
        self.assertEqual(launch.nodes["/second/rviz"].type, "view.py")
        self.assertEqual(set(launch.parameters) & set(Launch().parameters), {"/use_sim_time"})

    def test_rviz_where_there_is_a_display_else_lines(self):
        self.assertNotIn("/rviz", Launch().types())
        self.assertIn("/status_line", Launch().types())
        self.assertEqual(Launch(display=":9").types()["/rviz"], "rviz")
        self.assertNotIn("/status_line", Launch(display=":9").types())
        for argument in ("rviz:=false", "gui:=false", "headless:=true"):
            self.assertNotIn("/rviz", Launch(argument, display=":9").types(), argument)
        self.assertIn("/rviz", Launch("rviz:=true").types())

    def test_how_the_nodes_run(self):
        server = Launch().nodes["/walker_sim"]
        self.assertEqual(
            (server.required, server.respawn, server.launch_prefix), (True, False, None)
        )
        server = Launch("respawn:=true").nodes["/walker_sim"]
        self.assertEqual((server.required, server.respawn), (False, True))
        self.assertFalse(Launch("required:=false").nodes["/walker_sim"].required)
        self.assertTrue(Launch("debug:=true").nodes["/walker_sim"].launch_prefix.startswith("gdb "))
        variables = dict(Launch("verbose:=true").nodes["/walker_sim"].env_args)
        self.assertTrue(os.path.isfile(variables["ROSCONSOLE_CONFIG_FILE"]))
        with self.assertRaises(RLException):
            Launch("required:=true", "respawn:=true")

    def test_records_a_bag_on_request(self):
        for argument in ("recording:=", "recording:=false"):
            self.assertNotIn("/recorder", Launch(argument).types())
        self.assertIn("-o walker ", Launch("recording:=true").nodes["/recorder"].args)
        self.assertIn("-o trial ", Launch("recording:=trial").nodes["/recorder"].args)


class ViewTest(unittest.TestCase):
    """rviz's configuration under a prefix."""

    def test_puts_the_prefix_before_every_frame(self):
        with open(os.path.join(ROOT, "config", "bipedal_walker.rviz"), encoding="utf-8") as file:
            manager = view.put_prefix(yaml.safe_load(file), "second")["Visualization Manager"]
        self.assertEqual(manager["Global Options"]["Fixed Frame"], "second/odom")
        self.assertEqual(manager["Views"]["Current"]["Target Frame"], "second/hull")
        prefixes = [d["TF Prefix"] for d in manager["Displays"] if "TF Prefix" in d]
        self.assertEqual(prefixes, ["second"])

    def test_topics_are_relative(self):
        with open(os.path.join(ROOT, "config", "bipedal_walker.rviz"), encoding="utf-8") as file:
            displays = yaml.safe_load(file)["Visualization Manager"]["Displays"]
        topics = [d.get("Topic", d.get("Marker Topic")) for d in displays]
        self.assertEqual(
            [t for t in topics if t is not None], ["scene_markers", "state_markers", "scan"]
        )


if __name__ == "__main__":
    unittest.main()
