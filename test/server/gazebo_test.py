#!/usr/bin/python3
"""A client of Gazebo's services, which gazebo_test.test remaps to the server's."""

import sys
import time

import rospy
import rostest
from server_harness import DT, ServerTest, nanoseconds, same_experience
from std_srvs.srv import Empty
from walker_sim.msg import Transition

RESETS = ("reset_simulation", "reset_world")
QUIET = 0.6  # wall seconds in which 30 steps would pass


class GazeboTest(ServerTest):
    def serve(self, **parameters):
        super().serve(**parameters)
        self.transitions = self.record("/transition", Transition)

    @staticmethod
    def gazebo(service):
        rospy.ServiceProxy(f"/gazebo/{service}", Empty)()

    def state_at_rest(self):
        """Checks that nothing moves. Returns the newest transition."""
        time.sleep(0.2)  # for messages in flight
        count = len(self.transitions.messages())
        time.sleep(QUIET)
        self.assertEqual(len(self.transitions.messages()), count)
        return self.transitions.messages()[-1]

    def test_free_running_it_is_paused_unpaused_and_reset(self):
        self.serve(real_time_factor=2.0, seed="5")
        self.transitions.wait(lambda m: m.step == 10, "it to run")
        self.gazebo("pause_physics")
        before = self.state_at_rest()
        for service in RESETS:
            self.gazebo(service)
            begun = self.state_at_rest()  # a reset does not end the pause
            self.assertEqual((begun.episode, begun.step), (before.episode + 1, 0))
            self.assertEqual(nanoseconds(begun), nanoseconds(before) + DT, "time was rewound")
            self.assertFalse(same_experience(begun, before), "the same episode again")
            before = begun
        self.gazebo("unpause_physics")
        self.transitions.wait(lambda m: (m.episode, m.step) == (before.episode, 10), "it to run")
        for service in RESETS:
            self.gazebo(service)
        self.transitions.wait(lambda m: m.episode == before.episode + 2, "the resets")
        self.assert_consecutive_stamps()

    def assert_consecutive_stamps(self):
        stamps = [nanoseconds(message) for message in self.transitions.messages()]
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})

    def test_in_lockstep_it_resets_and_pausing_changes_nothing(self):
        self.serve(mode="lockstep", seed="5")
        for number, service in enumerate((*RESETS, *RESETS), start=1):
            self.gazebo(service)
            self.gazebo("pause_physics")
            reply = self.call("step", action=[0.5, -0.5, 0.25, 0.0])
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual((reply.transition.episode, reply.transition.step), (number, 1))
        self.transitions.wait_count(8)
        self.assert_consecutive_stamps()

    def test_what_is_refused_fails_and_the_server_says_why(self):
        self.serve(mode="lockstep")
        with self.assertRaises(rospy.ServiceException):
            self.gazebo("unpause_physics")
        self.assertRegex(self.server.output(), r"ERROR\] unpause_physics: .*lockstep.*~step")
        self.gazebo("reset_world")


if __name__ == "__main__":
    rospy.init_node("gazebo_test")
    rostest.rosrun("walker_sim", "gazebo_test", GazeboTest, sys.argv)
