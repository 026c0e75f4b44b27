"""A client of Gazebo's services, which gazebo_test.test remaps to the server's."""

import math
import time

import rospy
from gazebo_messages import GetPhysicsProperties, SetPhysicsProperties
from processes import wait_for
from sensor_msgs.msg import JointState
from server_harness import DT, TransitionsTest, nanoseconds, same_experience
from std_srvs.srv import Empty

QUIET = 0.6  # wall seconds in which 30 steps would pass
RESETS = ("reset_simulation", "reset_world")
# The properties that openai_ros' GazeboConnection sets at the start of every simulation.
OPENAI_ROS = {
    "time_step": 0.001,
    "max_update_rate": 1000.0,
    "gravity": (0.0, 0.0, -9.81),
    "ode": {
        "sor_pgs_iters": 50,
        "sor_pgs_w": 1.3,
        "contact_surface_layer": 0.001,
        "erp": 0.2,
        "max_contacts": 20,
    },
}


class GazeboTest(TransitionsTest):
    @staticmethod
    def empty(service):
        rospy.wait_for_service(f"/gazebo/{service}", timeout=30)
        rospy.ServiceProxy(f"/gazebo/{service}", Empty)()

    @staticmethod
    def get():
        return rospy.ServiceProxy("/gazebo/get_physics_properties", GetPhysicsProperties)()

    @staticmethod
    def set(time_step, max_update_rate, gravity, ode=None):
        request = SetPhysicsProperties._request_class()
        request.time_step, request.max_update_rate = time_step, max_update_rate
        request.gravity.x, request.gravity.y, request.gravity.z = gravity
        for name, value in (ode or {}).items():
            assert hasattr(request.ode_config, name), name
            setattr(request.ode_config, name, value)
        proxy = rospy.ServiceProxy("/gazebo/set_physics_properties", SetPhysicsProperties)
        return proxy(request)

    def state_at_rest(self):
        """Checks that nothing moves. Returns the newest transition."""
        time.sleep(0.2)  # for messages in flight
        count = len(self.transitions.messages())
        time.sleep(QUIET)
        self.assertEqual(len(self.transitions.messages()), count)
        return self.transitions.messages()[-1]

    def test_free_running_server_is_paused_and_reset(self):
        self.serve(real_time_factor=2.0, seed="5")
        self.transitions.wait(lambda m: m.step == 10, "a running simulation")
        self.empty("pause_physics")
        before = self.state_at_rest()
        for service in RESETS:
            self.empty(service)
            begun = self.state_at_rest()  # a reset does not end the pause
            self.assertEqual((begun.episode, begun.step), (before.episode + 1, 0))
            self.assertEqual(nanoseconds(begun), nanoseconds(before) + DT, "time grows")
            self.assertFalse(same_experience(begun, before), "the same episode again")
            before = begun
        self.empty("unpause_physics")
        self.transitions.wait(
            lambda m: (m.episode, m.step) == (before.episode, 10), "a running simulation"
        )
        for service in RESETS:
            self.empty(service)
        self.transitions.wait(lambda m: m.episode == before.episode + 2, "the resets")
        self.assert_consecutive_stamps()

    def assert_consecutive_stamps(self):
        stamps = self.transitions.stamps()
        self.assertEqual({b - a for a, b in zip(stamps, stamps[1:])}, {DT})

    def test_lockstep_resets_and_ignores_pauses(self):
        self.serve(mode="lockstep", seed="5")
        for number, service in enumerate((*RESETS, *RESETS), start=1):
            self.empty(service)
            self.empty("pause_physics")
            reply = self.ask("step", action=[0.5, -0.5, 0.25, 0.0])
            self.assertEqual((reply.transition.episode, reply.transition.step), (number, 1))
        self.transitions.wait_count(8)
        self.assert_consecutive_stamps()

    def test_refused_call_fails_and_the_server_logs_why(self):
        self.serve(mode="lockstep")
        with self.assertRaises(rospy.ServiceException):
            self.empty("unpause_physics")
        self.assertRegex(self.server.output(), r"ERROR\] unpause_physics: .*lockstep.*~step")
        self.empty("reset_world")

    def properties(self):
        reply = self.get()
        self.assertTrue(reply.success, reply.status_message)
        gravity = (reply.gravity.x, reply.gravity.y, reply.gravity.z)
        return reply.time_step, reply.max_update_rate, gravity

    def assert_refused(self, reply, words):
        self.assertFalse(reply.success)
        self.assertRegex(reply.status_message, words)

    def test_properties_have_step_pace_pause_and_gravity(self):
        self.serve(real_time_factor=0.5, paused=True)
        self.assertEqual(self.properties(), (0.02, 25.0, (0.0, 0.0, -10.0)))
        self.assertTrue(self.get().pause)
        self.call("unpause")
        self.assertFalse(self.get().pause)
        self.assertEqual(self.get().ode_config, type(self.get().ode_config)(), "zeros")
        self.assertEqual(
            self.get().status_message, "ode_config is ignored: the engine is Box2D, not ODE"
        )
        self.serve(env="Walker2d-v5", real_time_factor=0.0)
        self.assertEqual(self.properties(), (0.008, 0.0, (0.0, 0.0, -9.81)))
        self.serve(mode="lockstep")
        self.assertEqual(self.properties()[:2], (0.02, 0.0))
        self.assertTrue(self.get().pause, "lock-step counts as paused")

    def test_custom_model_has_its_own_gravity(self):
        model = self.model_file(("<option ", '<option gravity="0.5 0 -3.7" '))
        self.serve(env="Walker2d-v5", xml_file=model, frame_skip=3)
        time_step, rate, gravity = self.properties()
        self.assertAlmostEqual(time_step, 0.006, places=12)
        self.assertEqual(gravity, (0.5, 0.0, -3.7))
        self.assertTrue(self.set(0.006, rate, gravity).success)
        self.assert_refused(
            self.set(0.006, rate, (0, 0, -9.81)),
            r"^gravity = \[0, 0, -9.81\] m/s\^2; must be \[0.5, 0, -3.7\], that of Walker2d-v5$",
        )

    def test_update_rate_sets_the_pace(self):
        self.serve()
        gravity = (0.0, 0.0, -10.0)
        for rate, factor in ((100.0, 2.0), (0.0, 0.0), (25.0, 0.5)):
            reply = self.set(0.02, rate, gravity)
            self.assertTrue(reply.success, reply.status_message)
            self.assertEqual(self.properties(), (0.02, rate, gravity))
            self.assertEqual(self.counter("real_time_factor_wanted"), factor)
        self.call("set_real_time_factor", factor=4.0)
        self.assertEqual(self.properties()[1], 200.0)

    def test_gravity_is_that_of_the_world(self):
        self.serve(mode="lockstep", world="moon")
        self.assertEqual(self.properties()[2], (0.0, 0.0, -10.0), "before the first reset")
        self.call("reset")
        self.assertEqual(self.properties()[2], (0.0, 0.0, -1.62))
        self.assertTrue(self.set(0.02, 0.0, (0, 0, -1.62)).success)
        self.assert_refused(self.set(0.02, 0.0, (0, 0, -10)), "must be .0, 0, -1.62.")

    def test_unsupported_properties_are_refused_by_name(self):
        self.serve()
        gravity = (0.0, 0.0, -10.0)
        before = self.properties()
        step = r"^time_step = 0.001 s; must be 0.02, a step of BipedalWalker-v3"
        fall = r"gravity = \[0, 0, -9.81\] m/s\^2; must be \[0, 0, -10\], that of BipedalWalker-v3$"
        self.assert_refused(self.set(0.001, 100, gravity), step + "$")
        self.assert_refused(self.set(math.nan, 100, gravity), "^time_step = nan s; must be 0.02")
        self.assert_refused(self.set(0.02, 100, (0, 0, -9.81)), "^" + fall)
        self.assert_refused(self.set(0.02, 100, (0, math.nan, -10)), "^gravity = .0, nan, -10.")
        self.assert_refused(self.set(0.001, 100, (0, 0, -9.81)), step + "; " + fall)
        for rate in (-1.0, 1e6, math.inf, math.nan):
            words = f"^max_update_rate = {rate:.0f} Hz.*real_time_factor.*1000"
            self.assert_refused(self.set(0.02, rate, gravity), words)
        self.assertEqual(self.properties(), before)
        self.assertIn("set_physics_properties: time_step = 0.001 s; must", self.server.output())

    def test_lockstep_has_no_update_rate(self):
        self.serve(mode="lockstep")
        reply = self.set(0.02, 50.0, (0.0, 0.0, -10.0))
        self.assert_refused(reply, "^max_update_rate = 50 Hz.*lockstep.*~step")
        self.assertTrue(self.set(0.02, 0.0, (0.0, 0.0, -10.0)).success)

    def test_openai_ros_connects_resets_and_steps(self):
        """Calls, types and order are those of openai_ros' GazeboConnection and RobotGazeboEnv."""
        self.serve()
        effort = self.commander()
        for reset in RESETS:
            before = self.transitions.wait(what="a running simulation").episode
            rospy.wait_for_service("/gazebo/set_physics_properties", timeout=30)
            self.empty(reset)
            self.empty("pause_physics")
            self.assert_refused(self.set(**OPENAI_ROS), "time_step.*gravity")  # openai_ros goes on
            self.empty("unpause_physics")
            self.transitions.wait(lambda m, n=before: m.episode > n and m.step > 5, "a new episode")
            self.empty("pause_physics")
            self.assertTrue(self.get().pause)
            for torque in (20.0, -20.0, 40.0):  # RobotGazeboEnv's step
                self.empty("unpause_physics")

                def is_held(torque=torque):
                    effort.publish(data=[torque] * 4)  # again: the reset after a fall clears it
                    return list(self.transitions.messages()[-1].action) == [torque / 80] * 4

                wait_for(is_held, "the effort to be held")
                rospy.wait_for_message("/joint_states", JointState, timeout=30)
                self.empty("pause_physics")
            self.state_at_rest()
            self.transitions.clear()
            self.empty("unpause_physics")
