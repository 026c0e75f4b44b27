#!/usr/bin/python3
"""The pace of a free-running server: real-time factor, missed deadlines, floods of calls."""

import math
import sys
import time

import rospy
import rostest
from bare_ros import wait_for
from server_harness import DT, SERVICES, ServerTest, nanoseconds
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger
from walker_sim.msg import Transition

ZERO = [0.0] * 4


class PaceTest(ServerTest):
    def serve(self, **parameters):
        super().serve(**parameters)
        self.transitions = self.record("/transition", Transition)

    def simulation_time(self):
        """Current simulation time [ns]."""
        return nanoseconds(self.call("snapshot").record.episode)

    def pace(self, wall_seconds):
        """Lower bound of simulation time per wall time."""
        begin, first = time.monotonic(), self.simulation_time()
        time.sleep(wall_seconds)
        simulated = (self.simulation_time() - first) / 1e9
        return simulated / (time.monotonic() - begin)

    def test_free_at_50_hz_of_real_time_is_the_default(self):
        self.serve(diagnostic_period=1.0)  # the server averages the pace over it
        self.transitions.wait_count(100)
        self.assert_consecutive(self.transitions.messages())
        self.assertFalse(any(any(m.action) for m in self.transitions.messages()), "zero torque")
        factor = self.pace(2)
        self.assertLess(factor, 1.1)
        self.assertGreater(factor, 0.5)
        self.assertLess(self.counter("real_time_factor"), 1.2)
        spec = self.call("get_spec").spec
        self.assertEqual((spec.mode, spec.id), ("free", "BipedalWalker-v3"))

    def test_the_real_time_factor_sets_the_pace(self):
        for factor, slowest, fastest in ((0.25, 0.1, 0.35), (5.0, 2.0, 5.5)):
            self.serve(real_time_factor=factor)
            measured = self.pace(1.5)
            self.assertGreater(measured, slowest)
            self.assertLess(measured, fastest)
            self.server.stop()

    def test_the_real_time_factor_changes_while_it_runs(self):
        self.serve()
        measured = {}
        for factor in (4.0, 1.0, 0.0, 0.25, 4.0, 0.0, 1.0):
            reply = self.call("set_real_time_factor", factor=factor)
            self.assertEqual((reply.success, reply.status_message), (True, ""))
            paces = measured.setdefault(factor, [])
            paces.append(self.pace(1.5))
            if factor:
                self.assertLess(paces[-1], 1.15 * factor)
        # Compared within one run, because the machine may be busy.
        for slower, faster in ((0.25, 1.0), (1.0, 4.0), (4.0, 0.0)):
            self.assertGreater(min(measured[faster]), 1.3 * max(measured[slower]), measured)

    def test_a_new_real_time_factor_holds_where_it_stands_still(self):
        self.serve(paused=True)
        self.assertTrue(self.call("set_real_time_factor", factor=5.0).success)
        self.transitions.clear()
        time.sleep(0.5)
        self.assertEqual(self.transitions.messages(), [])
        self.call("unpause")
        self.assertGreater(self.pace(1.5), 1.3)
        self.call("pause")
        self.assertTrue(self.call("set_real_time_factor", factor=0.25).success)
        self.call("unpause")
        self.assertLess(self.pace(1.5), 0.35)

    def test_real_time_factors_that_cannot_be_are_refused(self):
        self.serve(real_time_factor=2.0)
        for factor, words in (
            (-1.0, "-1"),
            (-1e-300, "-1.0e-300"),
            (1000.5, "1000.5"),
            (math.inf, "inf"),
            (math.nan, "nan"),
        ):
            reply = self.call("set_real_time_factor", factor=factor)
            self.assertFalse(reply.success)
            for word in ("real_time_factor", words, "[0.0, 1000.0]"):
                self.assertIn(word, reply.status_message)
            self.assertEqual(self.counter("real_time_factor_wanted"), 2)
        for factor in (1000.0, 1e-300, 2.0):  # the bounds, then the initial value
            self.assertTrue(self.call("set_real_time_factor", factor=factor).success)
        self.transitions.clear()
        self.transitions.wait_count(20)

    def test_in_lockstep_there_is_no_pace_to_set(self):
        self.serve(mode="lockstep")
        reply = self.call("set_real_time_factor", factor=2.0)
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, "lockstep.*~step")

    def test_who_follows_a_clock_has_no_pace_to_set(self):
        rospy.set_param("/use_sim_time", True)
        self.addCleanup(rospy.delete_param, "/use_sim_time")
        self.serve(publish_clock=False)
        reply = self.call("set_real_time_factor", factor=2.0)
        self.assertFalse(reply.success)
        self.assertIn("/clock", reply.status_message)

    def assert_no_burst(self, first, begin):
        """Checks that there were no more steps than the schedule allows. Returns their number.

        @param first: simulation time [ns] at `begin` or later
        """
        steps = (self.simulation_time() - first) // DT
        elapsed = time.monotonic() - begin
        # One step may be due at the beginning, and one may come a period early.
        self.assertLessEqual(steps, elapsed * 1e9 / DT + 2)
        return steps

    def test_a_stall_is_not_made_up_for(self):
        self.serve()
        self.transitions.wait_count(20)
        missed = self.counter("missed_deadlines")
        with self.server.halted():
            stopped = time.monotonic()
            time.sleep(1)
            before = nanoseconds(self.transitions.messages()[-1])
            begin = time.monotonic()
            stall = begin - stopped
        for _ in range(5):
            time.sleep(0.1)
            self.assert_no_burst(before, begin)
        self.transitions.wait(lambda m: nanoseconds(m) > before + 10 * DT, "it to go on")
        self.assertGreaterEqual(self.counter("missed_deadlines") - missed, stall / 0.02 - 2)
        self.assert_consecutive(self.transitions.messages())

    def test_what_the_machine_cannot_do_slips(self):
        self.serve(real_time_factor=1000.0)
        wait_for(lambda: self.counter("missed_deadlines") > 0, "missed deadlines")
        self.transitions.wait_count(1000)
        # The subscriber may miss some, but simulation time advances by dt per step.
        for one, other in zip(self.transitions.messages(), self.transitions.messages()[1:]):
            elapsed = nanoseconds(other) - nanoseconds(one)
            self.assertGreater(elapsed, 0)
            self.assertEqual(elapsed % DT, 0)
            if one.episode == other.episode:
                self.assertEqual(elapsed, (other.step - one.step) * DT)
        # An overloaded server runs as fast as it can: a slip costs at most a period.
        overloaded = self.pace(1)
        self.call("set_real_time_factor", factor=0.0)
        self.assertGreater(overloaded, 0.2 * self.pace(1))

    def assert_steps_go_on(self, disturb):
        """Checks that calling `disturb` in a loop neither delays nor adds steps."""
        begin, first = time.monotonic(), self.simulation_time()
        calls = 0
        while time.monotonic() < begin + 1.5:
            disturb()
            calls += 1
        steps = self.assert_no_burst(first, begin)
        self.assertGreater(calls, 75, "that is no flood")
        self.assertGreater(steps, 0.25 * (time.monotonic() - begin) * 1e9 / DT)

    def test_a_flood_of_calls_holds_up_no_step(self):
        self.serve()
        for service, fields in (
            ("get_spec", {}),
            ("unpause", {}),
            ("set_real_time_factor", {"factor": 1.0}),
            ("step", {"action": ZERO}),  # refused
        ):
            client = self.server.client(service, SERVICES.get(service, Trigger))
            self.assert_steps_go_on(lambda call=client, fields=fields: call(**fields))
            client.close()

    def test_a_flood_of_commands_holds_up_no_step(self):
        self.serve()
        command = rospy.Publisher("/effort_command", Float64MultiArray, queue_size=100)
        self.addCleanup(command.unregister)
        wait_for(lambda: command.get_num_connections() >= 1, "the server to listen")

        def disturb():
            command.publish(data=ZERO)
            time.sleep(0.0002)

        self.assert_steps_go_on(disturb)

    def test_real_time_factor_0_is_as_fast_as_it_goes(self):
        self.serve(real_time_factor=0.0)
        measured = self.pace(1)
        self.assertGreater(measured, 10)
        reply = self.call("step", action=ZERO)  # services still answer
        self.assertFalse(reply.success)


if __name__ == "__main__":
    rospy.init_node("pace_test")
    rostest.rosrun("walker_sim", "pace_test", PaceTest, sys.argv)
