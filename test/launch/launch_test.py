#!/usr/bin/python3
"""The launch files, parsed as roslaunch parses them: nodes and parameters for the arguments."""

import itertools
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest
from unittest import mock

import roslib.packages
import yaml
from roslaunch.arg_dump import get_args
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.substitution_args import resolve_args
from roslaunch.xmlloader import XmlLoader

ROOT = pathlib.Path(os.path.abspath(__file__)).parents[2]
LAUNCH_FILE = str(ROOT / "launch" / "walker.launch")
TEN_WALKERS = str(ROOT / "launch" / "ten_walkers.launch")
WALKERS = [f"/walker_{number}/" for number in range(1, 11)]
ARGUMENTS = [
    *("env", "mode", "agent", "policy", "num_envs", "seed", "real_time_factor", "xml_file"),
    "world",
    "config",
    *("use_sim_time", "rviz", "paused", "ns", "gui", "headless", "debug", "verbose", "output"),
    *("required", "respawn", "recording"),
]
AGENTS = ["none", "policy", "heuristic", "random"]
ROBOTS = {
    "BipedalWalker-v3": "bipedal_walker",
    "BipedalWalkerHardcore-v3": "bipedal_walker_hardcore",
    "Walker2d-v4": "walker2d",
    "Walker2d-v5": "walker2d",
    "Hopper-v4": "hopper",
    "Hopper-v5": "hopper",
}
ENGINE_S_MODEL = str(ROOT / "assets" / "walker2d_v5.xml")

# Arguments, and parameters that they set; None is unset. Paths are relative to roslaunch's working
# directory, /my runs, because nodes run elsewhere.
PARAMETERS = [
    ("agent:=policy", {"/agent/seeds": "", "/walker_sim/auto_reset": None, "/agent/policy": None}),
    ("agent:=random", {"/agent/seeds": "", "/walker_sim/auto_reset": None}),
    # With seeds the agent resets the server, which must not do so itself.
    ("agent:=policy; seeds:=3 4", {"/agent/seeds": "3 4", "/walker_sim/auto_reset": False}),
    ("agent:=policy; policy:=a.safetensors", {"/agent/policy": "/my runs/a.safetensors"}),
    ("agent:=policy; policy:=/tmp/a.safetensors", {"/agent/policy": "/tmp/a.safetensors"}),
    ("agent:=policy; policy:=~/a.safetensors", {"/agent/policy": "~/a.safetensors"}),
    ("seed:=18446744073709551615", {"/walker_sim/seed": "18446744073709551615"}),
    ("", {"/walker_sim/world": None}),
    ("world:=med_stairs", {"/walker_sim/world": "med_stairs"}),
    ("world:=ice.yaml", {"/walker_sim/world": "/my runs/ice.yaml"}),
    ("world:=worlds/ice; ns:=second", {"/second/walker_sim/world": "/my runs/worlds/ice"}),
    ("world:=/tmp/ice.yaml", {"/walker_sim/world": "/tmp/ice.yaml"}),
    ("world:=~/ice.yaml", {"/walker_sim/world": "~/ice.yaml"}),
    (
        "world:={gravity: -1.5, push_interval: [1, 3]}",
        {"/walker_sim/world": "{gravity: -1.5, push_interval: [1, 3]}"},
    ),
    ("env:=BipedalWalkerHardcore-v3", {"/walker_sim/env": "BipedalWalkerHardcore-v3"}),
    ("num_envs:=2; num_threads:=3", {"/walker_sim/num_envs": 2, "/walker_sim/num_threads": 3}),
    ("autoreset_mode:=same_step", {"/walker_sim/autoreset_mode": "same_step"}),
    ("shown_environment:=1", {"/walker_sim/shown_environment": 1}),
    (
        "real_time_factor:=0; agent:=random",
        {"/walker_sim/real_time_factor": 0.0, "/agent/real_time_factor": 0.0},
    ),
    ("paused:=true; use_sim_time:=false", {"/walker_sim/paused": True, "/use_sim_time": False}),
    ("env:=Walker2d-v5", {"/walker_sim/xml_file": None, "/walker_sim/wait_for_recorder": None}),
    ("env:=Walker2d-v5; xml_file:=walker2d_v4.xml", {"/walker_sim/xml_file": "walker2d_v4.xml"}),
    (f"env:=Walker2d-v5; xml_file:={ENGINE_S_MODEL}", {"/walker_sim/xml_file": ENGINE_S_MODEL}),
    ("env:=Walker2d-v5; tf_prefix:=/robot/", {"/walker_sim/tf_prefix": "robot"}),
    ("tf_prefix:=7", {"/walker_sim/tf_prefix": "7"}),
    ("tf_prefix:=/", {"/walker_sim/tf_prefix": None}),
    ("recording:=true", {"/walker_sim/wait_for_recorder": "recorder"}),
    ("recording:=true; ns:=second", {"/second/walker_sim/wait_for_recorder": "recorder"}),
]


