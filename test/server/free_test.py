#!/usr/bin/python3
"""A free-running server: resets and pausing."""

import math
import sys
import time

import rosgraph_msgs.msg
import rospy
import rostest
from server_harness import DT, ServerTest, bits, nanoseconds, same_experience
from walker_sim.msg import Episode, Transition

ZERO = [0.0] * 4
QUIET = 0.6  # wall seconds in which 30 steps would pass


class FreeTest(ServerTest):
    def serve(self, **parameters):
        super().serve(**parameters)
        self.transitions = self.record("/transition", Transition)

    def torques(self):
        """Distinct actions so far, except those of resets."""
        return {tuple(m.action) for m in self.transitions.messages() if m.step > 0}

    def assert_nothing_moves(self):
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        time.sleep(0.2)  # for messages in flight
        self.transitions.clear()
        clock.clear()
        time.sleep(QUIET)
        self.assertEqual(self.transitions.messages(), [])
        self.assertEqual(clock.messages(), [])

    def test_it_resets_itself_at_the_start_and_after_each_end(self):
        self.serve(seed="18446744073709551615", max_episode_steps=25, real_time_factor=2.0)
        episodes = self.record("/episode", Episode)
        self.transitions.wait(lambda m: m.episode == 4 and m.step == 5, "the fourth episode")
        transitions = self.transitions.messages()
        self.assert_consecutive(transitions)
        self.assertEqual({m.step for m in transitions if m.truncated}, {25})
        self.assertFalse(any(m.terminated for m in transitions))
        told = {(m.episode, m.length): m for m in episodes.messages()}
        for number in (3, 4):
            begun = told[number, 0]
            self.assertFalse(begun.has_seed)
            self.assertEqual(begun.end_reason, "")
        self.assertRegex(told[3, 25].end_reason, "^truncated: .*25")
        self.assertNotEqual(told[3, 0].generator_state, told[4, 0].generator_state)
        self.assertEqual(told[3, 0].generator_state, told[3, 25].generator_state)

    def test_the_seed_parameter_serves_the_first_reset_and_is_reported(self):
        for seed, expected in (("18446744073709551615", 2**64 - 1), ("0", 0), ("", None)):
            self.serve(seed=seed, paused=True)
            episode = self.record("/episode", Episode).wait()
            self.assertEqual((episode.episode, episode.has_seed), (1, True))
            if expected is not None:
                self.assertEqual(episode.seed, expected)
            first = self.call("step", action=ZERO).transition
            self.call("reset", has_seed=True, seed=episode.seed)
            again = self.call("step", action=ZERO).transition
            self.assertEqual(bits(again.observation), bits(first.observation))
            self.server.stop()

    def test_drawn_seeds_differ(self):
        seeds = set()
        for _ in range(2):
            self.serve(paused=True)
            seeds.add(self.record("/episode", Episode).wait().seed)
            self.server.stop()
        self.assertEqual(len(seeds), 2)

    def test_without_auto_reset_the_clock_stops_at_the_end(self):
        self.serve(auto_reset=False, max_episode_steps=20, real_time_factor=2.0)
        self.assertEqual(self.call("get_spec").spec.autoreset_mode, "disabled")
        self.call("reset", has_seed=True, seed=3)
        for _ in range(2):
            last = self.transitions.wait(lambda m: m.truncated, "the end")
            self.assert_nothing_moves()
            following = self.call("reset", has_seed=True, seed=3).transition
            self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)
            self.assertEqual((following.episode, following.step), (last.episode + 1, 0))
        self.transitions.wait(lambda m: m.step == 10, "the episode to run")

    def test_a_step_after_the_end_is_refused_also_when_paused(self):
        self.serve(auto_reset=False, max_episode_steps=20, real_time_factor=4.0)
        self.call("reset", has_seed=True, seed=3)
        last = self.transitions.wait(lambda m: m.truncated, "the end")
        reply = self.call("step", action=ZERO)
        self.assertFalse(reply.success)
        self.assertIn("the episode has ended", reply.status_message)
        self.assertTrue(self.call("pause").success)
        reply = self.call("step", action=ZERO)
        self.assertFalse(reply.success)
        self.assertIn("reset", reply.status_message)
        following = self.call("reset", has_seed=True, seed=3).transition
        self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)

    def test_a_step_is_refused_while_it_runs(self):
        self.serve()
        reply = self.call("step", action=[1.0] * 4)
        self.assertFalse(reply.success)
        self.assertIn("pause", reply.status_message)
        self.transitions.wait_count(20)
        self.assertEqual(self.torques(), {tuple(ZERO)})
        self.assert_consecutive(self.transitions.messages())

    def test_paused_nothing_moves_but_by_step(self):
        self.serve(real_time_factor=2.0)
        self.transitions.wait_count(5)
        reply = self.call("pause")
        self.assertTrue(reply.success, reply.message)
        self.assert_nothing_moves()
        action = [0.5, -0.25, 0.125, 1.0]
        one = self.call("step", action=action)
        self.assertTrue(one.success, one.status_message)
        self.assertEqual(bits(one.transition.action), bits(action))
        published = self.transitions.at(nanoseconds(one.transition))
        self.assertTrue(same_experience(published, one.transition))
        self.assert_nothing_moves()  # exactly one step
        two = self.call("step", action=action)
        self.assert_consecutive([one.transition, two.transition])
        bad = self.call("step", action=[math.nan] * 4)
        self.assertFalse(bad.success)
        begun = self.call("reset", has_seed=True, seed=1).transition
        self.assertEqual(nanoseconds(begun), nanoseconds(two.transition) + DT)
        self.assert_nothing_moves()  # a reset does not end the pause
        self.assertTrue(self.call("unpause").success)
        self.transitions.wait_count(20)
        self.assert_consecutive([begun, *self.transitions.messages()])

    def test_it_starts_paused_where_told(self):
        self.serve(paused=True)
        self.assert_nothing_moves()
        first = self.call("step", action=ZERO)
        self.assertTrue(first.success, first.status_message)
        self.assertEqual((first.transition.episode, first.transition.step), (1, 1))
        self.call("unpause")
        self.transitions.wait_count(5)


if __name__ == "__main__":
    rospy.init_node("free_test")
    rostest.rosrun("walker_sim", "free_test", FreeTest, sys.argv)
