"""Pushes by hand over ROS: both modes, what records and diagnostics have of them, refusals."""

import math
import os
import tempfile
import time

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from node_processes import run_program
from processes import LoggedProcess, wait_for
from server_harness import ServerTest, same_experience, statuses
from std_msgs.msg import Header
from walker_sim.msg import EpisodeRecord, Transition

SIZES = {"BipedalWalker-v3": 4, "Walker2d-v5": 6, "Hopper-v5": 3}
TRUNKS = {"BipedalWalker-v3": "hull", "Walker2d-v5": "torso", "Hopper-v5": "torso"}
LIMBS = {"BipedalWalker-v3": "lower_leg_1", "Walker2d-v5": "foot_left", "Hopper-v5": "foot"}


def wrench(link, x=0.0, z=0.0, torque=0.0):
    header = Header(frame_id=link)
    return WrenchStamped(header, Wrench(Vector3(x, 0.0, z), Vector3(0.0, torque, 0.0)))


class PushTest(ServerTest):
    def serve(self, **parameters):
        if hasattr(self, "pusher"):
            self.pusher.unregister()  # rospy counts a connection to a stopped server for a while
        super().serve(**parameters)
        self.diagnostics = self.record("/diagnostics", DiagnosticArray)
        self.pusher = rospy.Publisher("/push", WrenchStamped, queue_size=100)
        wait_for(lambda: self.pusher.get_num_connections() >= 1, "the server's subscription")

    def commands(self, condition):
        """Returns the first status of commands whose values meet the condition."""
        found = []

        def meets(message):
            for status in statuses(message, "commands"):
                values = {pair.key: pair.value for pair in status.values}
                if condition(values):
                    found.append((status, values))
            return found

        self.diagnostics.wait(meets, "the status of commands")
        return found[0]

    def push(self, *messages):
        """Publishes pushes. Returns once the server has counted them."""
        self.pushes = getattr(self, "pushes", 0) + len(messages)
        for message in messages:
            self.pusher.publish(message)
        self.commands(lambda values: values["pushes"] == str(self.pushes))

    def refusal(self, message):
        """Publishes a push that is refused. Returns the status that says why."""
        self.refused = getattr(self, "refused", 0) + 1
        self.pusher.publish(message)
        status, values = self.commands(lambda v: v["refused_pushes"] == str(self.refused))
        self.assertEqual(status.level, DiagnosticStatus.WARN)
        reason = values["push_refusal"]
        self.assertIn(f"1 push refused since the last report: {reason}", status.message)
        return reason

    def walk(self, count, size):
        return self.play([[0.1] * size] * count)

    def test_lockstep(self):
        for identifier, size in SIZES.items():
            with self.subTest(identifier):
                self.pushes = 0
                self.serve(env=identifier, mode="lockstep")
                trunk = TRUNKS[identifier]
                self.ask("reset", has_seed=True, seed=3)
                undisturbed = self.walk(6, size)
                self.ask("reset", has_seed=True, seed=3)
                before = self.walk(2, size)
                self.push(wrench(trunk, 999.0), wrench(trunk, 90.0, 30.0, 4.0))  # replaced
                pushed = self.walk(1, size)[0]
                after = self.walk(1, size)[0]
                record = self.ask("snapshot").record
                self.assert_same_experiences(before, undisturbed[:2])
                self.assertFalse(same_experience(pushed, undisturbed[2]))
                self.assertGreater(record.actions[0], 0)
                self.assertEqual([(push.step, push.link) for push in record.pushes], [(3, 0)])
                self.assertGreater(record.pushes[0].force_x, 50)
                self.assertAlmostEqual(record.pushes[0].torque_y, 4.0)
                restored = self.ask("restore", record=record).transition
                self.assertTrue(same_experience(restored, after))
                self.assertEqual(self.ask("snapshot").record.pushes, record.pushes)
                # A reset drops a push that has not acted.
                self.push(wrench(trunk, 90.0))
                self.ask("reset", has_seed=True, seed=3)
                self.assert_same_experiences(self.walk(6, size), undisturbed)
                self.assertEqual(self.ask("snapshot").record.pushes, [])

    def test_free_running(self):
        self.serve(paused=True, seed="3")
        transitions = self.record("/transition", Transition)
        self.ask("unpause")
        transitions.wait(lambda m: m.step >= 5)
        for _ in range(5):
            self.pusher.publish(wrench("lower_leg_1", z=-20.0))
            time.sleep(0.05)
        self.pushes = 5
        self.commands(lambda values: int(values["pushes"]) == 5)
        self.ask("pause")
        record = self.ask("snapshot").record
        self.assertGreater(len(record.pushes), 2)
        self.assertEqual({push.link for push in record.pushes}, {2})
        steps = [push.step for push in record.pushes]
        self.assertEqual(steps, sorted(set(steps)))
        # While it is paused, a push waits for the step that a service makes.
        self.push(wrench("upper_leg_2", 5.0))
        step = self.ask("step", action=[0.0] * 4).transition.step
        last = self.ask("snapshot").record.pushes[-1]
        self.assertEqual((last.step, last.link), (step, 3))

    def test_a_bag_replays(self):
        with tempfile.TemporaryDirectory() as folder:
            bag = os.path.join(folder, "pushed.bag")
            for identifier, size in SIZES.items():
                with self.subTest(identifier):
                    self.pushes = 0
                    self.serve(env=identifier, mode="lockstep")
                    records = self.record("/episode_record", EpisodeRecord)
                    self.ask("reset", has_seed=True, seed=3)
                    for link in (TRUNKS[identifier], LIMBS[identifier]):
                        self.push(wrench(link, 20.0, 30.0, 1.0))
                        self.walk(2, size)
                    self.ask("reset")
                    with rosbag.Bag(bag, "w") as file:
                        file.write("/episode_record", records.wait(lambda m: m.pushes))
                    status, text, _ = run_program("replay", bag)
                    self.assertEqual(status, 0, text)
                    self.assertIn("1 episode equal to the bit (4 steps)", text)

    def test_several_environments(self):
        self.serve(mode="lockstep", num_envs=3, shown_environment=1)
        seeds = {"has_seed": [True] * 3, "seeds": [3] * 3}
        self.ask("reset_batch", **seeds)
        self.push(wrench("hull", 90.0))
        reply = self.ask("step_batch", actions=[0.0] * 12)
        rows = [reply.observations[24 * i : 24 * (i + 1)] for i in range(3)]
        self.assertEqual(rows[0], rows[2])
        self.assertNotEqual(rows[0], rows[1])

    def test_refusals(self):
        self.serve(mode="lockstep")
        self.assertIn("there is no episode yet", self.refusal(wrench("hull", 1.0)))
        self.ask("reset", has_seed=True, seed=3)
        undisturbed = self.walk(3, 4)
        self.ask("reset", has_seed=True, seed=3)
        self.assertRegex(self.refusal(wrench("hul\nl", 1.0)), r"frame_id hul\\nl.*hull")
        self.assertIn("torque.y = inf N m", self.refusal(wrench("hull", torque=math.inf)))
        self.assert_same_experiences(self.walk(3, 4), undisturbed)
        self.assertEqual(self.ask("snapshot").record.pushes, [])
        self.assertRegex(self.server.output(), r"ERROR.*Refused push: .*\(1 so far\)")

    def test_it_can_be_typed(self):
        self.serve(mode="lockstep")
        self.ask("reset", has_seed=True, seed=3)
        text = "{header: {frame_id: hull}, wrench: {force: {x: 40.0}}}"
        command = ["rostopic", "pub", "-1", "/push", "geometry_msgs/WrenchStamped", text]
        typed = LoggedProcess(command)
        self.assertEqual(typed.wait(), 0, typed.output())
        self.commands(lambda values: values["pushes"] == "1")
