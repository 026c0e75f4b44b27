#!/usr/bin/python3
"""Ownership of /clock, time after a restart, and servers that follow another's /clock."""

import signal
import sys
import time
import xmlrpc.client

import rosgraph
import rospy
import rostest
from bare_ros import BareSubscriber, wait_for
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Clock
from server_harness import DT, ServerProcess, ServerTest, nanoseconds
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

SECOND = 10**9


class ClockTest(ServerTest):
    def tearDown(self):
        rospy.delete_param("/use_sim_time")

    def setUp(self):
        rospy.set_param("/use_sim_time", False)

    def record_clock(self, connections=1):
        return self.record("/clock", Clock, connections)

    def assert_grows(self, stamps):
        self.assertGreater(stamps[0], 0)
        for one, other in zip(stamps, stamps[1:]):
            self.assertLess(one, other)

    # ------------------------------------------------------------ one owner

    def assert_ends_with_the_name(self, server, name):
        self.assertNotEqual(server.wait(), 0)
        self.assertIn("/clock", server.output())
        self.assertIn(name, server.output())

    def test_a_second_server_ends_with_the_name_of_the_first(self):
        for mode in ("free", "lockstep"):
            first = self.serve("/first/walker_sim", mode=mode)
            second = ServerProcess("/second/walker_sim", {"mode": mode})
            self.addCleanup(second.end)
            self.assert_ends_with_the_name(second, "/first/walker_sim")
            reset = first.client("reset", Reset)
            self.assertTrue(reset(has_seed=True, seed=1).success)
            third = self.serve("/third/walker_sim", mode=mode, publish_clock=False)
            third.stop()
            first.stop()

    def test_any_other_publisher_counts(self):
        publisher = rospy.Publisher("/clock", Clock, queue_size=1)
        try:
            server = ServerProcess("/walker_sim", {})
            self.addCleanup(server.end)
            self.assert_ends_with_the_name(server, rospy.get_name())
        finally:
            publisher.unregister()

    def test_a_publisher_that_was_killed_does_not_count(self):
        self.serve("/killed/walker_sim").kill()
        master = rosgraph.Master("/clock_test")
        publishers = dict(master.getSystemState()[0])
        self.assertIn("/killed/walker_sim", publishers["/clock"], "its registration remains")
        self.serve("/other/walker_sim")

    def test_who_joins_never_sees_time_run_backwards(self):
        server = self.serve(real_time_factor=0.0)
        uri = rosgraph.Master("/clock_test").lookupNode(server.name)
        last = 0
        for _ in range(200):
            subscriber = BareSubscriber(uri, "/clock", Clock)
            told = [subscriber.next().clock.to_nsec() for _ in range(30)]
            subscriber.close()
            self.assertGreater(told[0], 0)
            self.assertEqual(told, sorted(told))
            self.assertGreaterEqual(told[0], last)
            last = told[-1]

    # ------------------------------------------------------------ restarts

    def test_a_restarted_server_continues_above_the_last_clock(self):
        clock = self.record_clock(0)
        transitions = self.record("/transition", Transition, 0)
        for factor in (1.0, 0.0, 50.0, 0.0):
            for end in (signal.SIGINT, signal.SIGKILL, signal.SIGTERM):
                server = self.serve(real_time_factor=factor)
                had = len(clock.messages())
                clock.wait_count(had + 40)
                if end == signal.SIGKILL:
                    server.kill()
                else:
                    server.stop(end)
        time.sleep(0.3)
        self.assert_grows([nanoseconds(message) for message in transitions.messages()])
        told = [message.clock.to_nsec() for message in clock.messages()]
        self.assertEqual(told, sorted(told))

    def test_in_lockstep_a_restart_after_a_kill_continues_too(self):
        last = 0
        for seed in range(4):
            server = self.serve(mode="lockstep")
            reset, step = server.client("reset", Reset), server.client("step", Step)
            stamps = [last, nanoseconds(reset(has_seed=True, seed=seed).transition)]
            stamps += [nanoseconds(step(action=[0.0] * 4).transition) for _ in range(60)]
            self.assert_grows(stamps[1:])
            self.assertGreater(stamps[1], last)
            last = stamps[-1]
            server.kill()

    def test_a_server_that_was_refused_does_not_disturb_a_restart(self):
        first = self.serve(mode="lockstep")
        reset = first.client("reset", Reset)
        for seed in range(20):
            last = nanoseconds(reset(has_seed=True, seed=seed).transition)
        second = ServerProcess("/second/walker_sim", {"mode": "lockstep"})
        self.addCleanup(second.end)
        self.assert_ends_with_the_name(second, first.name)
        first.kill()
        restarted = self.serve(mode="lockstep")
        transition = restarted.client("reset", Reset)(has_seed=True, seed=1).transition
        self.assertGreater(nanoseconds(transition), last)

    def test_a_restart_after_many_quick_steps_continues_too(self):
        # Faster than any reservation made at the start assumes.
        last = 0
        for _ in range(3):
            server = self.serve(mode="lockstep")
            reset, step = server.client("reset", Reset), server.client("step", Step)
            first = nanoseconds(reset(has_seed=True, seed=1).transition)
            self.assertGreater(first, last)
            for _ in range(3000):
                reply = step(action=[1.0, 1.0, -1.0, 1.0])
                if not reply.success:
                    reply = reset(has_seed=True, seed=1)
                last = nanoseconds(reply.transition)
            server.kill()

    def test_it_serves_with_use_sim_time_both_ways(self):
        for use_sim_time in (True, False):
            rospy.set_param("/use_sim_time", use_sim_time)
            server = self.serve(real_time_factor=2.0)
            transitions = self.record("/transition", Transition)
            clock = self.record_clock()
            transitions.wait_count(20)
            stamps = [nanoseconds(message) for message in transitions.messages()]
            self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})
            clock.wait(lambda m, s=stamps[-1]: m.clock.to_nsec() >= s)
            server.stop()

    # ------------------------------------------------------------ following

    def start_follower(self, **parameters):
        rospy.set_param("/use_sim_time", True)
        publisher = rospy.Publisher("/clock", Clock, queue_size=1000)
        self.addCleanup(publisher.unregister)
        server = self.serve("/follower/walker_sim", publish_clock=False, **parameters)
        transitions = self.record("/follower/transition", Transition)
        self.diagnostics = self.record("/diagnostics", DiagnosticArray)
        wait_for(lambda: publisher.get_num_connections() >= 1, "the server to follow")
        return publisher, server, transitions

    @staticmethod
    def tell(publisher, nanosecond):
        publisher.publish(clock=rospy.Time(*divmod(nanosecond, SECOND)))

    def test_free_running_without_clock_of_its_own_it_follows_clock(self):
        publisher, server, transitions = self.start_follower()
        time.sleep(0.6)
        self.assertEqual(transitions.messages(), [], "it moves before there is a clock")
        now = 100 * SECOND
        self.tell(publisher, now)
        first = transitions.wait(what="a state once the clock is there")
        self.assertLessEqual(abs(nanoseconds(first) - now), 2 * DT)
        for count in range(2, 102):
            now += DT
            self.tell(publisher, now)
            transitions.wait_count(count)  # one step per dt of the clock
        time.sleep(0.6)
        stamps = [nanoseconds(message) for message in transitions.messages()]
        self.assert_grows(stamps)
        self.assertLessEqual(stamps[-1], now)
        self.assertEqual(len(stamps), 101)
        publishers = dict(rosgraph.Master("/clock_test").getSystemState()[0])
        self.assertNotIn(server.name, publishers["/clock"])

    def test_a_follower_survives_a_clock_that_jumps(self):
        publisher, _, transitions = self.start_follower()
        for now in (50 * SECOND, 1000 * SECOND, 3 * SECOND, 999 * SECOND, 2000 * SECOND):
            for i in range(10):
                self.tell(publisher, now + i * DT)
                time.sleep(0.02)
        last = 2000 * SECOND + 9 * DT
        wait_for(lambda: nanoseconds(transitions.messages()[-1]) >= last - 2 * DT, "it to follow")
        stamps = [nanoseconds(message) for message in transitions.messages()]
        self.assert_grows(stamps)
        self.assertLessEqual(stamps[-1], last)

    @staticmethod
    def wait_for_log(server, line):
        wait_for(lambda: line in server.output(), f"'{line}' in the log")

    def assert_said_once_a_second(self, server, began):
        limit = time.monotonic() - began + 1
        self.assertLessEqual(server.output().count("Nothing moves"), limit)

    def pace(self, condition, what):
        """Returns the first pace status since the last `set_clock` that meets the condition."""

        def find(message):
            told = (status for status in message.status if status.name.endswith(": pace"))
            return next(filter(condition, told), None)

        return find(self.diagnostics.wait(find, what))

    def set_clock(self, publisher, now):
        """Publishes the time, and waits for diagnostics with this stamp."""
        self.diagnostics.clear()
        self.tell(publisher, now)
        self.diagnostics.wait(lambda m: nanoseconds(m) == now, f"the time {now}")

    def assert_follows(self, publisher, transitions, now):
        """Publishes the 19 times after `now`, and waits for a step at each. Returns the last."""
        for time_ahead in range(now + DT, now + 20 * DT, DT):
            self.tell(publisher, time_ahead)
            transitions.wait(lambda m, t=time_ahead: t - DT < nanoseconds(m) <= t, "a step")
        self.assert_grows([nanoseconds(message) for message in transitions.messages()])
        self.set_clock(publisher, time_ahead)
        pace = self.pace(lambda s: s.level == DiagnosticStatus.OK, "no warning")
        self.assertEqual(pace.message, "follows /clock")
        return time_ahead

    def test_where_nobody_publishes_clock_it_says_what_to_do(self):
        rospy.set_param("/use_sim_time", True)
        began = time.monotonic()
        server = self.serve("/follower/walker_sim", publish_clock=False)
        self.diagnostics = self.record("/diagnostics", DiagnosticArray)
        advice = "start the server that publishes it, or set publish_clock = true for this one"
        waits = self.pace(lambda s: s.level == DiagnosticStatus.WARN, "a warning")
        self.assertEqual(waits.message, f"waits for /clock, which has no publisher: {advice}")
        self.wait_for_log(server, "WARN] Nothing moves: waits for /clock, which has no publisher")
        publisher = rospy.Publisher("/clock", Clock, queue_size=1000)
        self.addCleanup(publisher.unregister)
        transitions = self.record("/follower/transition", Transition)
        wait_for(lambda: publisher.get_num_connections() >= 1, "the server to follow")
        self.assert_follows(publisher, transitions, 100 * SECOND)
        publisher.unregister()
        self.diagnostics.clear()
        self.pace(lambda s: "which has no publisher" in s.message, "a warning again")
        self.assert_said_once_a_second(server, began)

    def test_a_pause_misses_no_deadline(self):
        publisher, server, transitions = self.start_follower()
        now = self.assert_follows(publisher, transitions, 100 * SECOND)
        self.call("pause")
        self.set_clock(publisher, now + 2 * SECOND)
        self.call("unpause")
        self.assert_follows(publisher, transitions, now + 2 * SECOND)
        self.assertEqual(self.counter("missed_deadlines"), 0, server.output())

    def test_an_end_that_waits_for_a_reset_misses_no_deadline(self):
        publisher, server, transitions = self.start_follower(auto_reset=False, max_episode_steps=30)
        now = self.assert_follows(publisher, transitions, 100 * SECOND)
        for _ in range(20):
            now += DT
            self.set_clock(publisher, now)
        self.assertTrue(transitions.messages()[-1].truncated)
        self.set_clock(publisher, now + 2 * SECOND)
        self.call("reset", has_seed=True, seed=1)
        self.assert_follows(publisher, transitions, now + 2 * SECOND)
        self.assertEqual(self.counter("missed_deadlines"), 0, server.output())

    def test_a_reset_before_the_first_clock_misses_no_deadline(self):
        publisher, server, transitions = self.start_follower()
        for seed in range(3):
            self.assertTrue(self.call("reset", has_seed=True, seed=seed).success)
        self.assert_follows(publisher, transitions, 1000 * SECOND)
        self.assertEqual(self.counter("missed_deadlines"), 0, server.output())

    def test_a_jump_ahead_is_a_slip_that_counts(self):
        publisher, _, transitions = self.start_follower()
        now = self.assert_follows(publisher, transitions, 100 * SECOND)
        steps = len(transitions.messages())
        self.set_clock(publisher, now + 10 * SECOND)
        late = self.pace(lambda s: s.level == DiagnosticStatus.WARN, "a warning")
        self.assertRegex(late.message, "^cannot keep up: 499 deadlines missed")
        transitions.wait(lambda m: nanoseconds(m) == now + 10 * SECOND, "one step")
        self.assertEqual(len(transitions.messages()), steps + 1)
        self.assertEqual(self.counter("missed_deadlines"), 499)
        self.assert_follows(publisher, transitions, now + 10 * SECOND)

    def test_who_ran_ahead_of_the_clock_waits_and_says_so(self):
        began = time.monotonic()
        publisher, server, transitions = self.start_follower()
        now = self.assert_follows(publisher, transitions, 100 * SECOND)
        for seed in range(50):
            ahead = nanoseconds(self.call("reset", has_seed=True, seed=seed).transition)
        self.assertEqual(ahead, now + SECOND)
        told = "waits for /clock, which is 1.00 s behind"
        waits = self.pace(lambda s: s.message == told, "how far")
        self.assertEqual(waits.level, DiagnosticStatus.WARN)
        self.wait_for_log(server, "WARN] Nothing moves: waits for /clock")
        while now < ahead:
            now += DT
            self.set_clock(publisher, now)
        self.assertEqual(nanoseconds(transitions.messages()[-1]), ahead)
        self.assert_said_once_a_second(server, began)
        self.assert_follows(publisher, transitions, now)
        self.assertEqual(self.counter("missed_deadlines"), 0)

    def test_a_clock_that_was_set_back_is_waited_for(self):
        publisher, server, transitions = self.start_follower()
        now = self.assert_follows(publisher, transitions, 100 * SECOND)
        steps = len(transitions.messages())
        for back in range(5 * SECOND, 6 * SECOND, 10 * DT):
            self.set_clock(publisher, back)
        waits = self.pace(lambda s: s.level == DiagnosticStatus.WARN, "a warning")
        self.assertRegex(
            waits.message, "^waits for /clock, which is 94.* s behind; it was set back"
        )
        self.wait_for_log(server, "start this server again")
        self.assertEqual(len(transitions.messages()), steps)
        self.assert_follows(publisher, transitions, now)
        # A restarted server follows from the present /clock.
        self.set_clock(publisher, 5 * SECOND)
        server.stop()
        publisher.unregister()
        publisher, _, transitions = self.start_follower()
        self.assert_follows(publisher, transitions, 5 * SECOND)

    def test_it_survives_the_largest_times(self):
        publisher, server, transitions = self.start_follower()
        self.assert_follows(publisher, transitions, 100 * SECOND)
        for now in (4 * 10**9 * SECOND, 2**32 * SECOND - 1):
            self.tell(publisher, now)
            transitions.wait(lambda m, t=now: t - DT < nanoseconds(m) <= t, "a step")
        wait_for(lambda: "No diagnostics at /clock" in server.output(), "the reason")
        refused = self.call("reset", has_seed=True, seed=1)
        self.assertFalse(refused.success)
        self.assertIn("the end of ROS time", refused.status_message)
        self.tell(publisher, 101 * SECOND)
        waits = self.pace(lambda s: "set back" in s.message, "what is wrong")
        self.assertEqual(waits.level, DiagnosticStatus.WARN)
        self.assertIn("waits for /clock, which is 4294967", waits.message)
        self.assert_grows([nanoseconds(message) for message in transitions.messages()])
        self.assertEqual(server.stop(), 0, server.output())

    # ------------------------------------------------------------ the end of time

    def begin_at_the_end(self):
        """Reserves all ROS time except the last 5 dt."""
        key = "/walker_sim_clock/reserved_until"
        rospy.set_param(key, [2.0**32 - 1, SECOND - 5 * DT])
        self.addCleanup(lambda: rospy.has_param(key) and rospy.delete_param(key))

    def test_at_the_end_of_time_a_step_is_refused(self):
        self.begin_at_the_end()
        server = self.serve(mode="lockstep")
        reset, step = server.client("reset", Reset), server.client("step", Step)
        stamps = [nanoseconds(reset(has_seed=True, seed=1).transition)]
        reply = step(action=[0.0] * 4)
        while reply.success:
            stamps.append(nanoseconds(reply.transition))
            reply = step(action=[0.0] * 4)
        self.assert_grows(stamps)
        self.assertLess(stamps[-1], 2**32 * SECOND)
        self.assertGreaterEqual(stamps[-1] + DT, 2**32 * SECOND)
        self.assertIn("the end of ROS time", reply.status_message)
        last = self.call("snapshot").record
        self.assertEqual(last.episode.length, len(stamps) - 1, "nothing has changed")
        self.assertFalse(reset(has_seed=True, seed=1).success)
        self.assertEqual(self.call("snapshot").record, last)
        self.assertEqual(server.stop(), 0, server.output())

    def test_at_the_end_of_time_a_free_running_server_ends_and_says_why(self):
        self.begin_at_the_end()
        server = ServerProcess("/walker_sim", {})
        self.addCleanup(server.end)
        self.assertEqual(server.wait(), 1)
        self.assertIn("the end of ROS time", server.output())

    # ------------------------------------------------------------ reserved time

    def test_a_reservation_that_is_none_ends_the_server_with_its_name(self):
        key = "/walker_sim_clock/reserved_until"
        self.addCleanup(lambda: rospy.has_param(key) and rospy.delete_param(key))
        clock = self.record_clock(connections=0)
        for value, shown in (
            ("soon", '"soon"'),
            (5, "5"),
            ([], "[]"),
            ([-1, 0], "[-1, 0]"),
            ([5, SECOND], "[5, 1000000000]"),
            ([float("nan"), 0], "[nan, 0]"),
            ([1e300, 0], "[1e+300, 0]"),
            ([True, 0], "[1, 0]"),
            ({"seconds": 5}, "{5}"),
        ):
            rospy.set_param(key, value)
            server = ServerProcess("/walker_sim", {"mode": "lockstep"})
            self.addCleanup(server.end)
            self.assertEqual(server.wait(), 1, server.output())
            self.assertIn(
                f"parameter {key} = {shown}: must be [seconds, nanoseconds], integers",
                server.output(),
            )
            rospy.delete_param(key)
        self.assertEqual(clock.messages(), [])
        # An XML-RPC type that the server does not read.
        master = rosgraph.Master("/clock_test").handle
        master.setParam("/clock_test", key, xmlrpc.client.DateTime(0))
        server = ServerProcess("/walker_sim", {"mode": "lockstep"})
        self.addCleanup(server.end)
        self.assertEqual(server.wait(), 1, server.output())
        self.assertIn(f"parameter {key}: the ROS master's answer cannot be read", server.output())
        rospy.delete_param(key)
        server = self.serve(mode="lockstep")
        self.assertTrue(server.client("reset", Reset)(has_seed=True, seed=1).success)
        server.stop()

    def test_a_reservation_of_half_of_all_time_is_obeyed_and_said(self):
        key = "/walker_sim_clock/reserved_until"
        self.addCleanup(lambda: rospy.has_param(key) and rospy.delete_param(key))
        for seconds in (2**31 - 1, 2.0**31):
            rospy.set_param(key, [seconds, 5])
            server = self.serve(mode="lockstep")
            transition = server.client("reset", Reset)(has_seed=True, seed=1).transition
            now = nanoseconds(transition) - int(seconds) * SECOND
            self.assertGreater(now, 5)
            self.assertLess(now, SECOND)
            server.stop()
            warned = "the value of the parameter " + key in server.output()
            self.assertIs(warned, seconds == 2**31)
            # On exit the server reduces the reservation to its last stamp, in a readable form.
            self.assertEqual(rospy.get_param(key), [seconds, now])

    def test_in_lockstep_without_clock_it_stamps_with_its_own_time(self):
        for use_sim_time in (True, False):
            rospy.set_param("/use_sim_time", use_sim_time)
            server = self.serve("/own/walker_sim", mode="lockstep", publish_clock=False)
            reset, step = server.client("reset", Reset), server.client("step", Step)
            stamps = [nanoseconds(reset(has_seed=True, seed=1).transition)]
            stamps += [nanoseconds(step(action=[0.0] * 4).transition) for _ in range(20)]
            self.assertGreater(stamps[0], 0)
            self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})
            publishers = dict(rosgraph.Master("/clock_test").getSystemState()[0])
            self.assertNotIn(server.name, publishers.get("/clock", []))
            server.stop()


if __name__ == "__main__":
    rospy.init_node("clock_test")
    rostest.rosrun("walker_sim", "clock_test", ClockTest, sys.argv)
