"""What a lock-step call wakes beside the thread that answers it, under walker.launch's settings.

Counts, because times depend on the machine: a thread that wakes at each step takes a core from the
server or its client.
"""

import os
import re

import rosgraph
import rospy
from bare_ros import wait_for_service
from node_processes import pid_of
from processes import CALLER, Launched, wait_for
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from server_harness import ServerTest
from walker_sim.msg import Episode, Transition
from walker_sim.srv import GetSpec, Reset, StepMany

SERVER = "/walker_sim"
CALLS, STEPS = 200, 100  # of ~step_many, and in each
RESETS = 500
NODES = {SERVER, "/status_line", "/agent"}  # of walker.launch


def switches(pid):
    """How often threads other than the first one have blocked and woken."""
    count = 0
    for thread in os.listdir(f"/proc/{pid}/task"):
        if int(thread) == pid:
            continue
        with open(
            f"/proc/{pid}/task/{thread}/status", encoding="ascii", errors="replace"
        ) as status:
            lines = dict(line.split(":", 1) for line in status)
        count += int(lines["voluntary_ctxt_switches"])
    return count


def followers_of_clock():
    """The nodes of walker.launch that subscribe to /clock."""
    subscribers = dict(rosgraph.Master(CALLER).getSystemState()[1])
    return NODES & set(subscribers.get("/clock", []))


class LockstepCostTest(ServerTest):
    def launch(self, *arguments):
        launched = Launched("walker.launch", "mode:=lockstep", "rviz:=false", *arguments)
        self.addCleanup(launched.stop)
        wait_for_service(f"{SERVER}/get_spec")
        self.assertIs(rospy.get_param("/use_sim_time"), True)
        return launched

    def play(self):
        """Makes CALLS calls, each of STEPS steps or until the episode ends; resets after an end.

        Returns the last state and the number of steps.
        """
        reset = rospy.ServiceProxy(f"{SERVER}/reset", Reset, persistent=True)
        step_many = rospy.ServiceProxy(f"{SERVER}/step_many", StepMany, persistent=True)
        size = rospy.ServiceProxy(f"{SERVER}/get_spec", GetSpec)().spec.action_size
        state, steps = reset(has_seed=True, seed=1).transition, 0
        for _ in range(CALLS):
            if state.terminated or state.truncated:
                state = reset(has_seed=True, seed=1).transition
            reply = step_many(action=[0.0] * size, steps=STEPS)
            self.assertTrue(reply.success, reply.status_message)
            state, steps = reply.transition, steps + reply.steps
        return state, steps

    def test_no_thread_wakes_for_a_step(self):
        self.launch("status:=false")
        pid = pid_of(SERVER)
        self.play()  # roscpp's threads have begun
        before = switches(pid)
        _, steps = self.play()
        # roscpp's threads wake by themselves, about 130 times a second.
        self.assertLess(switches(pid) - before, steps / 5)

    def test_listeners_get_the_newest_states_at_the_pace_and_all_transitions(self):
        self.launch("status:=false")
        kinds = {"/clock": Clock, "/joint_states": JointState, "/progress": Episode}
        recorders = {topic: self.record(topic, kind) for topic, kind in kinds.items()}
        state, steps = self.play()
        for topic, recorder in recorders.items():
            recorder.at(state.header.stamp.to_nsec())  # the last state is shown, too
            stamps = recorder.stamps()
            self.assertLess(len(stamps), steps / 5, topic)
            if topic != "/clock":  # a new subscriber gets the time, maybe for a second time
                self.assertEqual(len(set(stamps)), len(stamps), topic)
            self.assertEqual(stamps, sorted(stamps), topic)
        transitions = self.record("/transition", Transition)
        reset = rospy.ServiceProxy(f"{SERVER}/reset", Reset, persistent=True)
        for _ in range(RESETS):
            last = reset(has_seed=True, seed=1).transition.header.stamp
        transitions.at(last.to_nsec())
        self.assertEqual(len(transitions.messages()), RESETS)

    def test_the_nodes_of_the_launch_file_do_not_follow_clock(self):
        launched = self.launch("agent:=random", "status:=true")
        wait_for(lambda: re.search(r"episode \d+ ended", launched.output()), "the status line")
        self.assertEqual(followers_of_clock(), set())
        # The log has the simulation's time beside the wall's.
        stamped = r"\[\d+\.\d+, \d+\.\d+\]: episode \d+: "
        wait_for(lambda: re.search(stamped, launched.output()), "the agent's log")
