"""Ownership of /clock, and time after a restart and at its end.

test/server/time has the unit tests of reserved time. Servers that follow another's /clock are in
clock_follower_test.py.
"""

import signal
import subprocess
import sys
import time
import xmlrpc.client

import rosgraph
import rospy
from processes import CALLER, TIMEOUT, Master, wait_for
from rosgraph_msgs.msg import Clock
from server_harness import DT, STAND, ServerTest, nanoseconds, publishers_of
from walker_sim.msg import Transition

SECOND = 10**9
RESERVED = "/walker_sim_clock/reserved_until"

# A node that starts before there is any simulation time. Its callbacks call the server while
# another thread sleeps in simulation time. It prints which of them have finished.
EARLY_NODE = """
import threading
import rospy
from rosgraph_msgs.msg import Clock
from walker_sim.msg import Transition
from walker_sim.srv import Reset, Step

rospy.init_node("early_node")
assert rospy.get_param("/use_sim_time") and rospy.Time.now().is_zero()
print("early", flush=True)
rospy.wait_for_service("/walker_sim/step")
while rospy.Time.now().is_zero():  # the server publishes the time before the first reset
    threading.Event().wait(0.01)
reset = rospy.ServiceProxy("/walker_sim/reset", Reset)
step = rospy.ServiceProxy("/walker_sim/step", Step)
finished = {name: threading.Event() for name in ("transition", "clock", "sleep")}

def sleep():
    rospy.sleep(0.4)
    finished["sleep"].set()

def on_transition(message):
    if message.step < 50:
        assert step([1.0, 1.0, -1.0, 1.0]).success
    else:
        finished["transition"].set()

def on_clock(message):
    if not finished["clock"].is_set():
        assert step([1.0, 1.0, -1.0, 1.0]).success
    if finished["transition"].is_set():
        finished["clock"].set()

threading.Thread(target=sleep, daemon=True).start()
transitions = rospy.Subscriber("/transition", Transition, on_transition)
while transitions.get_num_connections() == 0:
    threading.Event().wait(0.01)
assert reset(has_seed=True, seed=1).success
clock = rospy.Subscriber("/clock", Clock, on_clock)
for name, event in finished.items():
    print(name, "finished" if event.wait(30) else "hangs", flush=True)
"""

# A node under simulation time with a tf2 buffer that never forgets and a timer. For each line of
# input it prints "goes on" once there are a newer transform and a new tick.
TF_AND_TIMER_NODE = """
import sys
import time
import rospy
import tf2_ros

rospy.init_node("tf_and_timer_node")
buffer = tf2_ros.Buffer(rospy.Duration(10**6))
listener = tf2_ros.TransformListener(buffer)
ticks = []
timer = rospy.Timer(rospy.Duration(0.1), ticks.append)
first = None

def newest():
    exists = buffer.can_transform("odom", "hull", rospy.Time())
    return buffer.get_latest_common_time("odom", "hull") if exists else rospy.Time()

for line in sys.stdin:
    last, count, limit = newest(), len(ticks), time.monotonic() + 30
    while (newest() <= last or len(ticks) == count) and time.monotonic() < limit:
        time.sleep(0.01)
    first = first or newest()
    kept = buffer.can_transform("odom", "hull", first)
    is_fine = kept and time.monotonic() < limit
    print("goes on" if is_fine else "stopped or lost the first transform", flush=True)
"""


