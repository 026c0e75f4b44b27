#!/usr/bin/python3
"""A server in lock-step: refusals, steps, published messages and their stamps."""

import math
import os
import random
import sys
import time
import unittest
import xmlrpc.client

import diagnostic_msgs.msg
import rosgraph
import rosgraph_msgs.msg
import rospy
import rosservice
import rostest
import sensor_msgs.msg
import std_msgs.msg
import tf2_msgs.msg
import visualization_msgs.msg
from bare_ros import BareSubscriber, wait_for
from server_harness import (
    DT,
    STATE_TOPICS,
    Recorder,
    ServerProcess,
    bits,
    first_stamp,
    nanoseconds,
    same_experience,
)
from std_srvs.srv import Trigger
from walker_sim.msg import EnvironmentSpec, Episode, Transition
from walker_sim.srv import GetSpec, Reset, Step

SERVER = "/walker_sim"
OTHER_TOPICS = {
    "/reward": std_msgs.msg.Float64,
    "/observation": std_msgs.msg.Float64MultiArray,
    "/episode": Episode,
    "/spec": EnvironmentSpec,
    "/tf_static": tf2_msgs.msg.TFMessage,
    "/diagnostics": diagnostic_msgs.msg.DiagnosticArray,
    "/camera/image_raw": sensor_msgs.msg.Image,
    "/camera/camera_info": sensor_msgs.msg.CameraInfo,
}
LATCHED = {
    "/spec": EnvironmentSpec,
    "/episode": Episode,
    "/tf_static": tf2_msgs.msg.TFMessage,
}
# Not latched, but published to each new subscriber.
MARKERS = {
    "/scene_markers": visualization_msgs.msg.MarkerArray,
    "/state_markers": visualization_msgs.msg.MarkerArray,
}
BAD_ACTIONS = {
    "no value": [],
    "too few": [0.1, 0.2, 0.3],
    "too many": [0.1, 0.2, 0.3, 0.4, 0.5],
    "NaN": [0.1, math.nan, 0.3, 0.4],
    "infinity": [0.1, 0.2, math.inf, 0.4],
    "minus infinity": [-math.inf, 0.2, 0.3, 0.4],
}
FALL = [1.0, 1.0, 1.0, -1.0]  # the walker falls within 60 steps
QUIET = 0.6  # wall seconds in which 30 steps of a free-running server would pass


def float32_actions(seed, count):
    """Random actions that float32 represents exactly."""
    draws = random.Random(seed)
    return [[draws.randint(-128, 128) / 128 for _ in range(4)] for _ in range(count)]


class LockstepTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        for name in ("reset", "step", "get_spec", "pause", "unpause"):
            rospy.wait_for_service(f"{SERVER}/{name}", timeout=30)
        cls.reset = rospy.ServiceProxy(f"{SERVER}/reset", Reset, persistent=True)
        cls.step = rospy.ServiceProxy(f"{SERVER}/step", Step, persistent=True)
        cls.get_spec = rospy.ServiceProxy(f"{SERVER}/get_spec", GetSpec)

    def begin(self, seed=None):
        reply = self.reset(has_seed=seed is not None, seed=seed or 0)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        return reply.transition

    def advance(self, action):
        reply = self.step(action)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        return reply.transition

    def play(self, seed, actions):
        """Returns the transitions of an episode up to its end, the reset's first."""
        transitions = [self.begin(seed)]
        for action in actions:
            if transitions[-1].terminated or transitions[-1].truncated:
                break
            transitions.append(self.advance(action))
        return transitions

    def play_to_the_end(self, seed=7):
        transitions = self.play(seed, [FALL] * 1600)
        self.assertTrue(transitions[-1].terminated, "this gait was to fall")
        return transitions

    # ------------------------------------------------------------ names

    def test_services_have_their_names_and_types(self):
        expected = {
            "reset": "walker_sim/Reset",
            "step": "walker_sim/Step",
            "reset_batch": "walker_sim/ResetBatch",
            "step_batch": "walker_sim/StepBatch",
            "step_many": "walker_sim/StepMany",
            "get_spec": "walker_sim/GetSpec",
            "render": "walker_sim/Render",
            "pause": "std_srvs/Trigger",
            "unpause": "std_srvs/Trigger",
            "get_physics_properties": "gazebo_msgs/GetPhysicsProperties",
            "set_physics_properties": "gazebo_msgs/SetPhysicsProperties",
        }
        for name, kind in expected.items():
            self.assertEqual(rosservice.get_service_type(f"{SERVER}/{name}"), kind)

    def test_topics_have_their_names_and_types(self):
        master = rosgraph.Master("/server_test")
        publishers, subscribers, _ = master.getSystemState()
        types = dict(master.getTopicTypes())
        published = {topic for topic, nodes in publishers if SERVER in nodes}
        expected = {**STATE_TOPICS, **OTHER_TOPICS, **LATCHED, **MARKERS}
        for topic, message in expected.items():
            self.assertIn(topic, published)
            self.assertEqual(types[topic], message._type)
        heard = {topic for topic, nodes in subscribers if SERVER in nodes}
        self.assertIn("/effort_command", heard)
        self.assertEqual(types["/effort_command"], "std_msgs/Float64MultiArray")

    def test_only_what_is_static_or_rare_is_latched(self):
        self.begin(1)
        self.advance([0.0] * 4)
        for topic, message in LATCHED.items():
            recorder = Recorder(topic, message)
            latched = recorder.wait(what="the latched message")
            self.assertEqual(latched._connection_header.get("latching"), "1", topic)
            recorder.close()
        plain = {topic: kind for topic, kind in STATE_TOPICS.items() if topic != "/clock"}
        plain.update({"/reward": OTHER_TOPICS["/reward"]})
        plain.update({"/observation": OTHER_TOPICS["/observation"]})
        recorders = {topic: Recorder(topic, message) for topic, message in plain.items()}
        time.sleep(QUIET)
        for topic, recorder in recorders.items():
            self.assertEqual(recorder.messages(), [], f"{topic} is latched")
        self.advance([0.0] * 4)
        for topic, recorder in recorders.items():
            message = recorder.wait(what=f"a message after the step on {topic}")
            self.assertNotEqual(message._connection_header.get("latching"), "1", topic)
            recorder.close()

    def test_the_specification_is_told_twice_and_alike(self):
        spec = self.get_spec().spec
        recorder = Recorder("/spec", EnvironmentSpec)
        latched = recorder.wait()
        recorder.close()
        self.assertTrue(math.isnan(spec.reward_threshold) or spec.reward_threshold == 300)
        self.assertEqual(latched, spec)
        self.assertEqual(spec.interface_version, EnvironmentSpec.INTERFACE_VERSION)
        self.assertEqual(spec.id, "BipedalWalker-v3")
        self.assertEqual(spec.num_envs, 1)
        self.assertEqual(spec.mode, "lockstep")
        self.assertEqual(spec.autoreset_mode, "next_step")
        self.assertEqual(spec.observation_size, 24)
        self.assertEqual(len(spec.observation_low), 24)
        self.assertEqual(len(spec.observation_high), 24)
        self.assertEqual(spec.observation_dtype, "float32")
        self.assertEqual(spec.action_size, 4)
        self.assertEqual(list(spec.action_low), [-1.0] * 4)
        self.assertEqual(list(spec.action_high), [1.0] * 4)
        self.assertEqual(spec.dt, 0.02)
        self.assertEqual(spec.max_episode_steps, 1600)
        self.assertEqual(list(spec.joint_names), ["hip_1", "knee_1", "hip_2", "knee_2"])
        parameters = dict(zip(spec.parameter_names, spec.parameter_values))
        self.assertEqual(parameters["hardcore"], "false")
        self.assertEqual(parameters["reuse_world"], "false")
        self.assertEqual(parameters["max_episode_steps"], "1600")
        self.assertTrue(spec.version)

    def test_engine_path_is_the_library_that_is_loaded(self):
        spec = self.get_spec().spec
        self.assertEqual(spec.engine, "Box2D")
        self.assertRegex(spec.engine_version, r"^2\.[34]\.\d")
        uri = rosgraph.Master("/server_test").lookupNode(SERVER)
        pid = xmlrpc.client.ServerProxy(uri).getPid("/server_test")[2]
        with open(f"/proc/{pid}/maps", encoding="utf-8") as maps:
            loaded = {os.path.realpath(line.split()[-1]) for line in maps if "/" in line}
        self.assertTrue(os.path.isabs(spec.engine_path), spec.engine_path)
        self.assertIn(os.path.realpath(spec.engine_path), loaded)
        with open(spec.engine_path, "rb") as library:
            self.assertIn(b"b2PolygonShape", library.read(), "no Box2D in that library")

    # ------------------------------------------------------------ time

    def test_reply_and_messages_of_a_step_carry_one_stamp(self):
        recorders = {topic: Recorder(topic, kind) for topic, kind in STATE_TOPICS.items()}
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
        for recorder in recorders.values():
            recorder.close()

    def test_nothing_moves_between_steps(self):
        self.begin(5)
        recorders = [Recorder(topic, kind) for topic, kind in STATE_TOPICS.items()]
        before = self.advance([0.5, -0.5, 0.25, 0.125])
        for recorder in recorders:
            recorder.at(nanoseconds(before))
        for recorder in recorders:
            recorder.clear()
        time.sleep(QUIET)
        for recorder in recorders:
            self.assertEqual(recorder.messages(), [], recorder.topic)
            recorder.close()
        after = self.advance([0.5, -0.5, 0.25, 0.125])
        self.assertEqual(nanoseconds(after), nanoseconds(before) + DT)
        self.assertEqual(after.step, before.step + 1)

    def test_a_reset_and_a_step_advance_the_clock_by_dt_in_whole_nanoseconds(self):
        clock = Recorder("/clock", rosgraph_msgs.msg.Clock)
        last = nanoseconds(self.begin(1))
        self.assertGreater(last, 0)
        self.assertEqual(last % DT, 0, "dt is 20,000,000 ns, without a remainder that grows")
        for i in range(30):
            now = nanoseconds(self.begin(i) if i % 3 == 0 else self.advance([0.0] * 4))
            self.assertEqual(now, last + DT)
            clock.at(now)
            last = now
        told = [message.clock.to_nsec() for message in clock.messages()]
        self.assertGreater(told[0], 0)
        self.assertTrue(all(a < b for a, b in zip(told, told[1:])))
        clock.close()

    def test_who_joins_between_steps_is_told_the_time(self):
        now = nanoseconds(self.begin(1))
        uri = rosgraph.Master("/server_test").lookupNode(SERVER)
        subscriber = BareSubscriber(uri, "/clock", rosgraph_msgs.msg.Clock)
        self.assertEqual(subscriber.next().clock.to_nsec(), now)
        subscriber.close()

    def test_stamps_grow_over_a_thousand_resets(self):
        recorders = {topic: Recorder(topic, kind) for topic, kind in STATE_TOPICS.items()}
        episodes = Recorder("/episode", Episode)
        stamps = []
        for i in range(1000):
            stamps.append(nanoseconds(self.begin(i % 5)))
            if i % 10 == 0:
                stamps.append(nanoseconds(self.advance([0.0] * 4)))
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})
        for topic, recorder in {**recorders, "/episode": episodes}.items():
            recorder.at(stamps[-1])
            told = [first_stamp(message) for message in recorder.messages()]
            self.assertGreater(len(told), 100, topic)
            self.assertTrue(all(a < b for a, b in zip(told, told[1:])), topic)
            recorder.close()

    # ------------------------------------------------------------ episodes

    def test_counters_and_sums_of_an_episode(self):
        first = self.begin(2)
        self.assertEqual(first.step, 0)
        self.assertEqual(list(first.action), [])
        self.assertEqual((first.reward, first.episode_return), (0, 0))
        self.assertEqual(first.environment, 0)
        total = 0.0
        for i, action in enumerate(float32_actions(2, 25), start=1):
            transition = self.advance(action)
            total += transition.reward
            self.assertEqual(transition.step, i)
            self.assertEqual(transition.episode, first.episode)
            self.assertEqual(bits(transition.action), bits(action))
            self.assertEqual(transition.episode_return, total)
            self.assertEqual(transition.error, "")
        self.assertEqual(self.begin(2).episode, first.episode + 1)

    def test_episode_is_told_at_the_reset_and_at_the_end(self):
        recorder = Recorder("/episode", Episode)
        seed = 2**64 - 1
        start = self.begin(seed)
        begun = recorder.at(nanoseconds(start))
        self.assertTrue(begun.has_seed)
        self.assertEqual(begun.seed, seed)
        self.assertEqual((begun.length, begun.episode_return, begun.end_reason), (0, 0, ""))
        self.assertEqual(begun.episode, start.episode)
        while not (start.terminated or start.truncated):
            start = self.advance(FALL)
        ended = recorder.at(nanoseconds(start))
        self.assertEqual(ended.length, start.step)
        self.assertEqual(ended.episode_return, start.episode_return)
        self.assertRegex(ended.end_reason, "^terminated: .+")
        self.assertEqual(ended.generator_state, begun.generator_state)
        self.assertEqual((ended.has_seed, ended.seed), (True, seed))
        again = self.begin()
        continued = recorder.at(nanoseconds(again))
        self.assertFalse(continued.has_seed)
        self.assertNotEqual(continued.generator_state, begun.generator_state)
        recorder.close()

    # ------------------------------------------------------------ refusals

    def assert_refused(self, action, *words):
        reply = self.step(action)
        self.assertFalse(reply.success)
        for word in words:
            self.assertIn(word, reply.status_message)
        return reply.status_message

    def test_bad_actions_are_refused_and_change_nothing(self):
        actions = float32_actions(4, 12)
        undisturbed = self.play(8, actions)
        watch = Recorder("/transition", Transition)
        clock = Recorder("/clock", rosgraph_msgs.msg.Clock)
        last = self.begin(8)
        for expected, action in zip(undisturbed[1:], actions):
            for bad in BAD_ACTIONS.values():
                self.assert_refused(bad)
            transition = self.advance(action)
            self.assertTrue(same_experience(transition, expected))
            self.assertEqual(nanoseconds(transition), nanoseconds(last) + DT)
            last = transition
        watch.at(nanoseconds(last))
        clock.at(nanoseconds(last))
        self.assertEqual(len(watch.messages()), len(actions) + 1)
        self.assertLessEqual(len(clock.messages()), len(actions) + 2)
        watch.close()
        clock.close()

    def test_refusals_name_what_is_wrong(self):
        self.begin(8)
        self.assert_refused([], "0", "4")
        self.assert_refused([0.0] * 3, "3", "4")
        self.assert_refused([0.0] * 5, "5", "4")
        self.assert_refused([0.0, math.nan, 0.0, 0.0], "knee_1", "nan", "finite")
        self.assert_refused([0.0, 0.0, math.inf, 0.0], "hip_2", "inf", "finite")
        self.assert_refused([0.0, 0.0, 0.0, -math.inf], "knee_2", "-inf", "finite")

    def test_a_step_after_the_end_is_refused_and_changes_nothing(self):
        last = self.play_to_the_end()[-1]
        watch = Recorder("/transition", Transition)
        for _ in range(3):
            self.assert_refused([0.0] * 4, "ended", "reset")
        following = self.begin(1)
        self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)
        self.assertEqual(following.episode, last.episode + 1)
        watch.at(nanoseconds(following))
        self.assertEqual(len(watch.messages()), 1)
        watch.close()

    def test_a_step_before_the_first_reset_is_refused(self):
        server = ServerProcess("/fresh", {"mode": "lockstep", "publish_clock": False})
        try:
            server.wait_until_it_serves()
            step = server.client("step", Step)
            for _ in range(2):
                reply = step(action=[0.0] * 4)
                self.assertFalse(reply.success)
                self.assertIn("reset", reply.status_message)
            transition = server.client("reset", Reset)(has_seed=True, seed=1).transition
            self.assertEqual((transition.episode, transition.step), (1, 0))
            self.assertTrue(same_experience(transition, self.begin(1)))
            self.assertTrue(step(action=[0.0] * 4).success)
        finally:
            server.kill()

    def test_pausing_does_nothing_and_says_so(self):
        self.begin(4)
        before = self.advance([0.0] * 4)
        for name in ("pause", "unpause"):
            reply = rospy.ServiceProxy(f"{SERVER}/{name}", Trigger)()
            self.assertRegex(reply.message, "lock-?step")
            after = self.advance([0.0] * 4)
            self.assertEqual(after.step, before.step + 1)
            self.assertEqual(nanoseconds(after), nanoseconds(before) + DT)
            before = after

    # ------------------------------------------------------------ commands and diagnostics

    def counter(self, diagnostics, word):
        """Value in new diagnostics of the first key that contains `word`."""
        diagnostics.clear()
        message = diagnostics.wait(lambda m: any(self._values(m, word)), f"a key with {word}")
        return int(float(self._values(message, word)[0]))

    @staticmethod
    def _values(message, word):
        return [
            pair.value
            for status in message.status
            if SERVER.strip("/") in status.name
            for pair in status.values
            if word in pair.key
        ]

    def test_effort_commands_are_refused_and_counted(self):
        diagnostics = Recorder("/diagnostics", diagnostic_msgs.msg.DiagnosticArray)
        before = self.counter(diagnostics, "refused")
        actions = [[0.0] * 4] * 5
        undisturbed = self.play(9, actions)
        command = rospy.Publisher("/effort_command", std_msgs.msg.Float64MultiArray, queue_size=9)
        wait_for(lambda: command.get_num_connections() >= 1, "the server to listen")
        self.begin(9)
        for i, expected in enumerate(undisturbed[1:], start=1):
            command.publish(data=[80.0, -80.0, 80.0, -80.0])
            wait_for(lambda n=before + i: self.counter(diagnostics, "refused") == n, "the count")
            self.assertTrue(same_experience(self.advance([0.0] * 4), expected))
        command.unregister()
        diagnostics.close()

    def test_an_action_beyond_the_bounds_is_limited_and_counted(self):
        diagnostics = Recorder("/diagnostics", diagnostic_msgs.msg.DiagnosticArray)
        before = self.counter(diagnostics, "clamped")
        limited = self.play(3, [[1.0, -1.0, 0.5, -1.0]] * 3)
        self.assertEqual(self.counter(diagnostics, "clamped"), before)
        beyond = self.play(3, [[1.5, -1e300, 0.5, -1.0]] * 3)
        self.assertEqual(self.counter(diagnostics, "clamped"), before + 3)
        for one, other in zip(limited[1:], beyond[1:]):
            self.assertEqual(bits(one.observation), bits(other.observation))
            self.assertEqual(one.reward, other.reward)
            self.assertEqual(bits(other.action), bits([1.5, -1e300, 0.5, -1.0]))
        diagnostics.close()

    def test_diagnostics_come_while_time_stands_still(self):
        diagnostics = Recorder("/diagnostics", diagnostic_msgs.msg.DiagnosticArray)
        self.begin(1)
        diagnostics.clear()
        diagnostics.wait_count(3, timeout=15)
        for word in ("real_time_factor", "missed", "clamped", "refused"):
            self.assertGreaterEqual(self.counter(diagnostics, word), 0)
        diagnostics.close()


if __name__ == "__main__":
    rospy.init_node("lockstep_test")
    rostest.rosrun("walker_sim", "lockstep_test", LockstepTest, sys.argv)
