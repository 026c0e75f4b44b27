#!/usr/bin/python3
"""~step_many: equality with single steps, and refusals."""

import math
import sys
import time

import rospy
import rostest
from server_harness import DT, ServerTest, bits, nanoseconds, same_experience
from walker_sim.msg import Transition

FALL = [1.0, 1.0, 1.0, -1.0]  # the walker falls within 60 steps
ACTIONS = [([0.5, -0.5, 0.25, 0.0], 4), ([-1.0, 1.0, 0.5, -0.125], 1), ([0.0] * 4, 30)]
MOST = 100


class StepManyTest(ServerTest):
    def begin(self, seed=7):
        reply = self.call("reset", has_seed=True, seed=seed)
        self.assertTrue(reply.success, reply.status_message)
        return reply.transition

    def step(self, action, count):
        """Returns the transitions of single steps, up to the end of the episode."""
        transitions = []
        for _ in range(count):
            reply = self.call("step", action=action)
            self.assertTrue(reply.success, reply.status_message)
            transitions.append(reply.transition)
            if reply.transition.terminated or reply.transition.truncated:
                break
        return transitions

    def step_many(self, action, count):
        reply = self.call("step_many", action=action, steps=count)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        return reply

    def assert_sums_up(self, reply, transitions):
        self.assertEqual(reply.steps, len(transitions))
        self.assertTrue(same_experience(reply.transition, transitions[-1]))
        total = 0.0
        for transition in transitions:
            total += transition.reward
        self.assertEqual(bits([reply.total_reward]), bits([total]))

    def compare(self, actions, **parameters):
        """Compares ~step_many with single steps by replies and messages. Returns the latter."""
        self.serve(mode="lockstep", **parameters)
        recorder = self.record("/transition", Transition)
        start = self.begin()
        single = [self.step(action, count) for action, count in actions]
        begun = self.begin()
        advances = sum(map(len, single)) + 1
        self.assertEqual(nanoseconds(begun), nanoseconds(start) + advances * self.dt)
        for (action, count), transitions in zip(actions, single):
            self.assert_sums_up(self.step_many(action, count), transitions)
        told = recorder.wait_count(2 * advances)
        half = len(told) // 2
        self.assertEqual(len(told), 2 * half, "one message for each reset and step")
        for one, other in zip(told[:half], told[half:]):
            self.assertTrue(same_experience(one, other))
        stamps = [nanoseconds(message) for message in told]
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {self.dt})
        return single

    def test_it_is_as_many_steps(self):
        self.compare(ACTIONS)

    def test_as_many_as_can_be_asked_for_reach_who_listens(self):
        self.dt = 8_000_000
        never_ends = {"env": "Walker2d-v5", "terminate_when_unhealthy": False}
        single = self.compare([([0.25] * 6, MOST)] * 3, **never_ends)
        self.assertEqual([len(transitions) for transitions in single], [MOST] * 3)

    def test_it_ends_with_the_episode(self):
        single = self.compare([(FALL, MOST)])[0]
        self.assertTrue(single[-1].terminated, "this gait was to fall")
        self.assertLess(len(single), MOST)
        reply = self.call("step_many", action=FALL, steps=2)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "ended.*reset")
        self.assertEqual((reply.steps, reply.total_reward), (0, 0))

    def test_it_ends_with_the_time_limit(self):
        single = self.compare([([0.0] * 4, 15)] * 2, max_episode_steps=25)
        self.assertEqual([len(transitions) for transitions in single], [15, 10])
        self.assertTrue(single[-1][-1].truncated)

    def test_walker2d_repeats_too(self):
        self.serve(env="Walker2d-v5", mode="lockstep")
        for action in ([0.0] * 6, [1.0, -0.5, 0.25, -1.0, 0.5, 0.125]):
            self.begin()
            single = self.step(action, 40)
            self.begin()
            self.assert_sums_up(self.step_many(action, 40), single)

    def test_what_is_refused_is_named_and_moves_nothing(self):
        self.serve(mode="lockstep")
        reply = self.call("step_many", action=[0.0] * 4, steps=3)
        self.assertFalse(reply.success)
        self.assertIn("reset", reply.status_message)
        before = self.begin()
        recorder = self.record("/transition", Transition)
        refused = [
            ([0.0] * 4, 0, r"steps = 0; must be in \[1, 100\]"),
            ([0.0] * 4, MOST + 1, r"steps = 101; must be in \[1, 100\]"),
            ([0.0] * 4, 2**32 - 1, r"steps = 4294967295; must be in \[1, 100\]"),
            ([], 3, "action has 0 values; must have 4"),
            ([0.0] * 5, 3, "action has 5 values; must have 4"),
            ([0.0, math.nan, 0.0, 0.0], 3, "knee_1.*nan.*finite"),
        ]
        for action, steps, words in refused:
            reply = self.call("step_many", action=action, steps=steps)
            self.assertFalse(reply.success)
            self.assertRegex(reply.status_message, words)
            self.assertEqual((reply.steps, reply.total_reward), (0, 0))
            self.assertEqual(list(reply.transition.observation), [])
        after = self.step_many([0.0] * 4, 1).transition
        self.assertEqual(nanoseconds(after), nanoseconds(before) + DT)
        self.assertEqual(after.step, 1)
        recorder.at(nanoseconds(after))
        self.assertEqual(len(recorder.messages()), 1)

    def test_several_environments_are_stepped_by_step_batch(self):
        self.serve(mode="lockstep", num_envs=2)
        self.call("reset_batch")
        reply = self.call("step_many", action=[0.0] * 4, steps=3)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "step_many.*num_envs = 2.*step_batch")

    def test_free_running_it_is_for_a_paused_simulation(self):
        self.serve()
        reply = self.call("step_many", action=[0.0] * 4, steps=3)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "step_many.*runs.*pause")
        self.call("pause")
        before = self.begin()
        reply = self.step_many([0.5, 0.0, 0.0, 0.0], 5)
        self.assertEqual((reply.steps, reply.transition.step), (5, 5))
        time.sleep(0.2)
        after = self.call("step", action=[0.0] * 4).transition
        self.assertEqual(nanoseconds(after), nanoseconds(before) + 6 * DT)

    def test_diagnostics_count_each_step(self):
        self.serve(mode="lockstep")
        self.begin()
        self.step_many([1.5, 0.0, 0.0, 0.0], 6)
        self.assertEqual(self.counter("clamped"), 6)
        self.assertEqual(self.counter("steps"), 6)


if __name__ == "__main__":
    rospy.init_node("step_many_test")
    rostest.rosrun("walker_sim", "step_many_test", StepManyTest, sys.argv)
