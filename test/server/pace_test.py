"""The pace of a free-running server: real-time factor, missed deadlines, floods of calls."""

import time

import rospy
from processes import wait_for
from server_harness import DT, TransitionsTest, nanoseconds

ZERO = [0.0] * 4


class PaceTest(TransitionsTest):
    def simulation_time(self):
        """Current simulation time [ns]."""
        return nanoseconds(self.call("snapshot").record.episode)

    def pace(self, wall_seconds):
        """Lower bound of simulation time per wall time."""
        begin, first = time.monotonic(), self.simulation_time()
        time.sleep(wall_seconds)
        simulated = (self.simulation_time() - first) / 1e9
        return simulated / (time.monotonic() - begin)

    def test_default_is_free_running_in_real_time(self):
        self.serve(diagnostic_period=0.5)  # the server averages the pace over it
        self.transitions.wait_count(50)
        self.assert_consecutive(self.transitions.messages())
        self.assertFalse(any(any(m.action) for m in self.transitions.messages()), "zero torque")
        factor = self.pace(1.5)
        self.assertLess(factor, 1.1)
        self.assertGreater(factor, 0.5)
        self.assertLess(self.counter("real_time_factor"), 1.2)
        spec = self.call("get_spec").spec
        self.assertEqual((spec.mode, spec.id), ("free", "BipedalWalker-v3"))

    def test_real_time_factor_may_change_while_running(self):
        self.serve()
        measured = {}
        for factor in (4.0, 1.0, 0.0, 0.25, 4.0):
            reply = self.call("set_real_time_factor", factor=factor)
            self.assertEqual((reply.success, reply.status_message), (True, ""))
            paces = measured.setdefault(factor, [])
            paces.append(self.pace(1))
            if factor:
                self.assertLess(paces[-1], 1.15 * factor)
        # Compared within one run, because the machine may be busy.
        for slower, faster in ((0.25, 1.0), (1.0, 4.0), (4.0, 0.0)):
            self.assertGreater(min(measured[faster]), 1.3 * max(measured[slower]), measured)
        self.assertGreater(min(measured[0.0]), 10, "unlimited")

    def test_follower_of_a_clock_refuses_a_real_time_factor(self):
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

    def test_missed_steps_are_not_made_up_for(self):
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

    def test_overloaded_server_drops_deadlines(self):
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
        while time.monotonic() < begin + 1:
            disturb()
            calls += 1
        steps = self.assert_no_burst(first, begin)
        self.assertGreater(calls, 50)
        self.assertGreater(steps, 0.25 * (time.monotonic() - begin) * 1e9 / DT)

    def test_flood_of_calls_delays_no_step(self):
        self.serve()
        for service, fields in (
            ("get_spec", {}),
            ("unpause", {}),
            ("set_real_time_factor", {"factor": 1.0}),
            ("step", {"action": ZERO}),  # refused
        ):
            client = self.server.client(service)
            self.assert_steps_go_on(lambda call=client, fields=fields: call(**fields))
            client.close()

    def test_flood_of_commands_delays_no_step(self):
        self.serve()
        command = self.commander()

        def disturb():
            command.publish(data=ZERO)
            time.sleep(0.0002)

        self.assert_steps_go_on(disturb)