class Launch:
    def __init__(self, *arguments, file=LAUNCH_FILE, display=None, **variables):
        environment = {} if display is None else {"DISPLAY": display}
        with mock.patch.dict(os.environ, {**environment, **variables}):
            if display is None:
                os.environ.pop("DISPLAY", None)
            self.config = ROSLaunchConfig()
            XmlLoader().load(file, self.config, argv=list(arguments), verbose=False)
        self.nodes = {node.namespace + node.name: node for node in self.config.nodes}
        self.parameters = {name: p.value for name, p in self.config.params.items()}

    def types(self):
        return {name: node.type for name, node in self.nodes.items()}


def words_of(node):
    return shlex.split(resolve_args(node.args, context={}, resolve_anon=True))


class LaunchTest(unittest.TestCase):
    """One test per statement of the interface's section Launch."""

    def test_all_arguments_have_a_doc(self):
        for_all = ("agent", "real_time_factor", "rviz", "status", "output", "respawn")
        for file, names in ((LAUNCH_FILE, ARGUMENTS), (TEN_WALKERS, for_all)):
            arguments = get_args([file])
            for name in names:
                self.assertIn(name, arguments)
            for name, (doc, _default) in arguments.items():
                self.assertTrue(doc, name + " has no doc")

    def test_defaults(self):
        """An argument that is not given leaves its parameter to the server."""
        parameters = Launch().parameters
        self.assertEqual([name for name in parameters if name.startswith("/walker_sim/")], [])
        self.assertIs(parameters["/use_sim_time"], True)
        self.assertIn('<robot name="bipedal_walker">', parameters["/robot_description"])

    def test_each_agent_drives_in_each_mode(self):
        for agent, mode in itertools.product(AGENTS, ["free", "lockstep"]):
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

    def test_all_nodes_exist(self):
        types = set()
        for mode, prefix in itertools.product(["free", "lockstep"], ["", "second"]):
            arguments = ("agent:=random", "mode:=" + mode, "tf_prefix:=" + prefix, "status:=true")
            launch = Launch(*arguments, "env:=Walker2d-v5", display=":9")
            types |= {n.type for n in launch.config.nodes if n.package == "walker_sim"}
        self.assertEqual(
            types, {"server", "topic_agent", "service_agent", "status_line", "view.py"}
        )
        for node_type in types:
            self.assertTrue(roslib.packages.find_node("walker_sim", node_type), node_type)

    def test_arguments_set_parameters(self):
        for arguments, expected in PARAMETERS:
            with self.subTest(arguments=arguments):
                launch = Launch(*arguments.split("; "), PWD="/my runs")
                for name, value in expected.items():
                    self.assertEqual(launch.parameters.get(name), value, name)
        launch = Launch("tf_prefix:=robot", "output:=log")
        self.assertEqual(launch.nodes["/walker_sim"].output, "log")
        prefixes = [name for name in launch.parameters if name.endswith("/tf_prefix")]
        self.assertEqual(prefixes, ["/walker_sim/tf_prefix"])
        self.assertIn("/walker_sim/", launch.config.clear_params)  # the next launch clears it

    def test_each_environment_has_its_robot_description_and_view(self):
        for env, robot in ROBOTS.items():
            with self.subTest(env=env):
                launch = Launch("env:=" + env, display=":9")
                self.assertEqual(launch.parameters["/walker_sim/env"], env)
                description = (ROOT / "urdf" / f"{robot}.urdf").read_text(encoding="utf-8")
                self.assertEqual(launch.parameters["/robot_description"], description)
                path = words_of(launch.nodes["/rviz"])[1]
                self.assertEqual(os.path.basename(path), robot + ".rviz")
                self.assertTrue(os.path.isfile(path), path)

    def test_server_is_the_only_publisher_of_transforms(self):
        for env in ROBOTS:
            nodes = set(Launch("env:=" + env, "agent:=heuristic", display=":9").nodes)
            self.assertEqual(nodes, {"/walker_sim", "/agent", "/rviz"}, env)

    def test_robot_description_is_that_of_xml_file(self):
        model = pathlib.Path(ENGINE_S_MODEL).read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder, "models", "my walker.xml")
            copy.parent.mkdir()
            copy.write_text(model.replace('density="1000"', 'density="2000"'), encoding="utf-8")
            launch = Launch("env:=Walker2d-v5", "xml_file:=models/my walker.xml", PWD=folder)
        path = launch.parameters["/walker_sim/xml_file"]
        self.assertEqual(path, folder + "/models/my walker.xml")
        masses = [
            [float(mass) for mass in re.findall('<mass value="([^"]*)"', text)]
            for text in (
                Launch("env:=Walker2d-v5").parameters["/robot_description"],
                launch.parameters["/robot_description"],
            )
        ]
        self.assertEqual(len(masses[0]), 7)
        for one, other in zip(*masses):
            self.assertAlmostEqual(other, 2 * one, places=12)

    def test_arguments_do_not_become_options_of_describe(self):
        with tempfile.TemporaryDirectory() as folder:
            made = os.path.join(folder, "made.urdf")
            for arguments in (
                ("env:=Walker2d-v5", f"xml_file:={ENGINE_S_MODEL}' --urdf '{made}"),
                ("env:=Walker2d-v5", f"xml_file:={ENGINE_S_MODEL}'\"' --urdf '\"'{made}"),
                (f"env:=Walker2d-v5' --urdf '{made}", "xml_file:=" + ENGINE_S_MODEL),
                ("env:=--help", "xml_file:=" + ENGINE_S_MODEL),
                ("env:=--engine", "xml_file:=" + ENGINE_S_MODEL),
            ):
                with self.subTest(arguments=arguments), self.assertRaises(RLException):
                    Launch(*arguments)
                self.assertFalse(os.path.exists(made))
            path = os.path.join(folder, """it's "my" $(env HOME) walker.xml""")
            shutil.copy(ENGINE_S_MODEL, path)
            launch = Launch("env:=Walker2d-v5", "xml_file:=" + path)
            self.assertIn("<robot name=", launch.parameters["/robot_description"])

    def test_arguments_stay_one_word(self):
        for text in (
            *("it's", 'x" -a "y', "x' -a 'y", "two  blanks", "a\\", "$(env EVIL)", "x;y", "'", '"'),
            *("-a", "$", "\\'"),
        ):
            with self.subTest(text=text), mock.patch.dict(os.environ, {"EVIL": "' -a '"}):
                launch = Launch("recording:=" + text, PWD="/my 'bags'")
                words = words_of(launch.nodes["/recorder"])
                self.assertEqual(words[:3], ["-o", "/my 'bags'/" + text, "joint_states"])
                launch = Launch("tf_prefix:=" + text, "rviz:=true", display=":9")
                words = words_of(launch.nodes["/rviz"])
                self.assertEqual(words[1:], [text])

    def test_invalid_model_stops_the_launch_with_the_engine_s_message(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "torn.xml")
            pathlib.Path(path).write_text("<mujoco><worldbody>", encoding="utf-8")
            ended = subprocess.run(
                ["roslaunch", LAUNCH_FILE, "env:=Walker2d-v5", "xml_file:=" + path],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                encoding="utf-8",
                env=dict(os.environ, ROS_HOME=folder),
                timeout=60,
                check=False,
            )
        self.assertNotEqual(ended.returncode, 0)
        self.assertIn("xml_file = " + path, ended.stderr)
        self.assertIn("XML parse error", ended.stderr)

    def test_arguments_that_are_given_win_over_a_config_file(self):
        given = {"mode": "free", "num_envs": 1, "real_time_factor": 1.0, "paused": False}
        words = [f"{name}:={value}" for name, value in given.items()]
        for name in ("server", "walker2d"):
            path = ROOT / "config" / f"{name}.yaml"
            template = yaml.safe_load(path.read_text(encoding="utf-8"))
            with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
                yaml.safe_dump({**template, "mode": "lockstep", "paused": True}, file)
                file.flush()
                arguments = [f"config:={file.name}", "env:=" + template["env"]]
                for parameters, expected in (
                    (Launch(*arguments).parameters, {"mode": "lockstep", "paused": True}),
                    (Launch(*arguments, *words).parameters, given),
                ):
                    for key, value in {**template, **expected}.items():
                        self.assertEqual(parameters["/walker_sim/" + key], value, key)

    def test_second_walker_needs_only_a_namespace(self):
        arguments = ["ns:=second", "agent:=heuristic", "recording:=true"]
        for env in ("BipedalWalker-v3", "Walker2d-v5"):
            launch = Launch(*arguments, "env:=" + env, display=":9")
            for name in launch.nodes:
                self.assertTrue(name.startswith("/second/"), name)
            self.assertEqual(launch.parameters["/second/walker_sim/tf_prefix"], "second")
            self.assertIs(launch.parameters["/second/walker_sim/publish_clock"], False)
            self.assertIn("/second/robot_description", launch.parameters)
            self.assertEqual(launch.nodes["/second/rviz"].type, "view.py")
            view_file, prefix = words_of(launch.nodes["/second/rviz"])
            self.assertEqual(
                (os.path.basename(view_file), prefix), (ROBOTS[env] + ".rviz", "second")
            )
            self.assertEqual(set(launch.parameters) & set(Launch().parameters), {"/use_sim_time"})

    def test_rviz_with_a_display_else_status_lines(self):
        self.assertNotIn("/rviz", Launch().types())
        self.assertIn("/status_line", Launch().types())
        self.assertEqual(Launch(display=":9").types()["/rviz"], "rviz")
        self.assertNotIn("/status_line", Launch(display=":9").types())
        for argument in ("rviz:=false", "gui:=false", "headless:=true"):
            self.assertNotIn("/rviz", Launch(argument, display=":9").types(), argument)
        self.assertIn("/rviz", Launch("rviz:=true").types())

    def test_a_page_if_asked_for(self):
        self.assertNotIn("/page", Launch().types())
        launch = Launch("web:=true", "web_host:=0.0.0.0", "web_port:=8090", "ns:=second")
        self.assertEqual(launch.types()["/second/page"], "page")
        found = [launch.parameters["/second/page/" + name] for name in ("host", "port")]
        self.assertEqual(found, ["0.0.0.0", 8090])

    def test_required_and_respawn(self):
        server = Launch().nodes["/walker_sim"]
        self.assertEqual(
            (server.required, server.respawn, server.launch_prefix), (True, False, None)
        )
        server = Launch("respawn:=true").nodes["/walker_sim"]
        self.assertEqual((server.required, server.respawn), (False, True))
        for mode in ("free", "lockstep"):
            agent = Launch("agent:=random", "mode:=" + mode, "respawn:=true").nodes["/agent"]
            self.assertEqual((agent.required, agent.respawn), (False, True))
            self.assertGreater(agent.respawn_delay, 0)
            agent = Launch("agent:=random", "mode:=" + mode).nodes["/agent"]
            self.assertEqual((agent.required, agent.respawn), (True, False))
        self.assertFalse(Launch("required:=false").nodes["/walker_sim"].required)
        self.assertTrue(Launch("debug:=true").nodes["/walker_sim"].launch_prefix.startswith("gdb "))
        variables = dict(Launch("verbose:=true").nodes["/walker_sim"].env_args)
        self.assertTrue(os.path.isfile(variables["ROSCONSOLE_CONFIG_FILE"]))
        with self.assertRaises(RLException):
            Launch("required:=true", "respawn:=true")

    def test_recording(self):
        for argument in ("recording:=", "recording:=false"):
            self.assertNotIn("/recorder", Launch(argument).types())
        # Relative to roslaunch's working directory; nodes run elsewhere.
        for given, option, path in (
            ("true", "-o", "/my bags/walker"),
            ("trial", "-o", "/my bags/trial"),
            ("trials/1", "-o", "/my bags/trials/1"),
            ("/tmp/trial", "-o", "/tmp/trial"),
            ("trial.bag", "-O", "/my bags/trial.bag"),
            ("/tmp/trial.bag", "-O", "/tmp/trial.bag"),
        ):
            launch = Launch("recording:=" + given, PWD="/my bags")
            arguments = words_of(launch.nodes["/recorder"])
            self.assertEqual(arguments[:2], [option, path])
            self.assertIn("episode_record", arguments, "replay needs it")


