"""Agent processes: invalid parameters, a server that starts late or ends, prompt shutdown."""

import os
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
import rosgraph
import rospkg
import rospy
from nav_msgs.msg import Odometry
from node_processes import Process, memory
from processes import wait_for
from sensor_msgs.msg import JointState, LaserScan
from server_harness import ServerTest
from std_msgs.msg import Float64MultiArray
from walker_sim import _core
from walker_sim.msg import Contacts, EnvironmentSpec, Episode, Transition
from walker_sim.srv import GetSpec, GetSpecResponse, Reset, ResetResponse
from walker_sim.training.policy_file import read_policy, with_history, write_policy

AGENTS = ("service_agent", "topic_agent")
PROMPT = 15  # shutdown timeout [s], wall time
SENSORS = {"/joint_states", "/imu", "/odom", "/contacts", "/scan"}


def heard():
    """Returns the topics to which the agent subscribes."""
    subscribers = rosgraph.Master("agent_nodes_test").getSystemState()[1]
    return {topic for topic, nodes in subscribers if "/agent" in nodes}


def included_policy(name):
    folder = rospkg.RosPack().get_path("walker_sim")
    return os.path.join(folder, f"assets/policies/{name}.safetensors")


def huge(message_class):
    """Returns a subclass that serializes to bytes in which every array length is 2^31 - 1."""

    class Huge(message_class):
        def serialize(self, buffer):
            buffer.write(b"\xff\xff\xff\x7f" * 25)

    return Huge


