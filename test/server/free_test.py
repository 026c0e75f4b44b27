#!/usr/bin/python3
"""A free-running server: its pace, its resets, commands and their timeout, pausing."""

import math
import sys
import time
import unittest

import diagnostic_msgs.msg
import rosgraph_msgs.msg
import rospy
import rostest
from server_harness import DT, Recorder, ServerProcess, bits, nanoseconds, wait_for
from std_msgs.msg import Float64MultiArray, MultiArrayDimension
from std_srvs.srv import Trigger
from walker_sim.msg import Episode, Transition
from walker_sim.srv import GetSpec, Reset, Step

ZERO = [0.0] * 4
STAND = [80.0, 80.0, -80.0, 80.0]  # [N m] the walker stands astride as long as it is held
QUIET = 0.6  # wall seconds in which 30 steps would pass


class FreeTest(unittest.TestCase):
    def serve(self, **parameters):
        """A server of this test's own, and its transitions from now on."""
        self.server = ServerProcess("/walker_sim", parameters)
        self.addCleanup(self.server.kill)
        self.addCleanup(self.server.stop)
        self.server.wait_until_it_serves()
        self.transitions = self.record("/transition", Transition)
        return self.server

    def record(self, topic, kind):
        recorder = Recorder(topic, kind)
        self.addCleanup(recorder.close)
        return recorder

    def call(self, name, **fields):
        kind = {"reset": Reset, "step": Step, "get_spec": GetSpec}.get(name, Trigger)
        client = self.server.client(name, kind)
        try:
            return client(**fields)
        finally:
            client.close()

    def commander(self):
        publisher = rospy.Publisher("/effort_command", Float64MultiArray, queue_size=10)
        self.addCleanup(publisher.unregister)
        wait_for(lambda: publisher.get_num_connections() >= 1, "the server to listen")
        return publisher

    def drive(self, efforts):
        """An episode that has this command from its first step on; the publisher of commands."""
        command = self.commander()
        self.call("pause")
        self.call("reset", has_seed=True, seed=1)
        command.publish(data=efforts)
        time.sleep(0.3)  # should it arrive later still, only the walker stoops a little
        self.call("unpause")
        self.transitions.wait(lambda m: any(m.action), "the command")
        return command

    def driven(self):
        """Steps so far that had torque."""
        return [m for m in self.transitions.messages() if any(m.action)]

    def counter(self, word):
        """The value in fresh diagnostics whose key holds `word`."""
        if not hasattr(self, "diagnostics"):
            self.diagnostics = self.record("/diagnostics", diagnostic_msgs.msg.DiagnosticArray)

        def values(message):
            return [
                pair.value
                for status in message.status
                for pair in status.values
                if word in pair.key
            ]

        self.diagnostics.clear()
        return float(values(self.diagnostics.wait(values, f"a key with {word}"))[0])

    def assert_consecutive(self, transitions):
        """Each follows the one before by one dt, within an episode and from one to the next."""
        self.assertGreater(len(transitions), 1)
        for one, other in zip(transitions, transitions[1:]):
            self.assertEqual(nanoseconds(other), nanoseconds(one) + DT)
            if one.terminated or one.truncated:
                self.assertEqual((other.episode, other.step), (one.episode + 1, 0))
                self.assertEqual(list(other.action), [])
                self.assertEqual((other.reward, other.episode_return), (0, 0))
            else:
                self.assertEqual((other.episode, other.step), (one.episode, one.step + 1))

    def assert_nothing_moves(self):
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        time.sleep(0.2)  # for what is under way
        self.transitions.clear()
        clock.clear()
        time.sleep(QUIET)
        self.assertEqual(self.transitions.messages(), [])
        self.assertEqual(clock.messages(), [])

    # ------------------------------------------------------------ pace

    def pace(self, wall_seconds):
        """Simulation time over wall time, measured on /clock."""
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        clock.clear()
        begin, first = time.monotonic(), clock.wait()
        time.sleep(wall_seconds)
        last = clock.messages()[-1]
        simulated = (last.clock - first.clock).to_sec()
        # What lay in buffers at the start may only have made `simulated` larger.
        return simulated / (time.monotonic() - begin), simulated

    def test_free_at_50_hz_of_real_time_is_the_default(self):
        self.serve()
        self.transitions.wait_count(100)
        self.assert_consecutive(self.transitions.messages())
        self.assertEqual(len({tuple(m.action) for m in self.transitions.messages()} - {()}), 1)
        self.assertEqual(self.driven(), [])
        factor, _ = self.pace(3)
        self.assertLess(factor, 1.1)
        self.assertGreater(factor, 0.5)
        self.assertLess(self.counter("real_time_factor"), 1.2)
        spec = self.call("get_spec").spec
        self.assertEqual((spec.mode, spec.id), ("free", "BipedalWalker-v3"))

    def test_the_real_time_factor_sets_the_pace(self):
        for factor, slowest, fastest in ((0.25, 0.1, 0.35), (5.0, 2.0, 5.5)):
            self.serve(real_time_factor=factor)
            measured, _ = self.pace(1.5)
            self.assertGreater(measured, slowest)
            self.assertLess(measured, fastest)
            self.server.stop()

    def test_real_time_factor_0_is_as_fast_as_it_goes(self):
        self.serve(real_time_factor=0.0)
        measured, _ = self.pace(1)
        self.assertGreater(measured, 10)
        reply = self.call("step", action=ZERO)  # services are served meanwhile
        self.assertFalse(reply.success)

    def test_a_run_is_the_same_at_any_pace(self):
        runs = []
        for factor in (0.0, 20.0):
            self.serve(real_time_factor=factor, seed="5", max_episode_steps=30, paused=True)
            self.call("reset", has_seed=True, seed=5)
            self.call("unpause")
            self.transitions.wait(lambda m: m.episode == 3, "the next episode")
            runs.append([m for m in self.transitions.messages() if m.episode == 2])
            self.assertEqual([m.step for m in runs[-1]], list(range(31)))
            self.server.stop()
        for one, other in zip(*runs):
            self.assertEqual(bits(one.observation), bits(other.observation))

    # ------------------------------------------------------------ resets

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
        self.assertTrue(self.call("pause").success)
        reply = self.call("step", action=ZERO)
        self.assertFalse(reply.success)
        self.assertIn("reset", reply.status_message)
        following = self.call("reset", has_seed=True, seed=3).transition
        self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)

    # ------------------------------------------------------------ pausing

    def test_a_step_is_refused_while_it_runs(self):
        self.serve()
        reply = self.call("step", action=[1.0] * 4)
        self.assertFalse(reply.success)
        self.assertIn("pause", reply.status_message)
        self.transitions.wait_count(20)
        self.assertEqual(self.driven(), [])
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
        self.assertEqual(self.transitions.at(nanoseconds(one.transition)), one.transition)
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

    # ------------------------------------------------------------ commands

    def test_a_command_is_held_in_newton_metres_until_the_next(self):
        self.serve(command_timeout=0.0, real_time_factor=2.0)
        command = self.drive(STAND)
        for efforts in ([79.3, 61.7, -55.1, 80.0], [42.0, 60.0, -80.0, 47.11], [40.0] * 4):
            command.publish(data=efforts)
            expected = bits([effort / 80 for effort in efforts])
            held = self.transitions.wait(lambda m, e=expected: bits(m.action) == e, "the command")
            later = nanoseconds(held) + 30 * DT
            self.assertEqual(bits(self.transitions.at(later).action), expected)
        self.assertEqual(self.counter("timeouts"), 0)

    def test_the_timeout_is_in_simulation_time(self):
        # Twenty steps of simulation time, at whatever pace.
        for factor in (1.0, 8.0):
            self.serve(command_timeout=0.4, real_time_factor=factor)
            self.drive(STAND)
            begun = nanoseconds(self.driven()[0])
            self.transitions.at(begun + 40 * DT)
            driven = self.driven()
            self.assert_consecutive(driven)
            self.assertIn(len(driven), (19, 20, 21))
            after = self.transitions.at(nanoseconds(driven[-1]) + DT)
            self.assertEqual(list(after.action), ZERO)
            self.server.stop()

    def test_half_a_second_is_the_default_timeout(self):
        self.serve()
        self.drive(STAND)
        self.transitions.at(nanoseconds(self.driven()[0]) + 40 * DT)
        self.assertIn(len(self.driven()), (24, 25, 26))

    def test_a_command_in_time_renews_the_timeout(self):
        self.serve(command_timeout=1.0)
        command = self.drive(STAND)
        for _ in range(8):
            time.sleep(0.2)
            command.publish(data=STAND)
        self.transitions.at(nanoseconds(self.driven()[0]) + 75 * DT)
        self.assertGreater(len(self.driven()), 70)
        self.assert_consecutive(self.driven())

    def test_the_timeout_is_in_wall_time_where_the_pace_is_free(self):
        self.serve(command_timeout=1.0, real_time_factor=0.0, max_episode_steps=0)
        begin = time.monotonic()
        self.drive(STAND)
        first = self.driven()[0]
        self.transitions.wait(
            lambda m: nanoseconds(m) > nanoseconds(first) and not any(m.action), "the timeout"
        )
        self.assertGreater(time.monotonic() - begin, 0.8)
        simulated = nanoseconds(self.driven()[-1]) - nanoseconds(first)
        self.assertGreater(simulated, 100 * DT, "that was the timeout in simulation time")
        self.assertGreater(self.counter("timeouts"), 0)

    def test_every_reset_clears_the_held_command(self):
        self.serve(command_timeout=0.0, real_time_factor=2.0)
        self.drive(STAND)
        begun = self.call("reset", has_seed=True, seed=1).transition
        self.transitions.at(nanoseconds(begun) + 20 * DT)
        for message in self.transitions.messages():
            if message.episode == begun.episode and message.step > 0:
                self.assertEqual(list(message.action), ZERO)

    def test_an_autoreset_clears_the_held_command(self):
        self.serve(command_timeout=0.0, real_time_factor=2.0, max_episode_steps=60)
        self.drive(STAND)
        driven = self.driven()[0]
        end = self.transitions.wait(
            lambda m: m.episode == driven.episode and m.truncated, "the time limit"
        )
        self.assertTrue(any(end.action), "held to the end")
        self.transitions.at(nanoseconds(end) + 20 * DT)
        following = [m for m in self.transitions.messages() if m.episode == driven.episode + 1]
        self.assertTrue(all(list(m.action) == ZERO for m in following if m.step > 0))

    def test_bad_commands_are_refused_and_counted_and_the_held_one_stays(self):
        self.serve(command_timeout=0.0)
        command = self.drive(STAND)
        bad = ([], [1.0] * 3, [1.0] * 5, [math.nan, 0, 0, 0], [0, math.inf, 0, 0])
        for count, efforts in enumerate((*bad, [0, 0, 0, -math.inf]), start=1):
            command.publish(data=efforts)
            wait_for(lambda n=count: self.counter("refused") == n, "the count")
        last = self.transitions.messages()[-1]
        self.assertEqual(bits(last.action), bits([1.0, 1.0, -1.0, 1.0]))
        output = self.server.output()
        self.assertRegex(output, r"(?i)error.*(refused|command)")

    def test_a_command_beyond_the_bounds_is_accepted_and_counted(self):
        self.serve(command_timeout=0.0)
        self.drive([240.0, 80.0, -1e6, 80.0])
        wanted = bits([3.0, 1.0, -12500.0, 1.0])
        self.transitions.wait(lambda m: bits(m.action) == wanted, "the command as given")
        self.assertGreater(self.counter("clamped"), 0)
        self.assertEqual(self.counter("refused"), 0)

    def test_the_layout_of_a_command_is_ignored(self):
        self.serve(command_timeout=0.0)
        message = Float64MultiArray(data=STAND)
        message.layout.dim = [MultiArrayDimension("nonsense", 7, 99)]
        message.layout.data_offset = 3
        self.commander().publish(message)
        self.transitions.wait(lambda m: bits(m.action) == bits([1, 1, -1, 1]), "the command")
        self.assertEqual(self.counter("refused"), 0)


if __name__ == "__main__":
    rospy.init_node("free_test")
    rostest.rosrun("walker_sim", "free_test", FreeTest, sys.argv)