class TenWalkersTest(unittest.TestCase):
    """ten_walkers.launch, parsed; test/server/ten_walkers_test.py runs it."""

    def test_each_walker_has_its_own_namespace(self):
        launch = Launch(file=TEN_WALKERS)
        servers = {name for name, type_ in launch.types().items() if type_ == "server"}
        self.assertEqual(servers, {walker + "walker_sim" for walker in WALKERS})
        self.assertEqual({launch.parameters[name + "/env"] for name in servers}, set(ROBOTS))
        for name in launch.nodes:
            self.assertTrue(name.startswith(tuple(WALKERS)), name)
        for walker in WALKERS:
            self.assertIn(walker + "agent", launch.nodes)
            server = walker + "walker_sim"
            self.assertEqual(launch.parameters[server + "/tf_prefix"], walker.strip("/"))
            owns = launch.parameters[server + "/publish_clock"]
            self.assertIs(owns, walker == WALKERS[0])

    def test_arguments_apply_to_all_walkers_and_rviz_to_the_first(self):
        launch = Launch("real_time_factor:=2", "respawn:=false", file=TEN_WALKERS, display=":9")
        for walker in WALKERS:
            server = launch.nodes[walker + "walker_sim"]
            self.assertEqual((server.respawn, server.required), (False, False))
            self.assertEqual(launch.parameters[walker + "walker_sim/real_time_factor"], 2.0)
        launch = Launch("agent:=none", "rviz:=true", file=TEN_WALKERS, display=":9")
        shown = [name for name in launch.nodes if name.endswith(("rviz", "status_line", "agent"))]
        self.assertEqual(shown, ["/walker_1/rviz"])


if __name__ == "__main__":
    unittest.main()
