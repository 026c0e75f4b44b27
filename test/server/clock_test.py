#!/usr/bin/python3
"""Who owns /clock, what a restart continues, and whom a server without /clock follows."""

import signal
import sys
import time

import rosgraph
import rospy
import rostest
from bare_ros import BareSubscriber, wait_for
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
            self.addCleanup(second.kill)
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
            self.addCleanup(server.kill)
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
        self.addCleanup(second.kill)
        self.assert_ends_with_the_name(second, first.name)
        first.kill()
        restarted = self.serve(mode="lockstep")
        transition = restarted.client("reset", Reset)(has_seed=True, seed=1).transition
        self.assertGreater(nanoseconds(transition), last)

    def test_a_restart_after_many_quick_steps_continues_too(self):
        # Faster than any reservation of time made at the start would foresee.
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

    # ------------------------------------------------------------ use_sim_time both ways

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
            transitions.wait_count(count)  # one step for each dt of the clock
        time.sleep(0.6)  # the clock stands still, and so does the server
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