class ClockTest(ServerTest):
    def setUp(self):
        rospy.set_param("/use_sim_time", False)

    def tearDown(self):
        rospy.delete_param("/use_sim_time")
        if rospy.has_param(RESERVED):
            rospy.delete_param(RESERVED)

    def stamp_after_reset(self):
        return nanoseconds(self.ask("reset", has_seed=True, seed=1).transition)

    def assert_refuses_to_start(self, name, **parameters):
        server = self.start("/second/walker_sim", **parameters)
        self.assertNotEqual(server.wait(), 0)
        self.assertIn("/clock", server.output())
        self.assertIn(name, server.output())

    def test_second_owner_ends_with_the_name_of_the_first(self):
        for mode in ("free", "lockstep"):
            first = self.serve("/first/walker_sim", mode=mode)
            last = self.stamp_after_reset()
            self.assert_refuses_to_start("/first/walker_sim", mode=mode)
            self.assertGreater(self.stamp_after_reset(), last)
            self.serve("/third/walker_sim", mode=mode, publish_clock=False).stop()
            first.kill()
            self.assertIn("/first/walker_sim", publishers_of("/clock"), "its registration remains")
            self.serve("/other/walker_sim", mode=mode)
            self.assertGreater(self.stamp_after_reset(), last)
            self.server.stop()

    def test_any_other_publisher_of_clock_counts(self):
        publisher = rospy.Publisher("/clock", Clock, queue_size=1)
        try:
            self.assert_refuses_to_start(rospy.get_name())
        finally:
            publisher.unregister()

    def test_new_subscribers_never_see_time_run_backwards(self):
        self.serve(real_time_factor=0.0)
        last = 0
        for _ in range(100):
            subscriber = self.subscribe("/clock", Clock)
            stamps = [subscriber.next().clock.to_nsec() for _ in range(30)]
            subscriber.close()
            self.assertGreater(stamps[0], 0)
            self.assertEqual(stamps, sorted(stamps))
            self.assertGreaterEqual(stamps[0], last)
            last = stamps[-1]

    def test_callbacks_may_call_the_server_under_simulation_time(self):
        master = Master()  # a new one, on which there has been no /clock
        self.addCleanup(master.close)
        master.ask("setParam", "/use_sim_time", True)
        client = master.start([sys.executable, "-c", EARLY_NODE])
        wait_for(lambda: client.output() == "early\n", "the early node", process=client)
        server = self.serve(mode="lockstep", max_episode_steps=0, master_uri=master.uri)
        self.assertEqual(client.wait(2 * TIMEOUT), 0, server.output())
        lines = client.output().splitlines()[-3:]  # rospy prints lines of its own before
        self.assertEqual(lines, ["transition finished", "clock finished", "sleep finished"])
        server.stop()

    def start_tf_and_timer_node(self):
        """Returns a function that checks that the node's tf2 buffer and timer go on."""
        rospy.set_param("/use_sim_time", True)
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        node = subprocess.Popen(
            [sys.executable, "-c", TF_AND_TIMER_NODE], encoding="utf-8", **pipes
        )
        for cleanup in (node.stdout.close, node.stdin.close, node.wait, node.kill):
            self.addCleanup(cleanup)

        def assert_they_go_on():
            print(file=node.stdin, flush=True)
            # A warning of tf2 or an exception of the timer would be read instead.
            self.assertEqual(node.stdout.readline(), "goes on\n")

        return assert_they_go_on

    def test_time_never_rewinds_over_resets_and_restarts(self):
        clock = self.record("/clock", Clock, waits=False)
        transitions = self.record("/transition", Transition, waits=False)
        assert_tf_and_timer_go_on = self.start_tf_and_timer_node()
        for factor in (5.0, 0.0):
            for end in (signal.SIGINT, signal.SIGKILL, signal.SIGTERM):
                server = self.serve(real_time_factor=factor, max_episode_steps=20)
                clock.wait_count(len(clock.messages()) + 40)  # over an autoreset
                for _ in range(3):
                    self.call("reset", has_seed=True, seed=1)
                    assert_tf_and_timer_go_on()
                if end == signal.SIGKILL:
                    server.kill()
                else:
                    server.stop(end)
        time.sleep(0.3)
        self.assert_grows(transitions.stamps())
        stamps = clock.stamps()
        self.assertEqual(stamps, sorted(stamps))

    def test_restart_after_a_kill_amid_fast_steps_continues_too(self):
        # Faster than any reservation made at the start assumes.
        last = 0
        for _ in range(3):
            server = self.serve(mode="lockstep", max_episode_steps=0)
            first = self.stamp_after_reset()
            self.assertGreater(first, last)
            step = server.client("step")
            for _ in range(3000):
                last = nanoseconds(step(action=STAND).transition)
            self.assertEqual(last, first + 3000 * DT)
            server.kill()

    def test_serves_with_use_sim_time_both_ways(self):
        for use_sim_time in (True, False):
            rospy.set_param("/use_sim_time", use_sim_time)
            server = self.serve(real_time_factor=4.0)
            transitions = self.record("/transition", Transition)
            clock = self.record("/clock", Clock)
            transitions.wait_count(20)
            self.assert_consecutive(transitions.messages())
            last = nanoseconds(transitions.messages()[-1])
            clock.wait(lambda m, s=last: m.clock.to_nsec() >= s)
            server.stop()
            self.serve("/own/walker_sim", mode="lockstep", publish_clock=False)
            stamps = [self.stamp_after_reset() for _ in range(20)]
            self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})
            self.assertNotIn("/own/walker_sim", publishers_of("/clock"))
            self.server.stop()

    def test_step_is_refused_at_the_end_of_ros_time(self):
        rospy.set_param(RESERVED, [2.0**32 - 1, SECOND - 5 * DT])
        server = self.serve(mode="lockstep")
        reset, step = server.client("reset"), server.client("step")
        stamps = [nanoseconds(reset(has_seed=True, seed=1).transition)]
        reply = step(action=STAND)
        while reply.success:
            stamps.append(nanoseconds(reply.transition))
            reply = step(action=STAND)
        self.assert_grows(stamps)
        self.assertLess(stamps[-1], 2**32 * SECOND)
        self.assertGreaterEqual(stamps[-1] + DT, 2**32 * SECOND)
        self.assertIn("the end of ROS time", reply.status_message)
        last = self.call("snapshot").record
        self.assertEqual(last.episode.length, len(stamps) - 1, "nothing has changed")
        self.assertFalse(reset(has_seed=True, seed=1).success)
        self.assertEqual(self.call("snapshot").record, last)
        self.assertEqual(server.stop(), 0, server.output())

    def assert_fails_at_the_start(self, words, **parameters):
        server = self.start("/walker_sim", **parameters)
        self.assertEqual(server.wait(), 1)
        self.assertIn(words, server.output())

    def test_free_running_server_ends_at_the_end_of_ros_time(self):
        rospy.set_param(RESERVED, [2.0**32 - 1, SECOND - 5 * DT])
        self.assert_fails_at_the_start("the end of ROS time")

    def test_invalid_reservation_ends_the_server_with_its_name(self):
        clock = self.record("/clock", Clock, waits=False)
        for value, words in (
            ([5, SECOND], " = [5, 1000000000]: must be [seconds, nanoseconds], integers"),
            # An XML-RPC type that the server does not read.
            (xmlrpc.client.DateTime(0), ": the ROS master's answer cannot be read"),
        ):
            rosgraph.Master(CALLER).handle.setParam(CALLER, RESERVED, value)
            self.assert_fails_at_the_start(f"parameter {RESERVED}{words}", mode="lockstep")
        self.assertEqual(clock.messages(), [])

    def test_large_reservation_is_obeyed_and_logged(self):
        for seconds in (2**31 - 1, 2.0**31):
            rospy.set_param(RESERVED, [seconds, 5])
            server = self.serve(mode="lockstep")
            now = self.stamp_after_reset() - int(seconds) * SECOND
            self.assertGreater(now, 5)
            self.assertLess(now, SECOND)
            server.stop()
            is_logged = f"the value of the parameter {RESERVED}" in server.output()
            self.assertIs(is_logged, seconds == 2**31)
            # On exit the server reduces the reservation to its last stamp, in a readable form.
            self.assertEqual(rospy.get_param(RESERVED), [seconds, now])
