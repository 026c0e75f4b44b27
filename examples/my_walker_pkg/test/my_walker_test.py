#!/usr/bin/python3
"""The policy makes the walker walk, and a lock-step episode is reproducible."""

import subprocess
import sys
import threading
import unittest

import roslib.packages
import rospy
import rostest
from nav_msgs.msg import Odometry
from walker_sim.msg import Transition

PATIENCE = 60  # [s] wall time; only a failing test waits this long


class MyWalkerTest(unittest.TestCase):
    def wait_for(self, topic, kind, condition):
        met, found = threading.Event(), []

        def look(message):
            if not met.is_set() and condition(message):
                found.append(message)
                met.set()

        subscriber = rospy.Subscriber(topic, kind, look)
        self.assertTrue(met.wait(PATIENCE), f"{PATIENCE} s in vain on {topic}")
        subscriber.unregister()
        return found[0]

    def test_the_policy_walks(self):
        driven = self.wait_for("/my_walker/transition", Transition, lambda m: any(m.action))
        self.assertEqual(len(driven.action), 4)
        start = 4.67  # initial x of the hull [m]
        self.wait_for("/my_walker/odom", Odometry, lambda m: m.pose.pose.position.x > start + 5)

    def test_an_episode_is_the_same_each_time(self):
        program = roslib.packages.find_node("my_walker_pkg", "episode")[0]
        command = [program, "/waiting/walker_sim", rospy.get_param("~policy"), "42"]
        one, other = (subprocess.check_output(command, text=True) for _ in range(2))
        self.assertEqual(one, other)
        self.assertGreater(float(one.split()[-1]), 300)


if __name__ == "__main__":
    rospy.init_node("my_walker_test")
    rostest.rosrun("my_walker_pkg", "my_walker_test", MyWalkerTest, sys.argv)
