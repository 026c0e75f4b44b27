"""Servers that follow another's /clock, with a publisher of /clock in this process.

test/server/time has the unit tests of following.
"""

import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from processes import wait_for
from rosgraph_msgs.msg import Clock
from server_harness import DT, ServerTest, nanoseconds, publishers_of, statuses
from walker_sim.msg import Transition

SECOND = 10**9


class ClockFollowerTest(ServerTest):
    def tearDown(self):
        rospy.delete_param("/use_sim_time")

    def start_follower(self, **parameters):
        rospy.set_param("/use_sim_time", True)
        self.serve("/follower/walker_sim", publish_clock=False, **parameters)
        self.transitions = self.record("/follower/transition", Transition)
        self.diagnostics = self.record("/diagnostics", DiagnosticArray)

    def start_publisher(self):
        self.publisher = rospy.Publisher("/clock", Clock, queue_size=1000)
        self.addCleanup(self.publisher.unregister)
        wait_for(self.publisher.get_num_connections, "the server to follow")

    def publish(self, nanosecond):
        self.publisher.publish(clock=rospy.Time(*divmod(nanosecond, SECOND)))

    def set_clock(self, now):
        """Publishes the time, and waits for diagnostics with this stamp."""
        self.diagnostics.clear()
        self.publish(now)
        self.diagnostics.wait(lambda m: nanoseconds(m) == now, f"the time {now}")

    def pace(self, condition, what):
        """Returns the first pace status since the last `set_clock` that meets the condition."""

        def find(message):
            return next(filter(condition, statuses(message, "pace")), None)

        return find(self.diagnostics.wait(find, what))

    def assert_follows(self, now):
        """Publishes the 19 times after `now`, and waits for a step at each. Returns the last."""
        for time_ahead in range(now + DT, now + 20 * DT, DT):
            self.publish(time_ahead)
            self.transitions.wait(lambda m, t=time_ahead: t - DT < nanoseconds(m) <= t, "a step")
        self.assert_grows(self.transitions.stamps())
        self.set_clock(time_ahead)
        pace = self.pace(lambda s: s.level == DiagnosticStatus.OK, "no warning")
        self.assertEqual(pace.message, "follows /clock")
        return time_ahead

    def test_follower_steps_once_per_dt_of_the_clock(self):
        begin = time.monotonic()
        self.start_follower()
        advice = "start the server that publishes it, or set publish_clock = true for this one"
        words = "waits for /clock, which has no publisher"
        warning = self.pace(lambda s: s.level == DiagnosticStatus.WARN, "a warning")
        self.assertEqual(warning.message, f"{words}: {advice}")
        wait_for(lambda: f"WARN] Nothing moves: {words}" in self.server.output(), "the log")
        limit = time.monotonic() - begin + 1
        self.assertLessEqual(self.server.output().count("Nothing moves"), limit, "once a second")
        self.assertEqual(self.transitions.messages(), [])
        self.start_publisher()
        now = 100 * SECOND
        self.publish(now)
        first = self.transitions.wait(what="a state once there is a clock")
        self.assertLessEqual(abs(nanoseconds(first) - now), 2 * DT)
        for count in range(2, 102):
            now += DT
            self.publish(now)
            self.transitions.wait_count(count)
        time.sleep(0.3)
        stamps = self.transitions.stamps()
        self.assert_grows(stamps)
        self.assertLessEqual(stamps[-1], now)
        self.assertEqual(len(stamps), 101)
        self.assertNotIn(self.server.name, publishers_of("/clock"))

    def test_pauses_and_resets_miss_no_deadline(self):
        self.start_follower(auto_reset=False, max_episode_steps=50)
        self.start_publisher()
        self.ask("reset", has_seed=True, seed=1)
        now = self.assert_follows(1000 * SECOND)
        self.call("pause")
        self.set_clock(now + 2 * SECOND)
        self.call("unpause")
        now = self.assert_follows(now + 2 * SECOND)
        for _ in range(20):
            now += DT
            self.set_clock(now)
        self.assertTrue(self.transitions.messages()[-1].truncated)
        self.set_clock(now + 2 * SECOND)
        self.call("reset", has_seed=True, seed=1)
        self.assert_follows(now + 2 * SECOND)
        self.assertEqual(self.counter("missed_deadlines"), 0, self.server.output())

    def test_clock_may_jump(self):
        self.start_follower()
        self.start_publisher()
        now = self.assert_follows(100 * SECOND)
        steps = len(self.transitions.messages())
        self.set_clock(now + 10 * SECOND)
        late = self.pace(lambda s: s.level == DiagnosticStatus.WARN, "a warning")
        self.assertRegex(late.message, "^cannot keep up: 499 deadlines missed")
        self.transitions.wait(lambda m: nanoseconds(m) == now + 10 * SECOND, "one step")
        self.assertEqual(len(self.transitions.messages()), steps + 1)
        self.assertEqual(self.counter("missed_deadlines"), 499)
        self.assert_follows(now + 10 * SECOND)
        # A restarted server follows from the present /clock.
        self.set_clock(5 * SECOND)
        self.server.stop()
        self.publisher.unregister()
        self.start_follower()
        self.start_publisher()
        self.assert_follows(5 * SECOND)

    def test_follower_survives_the_largest_times(self):
        self.start_follower()
        self.start_publisher()
        self.assert_follows(100 * SECOND)
        for now in (4 * 10**9 * SECOND, 2**32 * SECOND - 1):
            self.publish(now)
            self.transitions.wait(lambda m, t=now: t - DT < nanoseconds(m) <= t, "a step")
        wait_for(lambda: "No diagnostics at /clock" in self.server.output(), "the reason")
        refused = self.call("reset", has_seed=True, seed=1)
        self.assertFalse(refused.success)
        self.assertIn("the end of ROS time", refused.status_message)
        self.publish(101 * SECOND)
        waits = self.pace(lambda s: "set back" in s.message, "what is wrong")
        self.assertEqual(waits.level, DiagnosticStatus.WARN)
        self.assertIn("waits for /clock, which is 4294967", waits.message)
        self.assert_grows(self.transitions.stamps())
        self.assertEqual(self.server.stop(), 0, self.server.output())
