"""Servers of both robots in lock-step: names, steps, published messages and their stamps.

hostile_test.py has the refusals of invalid requests.
"""

import os
import random
import socket
import time
import xmlrpc.client

import rosgraph
import rospy
import rosservice
import sensor_msgs.msg
import tf2_msgs.msg
from bare_ros import BareSubscriber
from diagnostic_msgs.msg import DiagnosticArray
from node_processes import SERVICES
from processes import CALLER, wait_for
from server_harness import (
    DT,
    FALL,
    MARKERS,
    STATE_TOPICS,
    STATE_VALUES,
    ServerTest,
    bits,
    first_stamp,
    nanoseconds,
    same_experience,
)
from std_srvs.srv import Trigger
from walker_sim import _core
from walker_sim.msg import EnvironmentSpec, Episode, Transition

SERVER = "/walker_sim"
SERVICE_TYPES = {
    **{name: kind._type for name, kind in SERVICES.items()},
    "pause": "std_srvs/Trigger",
    "unpause": "std_srvs/Trigger",
    "get_physics_properties": "gazebo_msgs/GetPhysicsProperties",
    "set_physics_properties": "gazebo_msgs/SetPhysicsProperties",
}
LATCHED = {"/spec": EnvironmentSpec, "/episode": Episode, "/tf_static": tf2_msgs.msg.TFMessage}
OTHER_TOPICS = {
    "/diagnostics": DiagnosticArray,
    "/progress": Episode,
    "/camera/image_raw": sensor_msgs.msg.Image,
    "/camera/camera_info": sensor_msgs.msg.CameraInfo,
    **MARKERS,  # not latched, but published to each new subscriber
}
STEPPED = {topic: kind for topic, kind in STATE_TOPICS.items() if topic != "/clock"}
# By namespace: id and parameters.
ROBOTS = {
    "": ("BipedalWalker-v3", {}),
    "/walker2d": ("Walker2d-v5", {"terminate_when_unhealthy": False}),
}
# By namespace: version and a symbol of the engine's library.
ENGINES = {"": (r"^2\.[34]\.\d", b"b2PolygonShape"), "/walker2d": (r"^2\.2\.2\b", b"mj_step")}
QUIET = 0.6  # wall seconds in which 30 steps of a free-running server would pass
MAX_STEPS = 100  # of ~step_many


def float32_actions(seed, count, size=4):
    """Random actions that float32 represents exactly."""
    draws = random.Random(seed)
    return [[draws.randint(-128, 128) / 128 for _ in range(size)] for _ in range(count)]


class LockstepTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        cls.proxies = {}
        for space in ROBOTS:
            for name, kind in (*SERVICES.items(), ("pause", Trigger), ("unpause", Trigger)):
                rospy.wait_for_service(f"{space}{SERVER}/{name}", timeout=30)
                proxy = rospy.ServiceProxy(f"{space}{SERVER}/{name}", kind, persistent=True)
                cls.proxies[space, name] = proxy
        cls.specs = {space: cls.proxies[space, "get_spec"]().spec for space in ROBOTS}

    def setUp(self):
        self.use("")

    def use(self, space):
        """Chooses the robot to which the following calls refer."""
        self.space = space
        self.dt, self.size = round(self.specs[space].dt * 1e9), self.specs[space].action_size

    def ask(self, name, **fields):
        reply = self.proxies[self.space, name](**fields)
        self.assertEqual((reply.success, reply.status_message), (True, ""))
        return reply

    def begin(self, seed=None):
        return self.ask("reset", has_seed=seed is not None, seed=seed or 0).transition

    def advance(self, action=None):
        return self.ask("step", action=action or [0.0] * self.size).transition

    def play_episode(self, seed, actions):
        """Returns the transitions of an episode up to its end, the reset's first."""
        transitions = [self.begin(seed)]
        for action in actions:
            if transitions[-1].terminated or transitions[-1].truncated:
                break
            transitions.append(self.advance(action))
        return transitions

    def record_all(self, topics):
        return {topic: self.record(self.space + topic, kind) for topic, kind in topics.items()}

    def uri(self):
        return rosgraph.Master(CALLER).lookupNode(self.space + SERVER)

    def test_services_have_their_types(self):
        for name, kind in SERVICE_TYPES.items():
            self.assertEqual(rosservice.get_service_type(f"{SERVER}/{name}"), kind)

    def test_topics_have_their_types(self):
        master = rosgraph.Master(CALLER)
        publishers, subscribers, _ = master.getSystemState()
        types = dict(master.getTopicTypes())
        published = {topic for topic, nodes in publishers if SERVER in nodes}
        expected = {**STATE_TOPICS, **STATE_VALUES, **LATCHED, **OTHER_TOPICS}
        for topic, message in expected.items():
            self.assertIn(topic, published)
            self.assertEqual(types[topic], message._type)
        subscribed = {topic for topic, nodes in subscribers if SERVER in nodes}
        self.assertIn("/effort_command", subscribed)
        self.assertEqual(types["/effort_command"], "std_msgs/Float64MultiArray")

    def test_static_and_rare_messages_are_latched_and_others_published_by_steps(self):
        self.begin(1)
        self.advance()
        for topic, message in LATCHED.items():
            latched = self.record(topic, message).wait(what="the latched message")
            self.assertEqual(latched._connection_header.get("latching"), "1", topic)
        recorders = self.record_all({**STEPPED, **STATE_VALUES})
        before = self.advance()
        for topic, recorder in recorders.items():
            message = recorder.wait(what=f"a message after the step on {topic}")
            self.assertNotEqual(message._connection_header.get("latching"), "1", topic)
            if topic in STEPPED:
                recorder.at(nanoseconds(before))
            recorder.clear()
        time.sleep(QUIET)
        for topic, recorder in recorders.items():
            self.assertEqual(recorder.messages(), [], f"{topic} moves between steps")
        self.assert_consecutive([before, self.advance()])

    def test_a_late_subscriber_receives_the_newest_episode(self):
        for seed in range(3):
            newest = self.begin(seed)
        self.assertEqual(self.record("/episode", Episode).wait().episode, newest.episode)

    def test_specification_is_that_in_process(self):
        for space, robot in ROBOTS.items():
            spec = self.specs[space]
            self.assertEqual(str(self.record(f"{space}/spec", EnvironmentSpec).wait()), str(spec))
            self.assertEqual(spec.interface_version, EnvironmentSpec.INTERFACE_VERSION)
            self.assertEqual((spec.num_envs, spec.mode), (1, "lockstep"))
            self.assertEqual(spec.autoreset_mode, "next_step")
            self.assertEqual(spec.observation_size, len(spec.observation_low))
            self.assertEqual(spec.action_size, len(spec.action_low))
            expected = _core.Pool(*robot).specification
            del expected["engine_path"]
            parameters = dict(zip(spec.parameter_names, spec.parameter_values))
            self.assertEqual(parameters, expected.pop("parameters"))
            for name, value in expected.items():
                found = getattr(spec, name)
                found = list(found) if isinstance(value, list) else found
                self.assertEqual(repr(found), repr(value), name)  # NaN included

    def test_engine_path_is_the_loaded_library(self):
        for space, (version, symbol) in ENGINES.items():
            self.use(space)
            spec = self.specs[space]
            self.assertRegex(spec.engine_version, version)
            pid = xmlrpc.client.ServerProxy(self.uri()).getPid(CALLER)[2]
            with open(f"/proc/{pid}/maps", encoding="utf-8") as maps:
                loaded = {os.path.realpath(line.split()[-1]) for line in maps if "/" in line}
            self.assertTrue(os.path.isabs(spec.engine_path), spec.engine_path)
            self.assertIn(os.path.realpath(spec.engine_path), loaded)
            with open(spec.engine_path, "rb") as library:
                self.assertIn(symbol, library.read())

    def test_reply_and_messages_of_a_step_share_one_stamp(self):
        recorders = self.record_all(STATE_TOPICS)
        values = self.record_all(STATE_VALUES)
        reply = self.begin(3)
        for action in [None, *float32_actions(3, 20)]:
            if action:
                reply = self.advance(action)
            stamp = nanoseconds(reply)
            for topic, recorder in recorders.items():
                message = recorder.at(stamp)
                for transform in getattr(message, "transforms", []):
                    self.assertEqual(nanoseconds(transform), stamp, topic)
            published = recorders["/transition"].at(stamp)
            self.assertTrue(same_experience(published, reply))
            self.assertEqual(published.episode, reply.episode)
            values["/reward"].wait(lambda m, r=reply: m.data == r.reward)
            values["/observation"].wait(lambda m, r=reply: bits(m.data) == bits(r.observation))

    def test_stamps_grow_by_dt_over_many_resets(self):
        for space, count in (("", 1000), ("/walker2d", 50)):
            self.use(space)
            shared = ("/clock", "/tf", "/scan") if space else ()  # the first server's
            topics = {t: kind for t, kind in STATE_TOPICS.items() if t not in shared}
            recorders = self.record_all({**topics, "/episode": Episode})
            stamps = []
            for i in range(count):
                stamps.append(nanoseconds(self.begin(i % 5)))
                if i % 10 == 0:
                    stamps.append(nanoseconds(self.advance()))
            self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {self.dt})
            self.assertEqual(stamps[0] % self.dt, 0, "whole nanoseconds, without rounding errors")
            for topic, recorder in recorders.items():
                recorder.at(stamps[-1])
                published = recorder.stamps()
                self.assertGreater(len(published), count / 10, topic)
                self.assertTrue(all(a < b for a, b in zip(published, published[1:])), topic)

    def test_episode_is_published_at_its_reset_and_at_its_end(self):
        recorder = self.record("/episode", Episode)
        seed = 2**64 - 1
        transitions = self.play_episode(seed, [FALL] * 1600)
        last = transitions[-1]
        begun, ended = recorder.at(nanoseconds(transitions[0])), recorder.at(nanoseconds(last))
        self.assertEqual((begun.has_seed, begun.seed), (True, seed))
        self.assertEqual((begun.length, begun.episode_return, begun.end_reason), (0, 0, ""))
        self.assertEqual(begun.episode, transitions[0].episode)
        self.assertEqual((ended.length, ended.episode_return), (last.step, last.episode_return))
        self.assertEqual(ended.end_reason, "terminated: hull touched the ground")
        self.assertEqual(ended.generator_state, begun.generator_state)
        self.assertEqual((ended.has_seed, ended.seed), (True, seed))
        reply = self.proxies["", "step"]([0.0] * 4)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "ended.*reset")
        again = self.begin()
        self.assertEqual(nanoseconds(again), nanoseconds(last) + DT)
        continued = recorder.at(nanoseconds(again))
        self.assertFalse(continued.has_seed)
        self.assertNotEqual(continued.generator_state, begun.generator_state)

    def test_pause_has_no_effect_and_says_so(self):
        self.begin(4)
        before = self.advance()
        for name in ("pause", "unpause"):
            self.assertRegex(self.proxies["", name]().message, "lock-?step")
            after = self.advance()
            self.assert_consecutive([before, after])
            before = after

    def test_effort_commands_are_refused_and_counted(self):
        before = self.counter("refused")
        actions = [[0.0] * 4] * 5
        undisturbed = self.play_episode(9, actions)
        command = self.commander()
        connection = command.impl.connections[0].socket
        self.assertTrue(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        self.begin(9)
        for i, expected in enumerate(undisturbed[1:], start=1):
            command.publish(data=[80.0, -80.0, 80.0, -80.0])
            wait_for(lambda n=before + i: self.counter("refused") == n, "the count")
            self.assertTrue(same_experience(self.advance(), expected))

    def test_a_step_publishes_one_message_per_topic_with_subscribers(self):
        now = nanoseconds(self.begin(1))
        uri = self.uri()
        clock, frames = (BareSubscriber(uri, t, STATE_TOPICS[t]) for t in ("/clock", "/tf"))
        self.addCleanup(clock.close)
        self.addCleanup(frames.close)
        self.assertEqual(clock.next().clock.to_nsec(), now, "to each new subscriber")
        for _ in range(50):  # of two messages, the second would be read as the next step's
            stamp = nanoseconds(self.begin(1))
            while clock.next().clock.to_nsec() != stamp:
                pass
            self.assertEqual(first_stamp(frames.next()), stamp)
        # roscpp increments header.seq per published message, even without subscribers.
        self.serve("/fresh/walker_sim", mode="lockstep", publish_clock=False)
        self.call("reset", has_seed=True, seed=1)
        for topic in ("/joint_states", "/odom", "/imu", "/scan", "/contacts", "/transition"):
            subscriber = self.subscribe(f"/fresh{topic}", STATE_TOPICS[topic])
            self.call("step", action=[0.0] * 4)
            self.assertEqual(subscriber.next().header.seq, 0, f"{topic} was published")

    def step_many(self, action, count):
        return self.ask("step_many", action=action, steps=count)

    def compare_step_many(self, calls):
        """Compares ~step_many with single steps by replies and messages. Returns the latter."""
        recorder = self.record(f"{self.space}/transition", Transition)
        start = self.begin(7)
        single = []
        for action, count in calls:
            single.append([])
            while len(single[-1]) < count and not (single[-1] and single[-1][-1].terminated):
                single[-1].append(self.advance(action))
        begun = self.begin(7)
        advances = sum(map(len, single)) + 1
        self.assertEqual(nanoseconds(begun), nanoseconds(start) + advances * self.dt)
        for (action, count), transitions in zip(calls, single):
            reply = self.step_many(action, count)
            self.assertEqual(reply.steps, len(transitions))
            self.assertTrue(same_experience(reply.transition, transitions[-1]))
            total = 0.0
            for transition in transitions:
                total += transition.reward
            self.assertEqual(bits([reply.total_reward]), bits([total]))
        published = recorder.wait_count(2 * advances)
        self.assertEqual(len(published), 2 * advances, "one message for each reset and step")
        for one, other in zip(published[:advances], published[advances:]):
            self.assertTrue(same_experience(one, other))
        stamps = [nanoseconds(message) for message in published]
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {self.dt})
        return single

    def test_step_many_ends_with_the_episode(self):
        calls = [([0.5, -0.5, 0.25, 0.0], 4), ([0.0] * 4, 1), (FALL, MAX_STEPS)]
        single = self.compare_step_many(calls)[-1]
        self.assertTrue(single[-1].terminated, "the walker falls")
        reply = self.proxies["", "step_many"](action=FALL, steps=2)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "ended.*reset")
        self.assertEqual((reply.steps, reply.total_reward), (0, 0))
        self.assertEqual(list(reply.transition.observation), [])
        clamped, steps = (self.counter(word) for word in ("clamped", "steps"))
        self.begin(7)
        self.step_many([1.5, 0.0, 0.0, 0.0], 6)
        self.assertEqual(self.counter("clamped"), clamped + 6)
        self.assertEqual(self.counter("steps"), steps + 6)

    def test_step_many_of_another_robot_equals_single_steps(self):
        self.use("/walker2d")
        self.compare_step_many([([0.25] * 6, 40), ([1.0, -0.5, 0.25, -1.0, 0.5, 0.125], 40)])

    def test_step_many_ends_with_the_time_limit(self):
        self.serve("/fresh/walker_sim", mode="lockstep", publish_clock=False, max_episode_steps=25)
        self.call("reset", has_seed=True, seed=1)
        for steps, is_truncated in ((15, False), (10, True)):
            reply = self.call("step_many", action=[0.0] * 4, steps=15)
            self.assertEqual((reply.steps, reply.transition.truncated), (steps, is_truncated))