class AgentNodesTest(ServerTest):
    def start_agent(self, node_type, arguments=(), **parameters):
        return self.start_node(node_type, {"server": "/walker_sim", **parameters}, arguments)

    def start_node(self, node_type, parameters, arguments=()):
        if rospy.has_param("/agent"):
            rospy.delete_param("/agent")
        if parameters:
            rospy.set_param("/agent", parameters)
        node = Process(node_type, "/agent", arguments)
        self.addCleanup(node.end)
        return node

    def assert_refused(self, node_type, words, **parameters):
        agent = self.start_agent(node_type, **parameters)
        self.assertEqual(agent.wait(), 1, agent.output())
        fatal = [line for line in agent.output().splitlines() if "FATAL" in line]
        self.assertEqual(len(fatal), 1, agent.output())
        for word in words:
            self.assertIn(word, fatal[0])

    def test_invalid_parameters_and_policies_are_named(self):
        self.serve(mode="lockstep")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        broken = os.path.join(folder.name, "broken.safetensors")
        with open(broken, "wb") as file:
            file.write(b"no policy")
        other = included_policy("Walker2d-v5")
        missing = "missing.safetensors"
        for parameters, words in (
            ({"agent": "runner"}, ["agent", "runner", "heuristic", "random"]),
            ({"sedes": "1"}, ["sedes", "seeds"]),
            ({"seeds": "1 -3"}, ["seeds", "-3"]),
            ({"seeds": [1e300]}, ["seeds", "1.0e+300", "18446744073709"]),
            ({"episodes": -1}, ["episodes", "-1"]),
            ({"episodes": 1e300}, ["episodes = 1.0e+300", "[0, 4294967295]"]),
            ({"stamp_tolerance": -0.1}, ["stamp_tolerance", "-0.1"]),
            ({"real_time_factor": "1.001e3"}, ["real_time_factor = 1001.0", "1000.0]"]),
            ({"agent": "policy", "policy": missing}, [missing, "cannot be read"]),
            ({"agent": "policy", "policy": broken}, [broken, "header"]),
            ({"agent": "policy", "policy": other}, [other, "Walker2d-v5", "17", "24"]),
            ({"agent": "random", "policy": broken}, [broken, "agent = random"]),
        ):
            for node_type in AGENTS:
                self.assert_refused(node_type, words, **parameters)

    def test_the_policy_is_found_by_its_name_or_by_the_world(self):
        for world, given, name in (
            ({}, {"policy": "robust"}, "-robust"),
            ({"world": "pushed"}, {}, "-robust"),
            ({"world": "pushed"}, {"policy": "shipped"}, ""),
        ):
            self.serve(mode="lockstep", max_episode_steps=5, **world)
            transitions = self.record("/transition", Transition)
            agent = self.start_agent(
                "service_agent", episodes=1, seeds="5", agent="policy", **given
            )
            self.assertEqual(agent.wait(), 0, agent.output())
            self.assertEqual("so the robust policy walks" in agent.output(), not given)
            begin, step = transitions.wait_count(6)[:2]
            action = np.empty(4)
            file = included_policy(f"BipedalWalker-v3{name}")
            policy = _core.Policy(file)
            policy.act_next(_core.PolicyInput(policy), np.array(begin.observation), action)
            self.assertEqual(list(step.action), action.tolist())
            self.server.stop()
        self.serve(env="Hopper-v4", mode="lockstep")
        for node_type in AGENTS:
            words = ["policy = robust", "Hopper-v4"]
            self.assert_refused(node_type, words, agent="policy", policy="robust")

    def test_a_policy_remembers_within_an_episode(self):
        policy = with_history(read_policy(Path(included_policy("BipedalWalker-v3"))), (3, 2))
        weight, bias = policy.layers[0]
        noise = np.random.default_rng(0).normal(0, 0.05, weight.shape).astype(np.float32)
        policy.layers[0] = (weight + noise, bias)
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        file = os.path.join(folder.name, "remembers.safetensors")
        write_policy(policy, Path(file))
        self.serve(mode="lockstep", max_episode_steps=8)
        transitions = self.record("/transition", Transition)
        agent = self.start_agent("service_agent", episodes=2, agent="policy", policy=file)
        self.assertEqual(agent.wait(), 0, agent.output())
        for begin in (0, 9):
            observation, *steps = transitions.wait_count(18)[begin : begin + 9]
            observed, acted, action = np.zeros(3 * 24), np.zeros(2 * 4), np.empty(4)
            for step in steps:
                observed = np.concatenate([observed[24:], observation.observation])
                _core.Policy(file).act(np.concatenate([observed, acted]), action)
                self.assertEqual(list(step.action), action.tolist())
                acted = np.concatenate([acted[4:], action])
                observation = step

    def test_unsuitable_servers_are_refused(self):
        self.serve(mode="lockstep", num_envs=3)
        for node_type in AGENTS:
            self.assert_refused(node_type, ["num_envs = 3; must be 1", "~step_batch"])
        self.server.stop()
        self.serve()
        self.assert_refused("service_agent", ["lockstep"])

    def test_env_excludes_seeds(self):
        self.assert_refused("topic_agent", ["Walker2d-v6", "Walker2d-v5"], env="Walker2d-v6")
        self.assert_refused(
            "topic_agent", ["seeds = 1 2", "server", "Walker2d-v5"], env="Walker2d-v5", seeds="1 2"
        )
        self.assert_refused("service_agent", ["env = Walker2d-v5"], env="Walker2d-v5")

    def test_the_topic_agent_subscribes_to_sensors_only(self):
        self.serve()
        transitions = self.record("/transition", Transition)
        for parameters in ({}, {"env": "BipedalWalker-v3"}):
            agent = self.start_agent("topic_agent", **parameters)
            transitions.wait(lambda m: any(m.action), "steps of the agent")
            self.assertLessEqual(heard(), SENSORS | {"/episode", "/clock"})
            self.assertLessEqual(SENSORS, heard())
            self.assertEqual(agent.stop(signal.SIGINT, PROMPT), 0, agent.output())
            # The server holds the last command for half a second.
            transitions.clear()
            transitions.wait(lambda m: m.step > 0 and not any(m.action), "the command's timeout")
            transitions.clear()

    def test_malformed_messages_allocate_no_memory(self):
        """roscpp's own deserializer would allocate the claimed number of elements first."""
        sensors = {
            "joint_states": JointState,
            "scan": LaserScan,
            "contacts": Contacts,
            "episode": Episode,
        }
        states = {"progress": Episode, "spec": EnvironmentSpec, "odom": Odometry}
        for node_type, parameters, node_listens_to in (
            ("topic_agent", {"server": "/walker_sim", "env": "BipedalWalker-v3"}, sensors),
            ("status_line", {}, states),
        ):
            node = self.start_node(node_type, parameters)
            publishers = {}
            for topic, kind in node_listens_to.items():
                publishers[topic] = rospy.Publisher("/" + topic, huge(kind), queue_size=10)
                self.addCleanup(publishers[topic].unregister)
            for publisher in publishers.values():
                wait_for(lambda p=publisher: p.get_num_connections() >= 1, "the node to listen")
            before = memory(node.pid)
            for topic, publisher in publishers.items():

                def says_so(node=node, topic=topic, publisher=publisher):
                    publisher.publish()
                    return f"Refused {topic}: the message ends within a field" in node.output()

                wait_for(says_so, "the reason")
            self.assertLess(memory(node.pid) - before, 50 << 20)
            self.assertEqual(node.stop(signal.SIGINT, PROMPT), 0, node.output())
            for publisher in publishers.values():
                publisher.unregister()

    def test_the_service_agent_ends_after_its_episodes(self):
        self.serve(mode="lockstep")
        episodes = self.record("/episode", Episode)
        agent = self.start_agent("service_agent", episodes=2, seeds="5")
        self.assertEqual(agent.wait(), 0, agent.output())
        ended = [message for message in episodes.wait_count(4) if message.length > 0]
        self.assertEqual([message.seed for message in ended], [5, 5])

    def test_the_topic_agent_counts_its_own_episodes(self):
        self.serve(auto_reset=False, max_episode_steps=20)
        episodes = self.record("/episode", Episode)
        agent = self.start_agent("topic_agent", episodes=2, seeds="5 7")
        self.assertEqual(agent.wait(), 0, agent.output())
        episodes.wait(lambda m: m.episode == 3 and m.length > 0, "the end of the agent's second")
        ended = [message for message in episodes.messages() if message.length > 0]
        self.assertEqual([(m.episode, m.seed) for m in ended if m.episode > 1], [(2, 5), (3, 7)])

    def test_the_topic_agent_waits_for_a_subscriber_of_its_commands(self):
        self.serve(auto_reset=False)
        transitions = self.record("/transition", Transition)
        agent = self.start_agent("topic_agent", ["effort_command:=/elsewhere"], seeds="5")
        wait_for(lambda: SENSORS | {"/episode"} <= heard(), "the agent's subscriptions")
        transitions.wait()
        time.sleep(2)  # time for an unwanted reset; the walker may have fallen
        self.assertEqual({m.episode for m in transitions.messages()}, {1})
        self.record("/elsewhere", Float64MultiArray)
        transitions.wait(lambda m: m.episode == 2, "the agent's first episode")
        self.assertTrue(agent.is_running(), agent.output())

    def test_an_agent_reconnects_to_its_server(self):
        agent = self.start_agent("service_agent", agent="random")
        for end in ("kill", "stop", "stop"):
            self.serve(mode="lockstep")
            transitions = self.record("/transition", Transition)
            transitions.wait(lambda m: m.step > 3, "steps of the agent")
            self.assertTrue(agent.is_running(), agent.output())
            getattr(self.server, end)()
            transitions.close()
        self.assertTrue(agent.is_running(), agent.output())

    def test_an_agent_waits_for_a_halted_server(self):
        self.serve(mode="lockstep")
        transitions = self.record("/transition", Transition)
        agent = self.start_agent("service_agent", agent="random")
        transitions.wait(lambda m: m.step > 3, "steps of the agent")
        with self.server.halted():
            # The halt may meet a step or a reset.
            said = "No answer from /walker_sim; waiting for the server: service /walker_sim/"
            wait_for(lambda: said in agent.output(), "the agent to say so")
            other = Process("topic_agent", "/other", ["_server:=/walker_sim"])
            self.addCleanup(other.end)
            time.sleep(1)  # time for its first request
            self.assertEqual(other.stop(signal.SIGINT, PROMPT), 0, other.output())
        transitions.clear()
        transitions.wait(lambda m: m.step > 3, "steps of the agent")
        self.assertEqual(agent.stop(signal.SIGINT, PROMPT), 0, agent.output())

    def test_a_server_with_other_sizes_is_reported(self):
        self.serve(mode="lockstep")
        spec = self.call("get_spec").spec
        short = Transition(observation=[0.0] * 3, action=[0.0] * 4)
        answers = {
            "get_spec": (GetSpec, lambda _: GetSpecResponse(spec=spec)),
            "reset": (Reset, lambda _: ResetResponse(success=True, transition=short)),
        }
        for name, (kind, answer) in answers.items():
            service = rospy.Service(f"/liar/{name}", kind, answer)
            self.addCleanup(service.shutdown)
        agent = self.start_agent("service_agent", server="/liar")
        wait_for(lambda: agent.output().count("No answer from /liar") > 1, "the agent to say so")
        self.assertIn("observation", agent.output())
        self.assertTrue(agent.is_running(), agent.output())
        self.assertEqual(agent.stop(signal.SIGINT, PROMPT), 0, agent.output())
        spec.observation_size = 3
        spec.observation_low, spec.observation_high = [-1.0] * 3, [1.0] * 3
        self.assert_refused("service_agent", ["3 observations", "here it has 24"], server="/liar")

    def test_signals_end_an_agent_promptly(self):
        for node_type, mode in (("service_agent", "lockstep"), ("topic_agent", "free")):
            for end in (signal.SIGINT, signal.SIGTERM):
                waiting = self.start_agent(node_type)
                time.sleep(0.5)
                self.assertEqual(waiting.stop(end, PROMPT), 0, waiting.output())
                self.serve(mode=mode)
                transitions = self.record("/transition", Transition)
                acting = self.start_agent(node_type)
                transitions.wait(lambda m: any(m.action), "steps of the agent")
                self.assertEqual(acting.stop(end, PROMPT), 0, acting.output())
                self.server.stop()
