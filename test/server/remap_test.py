"""Effort commands on the topic of a JointGroupEffortController, by remapping."""

import threading

import rosgraph
import rospy
from processes import CALLER, wait_for
from sensor_msgs.msg import JointState
from server_harness import ServerTest, bits
from std_msgs.msg import Float64MultiArray, MultiArrayDimension
from walker_sim.msg import Transition

AGENTS = "/some_robot/leg_effort_controller/command"
BY_HAND = "/by_hand/leg_effort_controller/command"
BIPEDAL_WALKER_EFFORT = 80.0  # [N m] at action 1
WALKER2D_EFFORT = 100.0


class RemapTest(ServerTest):
    def test_topic_is_known_by_its_remapped_name_only(self):
        def are_registered():
            publishers, subscribers, _ = map(dict, rosgraph.Master(CALLER).getSystemState())
            return publishers.get(AGENTS) and subscribers.get(BY_HAND)

        wait_for(are_registered, "agent and servers")
        publishers, subscribers, _ = map(dict, rosgraph.Master(CALLER).getSystemState())
        self.assertEqual(publishers[AGENTS], ["/some_robot/agent"])
        self.assertEqual(subscribers[AGENTS], ["/some_robot/walker_sim"])
        self.assertEqual(subscribers[BY_HAND], ["/by_hand/walker_sim"])
        names = {*publishers, *subscribers}
        self.assertFalse([name for name in names if name.endswith("effort_command")])

    def test_agent_drives_the_walker(self):
        transitions = self.record("/some_robot/transition", Transition)
        commands = self.record(AGENTS, Float64MultiArray)
        joint_states = self.record("/some_robot/joint_states", JointState)
        commands.wait_count(20)
        commanded = {
            bits([effort / BIPEDAL_WALKER_EFFORT for effort in command.data])
            for command in commands.messages()[:20]
        }
        self.assertEqual(len(commanded), 20)
        transitions.wait(lambda m: bits(m.action) in commanded, "a command of the agent as action")
        joint_states.wait(lambda m: any(m.effort), "torque in the joints")

    def test_publisher_for_ros_control_drives_the_walker(self):
        efforts = [50.0, -25.0, 12.5, 50.0, -25.0, 12.5]
        command = Float64MultiArray(data=efforts)
        command.layout.dim = [MultiArrayDimension("joint", len(efforts), len(efforts))]
        command.layout.data_offset = 3  # the layout is ignored
        transitions = self.record("/by_hand/transition", Transition)
        joint_states = self.record("/by_hand/joint_states", JointState)
        publisher = rospy.Publisher(BY_HAND, Float64MultiArray, queue_size=1)
        stop = threading.Event()

        def publish():
            while not stop.wait(0.02):
                publisher.publish(command)

        thread = threading.Thread(target=publish)
        thread.start()
        try:
            expected = bits([effort / WALKER2D_EFFORT for effort in efforts])
            transitions.wait(lambda m: bits(m.action) == expected, "the command as action")
            joint_states.wait(lambda m: list(m.effort) == efforts, "the command as effort")
        finally:
            stop.set()
            thread.join()
            publisher.unregister()
