#!/usr/bin/python3
"""A free-running server: resets, pausing, and the same bits at any pace."""

import sys
import time

import rosgraph_msgs.msg
import rospy
import rostest
from server_harness import DT, ServerTest, bits, nanoseconds, same_experience
from walker_sim.msg import Episode, Transition

ZERO = [0.0] * 4
QUIET = 0.3  # wall seconds in which 15 steps would pass, or more at a higher pace


class FreeTest(ServerTest):
    def serve(self, **parameters):
        super().serve(**parameters)
        self.transitions = self.record("/transition", Transition)

    def assert_nothing_moves(self):
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        time.sleep(0.1)  # for messages in flight
        self.transitions.clear()
        clock.clear()
        time.sleep(QUIET)
        self.assertEqual(self.transitions.messages(), [])
        self.assertEqual(clock.messages(), [])

    def test_resets_itself_at_the_start_and_after_each_end(self):
        self.serve(seed="18446744073709551615", max_episode_steps=25, real_time_factor=2.0)
        episodes = self.record("/episode", Episode)
        self.transitions.wait(lambda m: m.episode == 4 and m.step == 5, "the fourth episode")
        transitions = self.transitions.messages()
        self.assert_consecutive(transitions)
        self.assertEqual({m.step for m in transitions if m.truncated}, {25})
        self.assertFalse(any(m.terminated for m in transitions))
        published = {(m.episode, m.length): m for m in episodes.messages()}
        for number in (3, 4):
            begun = published[number, 0]
            self.assertFalse(begun.has_seed)
            self.assertEqual(begun.end_reason, "")
        self.assertRegex(published[3, 25].end_reason, "^truncated: .*25")
        self.assertNotEqual(published[3, 0].generator_state, published[4, 0].generator_state)
        self.assertEqual(published[3, 0].generator_state, published[3, 25].generator_state)

    def test_seed_parameter_is_used_by_the_first_reset_and_published(self):
        seeds = []
        for seed in ("18446744073709551615", "0", "", ""):
            self.serve(seed=seed, paused=True)
            episode = self.record("/episode", Episode).wait()
            self.assertEqual((episode.episode, episode.has_seed), (1, True))
            seeds.append(episode.seed)
            if seed == "0":
                self.assert_nothing_moves()
            first = self.call("step", action=ZERO).transition
            self.call("reset", has_seed=True, seed=episode.seed)
            again = self.call("step", action=ZERO).transition
            self.assertEqual(bits(again.observation), bits(first.observation))
            self.server.stop()
        self.assertEqual(seeds[:2], [2**64 - 1, 0])
        self.assertNotEqual(*seeds[2:], "drawn seeds differ")

    def assert_step_is_refused(self, words):
        reply = self.call("step", action=[1.0] * 4)
        self.assertFalse(reply.success)
        self.assertIn(words, reply.status_message)

    def test_without_auto_reset_time_stops_at_the_end(self):
        self.serve(auto_reset=False, max_episode_steps=20, real_time_factor=10.0)
        self.assertEqual(self.call("get_spec").spec.autoreset_mode, "disabled")
        self.call("reset", has_seed=True, seed=3)
        for _ in range(2):
            last = self.transitions.wait(lambda m: m.truncated, "the end")
            self.assert_nothing_moves()
            self.assert_step_is_refused("the episode has ended")
            following = self.call("reset", has_seed=True, seed=3).transition
            self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)
            self.assertEqual((following.episode, following.step), (last.episode + 1, 0))
        self.transitions.wait(lambda m: m.truncated, "the next end")
        self.assertTrue(self.call("pause").success)
        self.assert_step_is_refused("reset")

    def test_paused_server_moves_only_by_step(self):
        self.serve(real_time_factor=10.0)
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
        begun = self.call("reset", has_seed=True, seed=1).transition
        self.assertEqual(nanoseconds(begun), nanoseconds(two.transition) + DT)
        self.assert_nothing_moves()  # a reset does not end the pause
        self.assertTrue(self.call("unpause").success)
        self.transitions.wait_count(20)
        self.assert_consecutive([begun, *self.transitions.messages()])

    def test_pauses_and_pace_change_no_bit(self):
        for env, size in (("BipedalWalker-v3", 4), ("Walker2d-v5", 6)):
            self.serve(env=env, paused=True, auto_reset=False, max_episode_steps=40)
            stepped = [self.call("reset", has_seed=True, seed=5).transition]
            stepped += [self.call("step", action=[0.0] * size).transition for _ in range(40)]
            for factor in (1.0, 20.0, 0.0):
                self.call("pause")
                self.call("set_real_time_factor", factor=factor)
                run = [self.call("reset", has_seed=True, seed=5).transition]
                self.transitions.at(nanoseconds(run[0]))
                self.transitions.clear()
                for count in (1, 10, 40):  # with pauses between
                    self.call("unpause")
                    self.transitions.wait_count(count)
                    self.call("pause")
                run += self.transitions.messages()
                self.assertEqual(len(run), len(stepped))
                self.assertTrue(all(map(same_experience, run, stepped)), (env, factor))
            self.server.stop()


if __name__ == "__main__":
    rospy.init_node("free_test")
    rostest.rosrun("walker_sim", "free_test", FreeTest, sys.argv)
