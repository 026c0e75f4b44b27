"""The program replay on bags that `rosbag record` has written of real servers."""

import os
import random
import re
import tempfile

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_processes import run_program
from processes import CALLER, Launched, wait_for
from server_harness import ServerTest, recorded_topics
from walker_sim.msg import Transition

IDS = {"BipedalWalker-v3": 4, "Walker2d-v5": 6}
WORLD = (
    "{ground_roughness: [1.5, 2], gravity: [-12, -8], push_interval: 0.04,"
    " action_delay: [0.02, 0.1], dropout: 0.1}"
)


def replay(*arguments):
    """Runs replay without a master. Returns exit status, stdout and stderr."""
    return run_program("replay", *arguments, ROS_MASTER_URI="http://localhost:1")


def record_topic(server):
    return server.name.rpartition("/")[0] + "/episode_record"


class ReplayTopicsTest(ServerTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="replay_topics_test_")
        self.addCleanup(folder.cleanup)
        self.bag = os.path.join(folder.name, "walk.bag")
        self.draws = random.Random(1)

    def start_recording(self, *servers):
        """Returns once every server has the recorder's subscription."""
        recorder = self.start_recorder(self.bag, *map(record_topic, servers))
        for server in servers:
            wait_for(
                lambda server=server: record_topic(server) in recorded_topics(server),
                f"{server.name} to be recorded",
            )
        return recorder

    def walk(self, size, steps):
        for _ in range(steps):
            last = self.ask("step", action=[self.draws.uniform(-1, 1) for _ in range(size)])
        return last.transition

    def episodes(self, text):
        """Returns (number, seed, steps, rest) of each episode's line."""
        return re.findall(r"^ *(\d+) +(\w+) +(\d+) +(.*)$", text, re.MULTILINE)

    def test_lockstep_with_a_restored_episode(self):
        for identifier, size in IDS.items():
            with self.subTest(identifier):
                parameters = {"env": identifier, "mode": "lockstep", "max_episode_steps": 12}
                if identifier.startswith("Walker2d"):
                    parameters["terminate_when_unhealthy"] = False
                self.serve(**parameters, world=WORLD)
                recorder = self.start_recording(self.server)
                self.ask("reset", has_seed=True, seed=42)
                self.assertTrue(self.walk(size, 12).truncated)
                self.ask("reset")
                self.walk(size, 5)
                record = self.ask("snapshot").record
                self.walk(size, 2)
                self.ask("restore", record=record)
                self.assertTrue(self.walk(size, 7).truncated)
                self.ask("reset", has_seed=True, seed=2**64 - 1)
                self.walk(size, 3)
                self.ask("reset")  # ends the episode
                self.stop_recorder(recorder)
                self.server.stop()
                status, text, errors = replay(self.bag)
                self.assertEqual((status, errors), (0, ""), text)
                self.assertIn(f"/walker_sim: {identifier} on ", text)
                lines = self.episodes(text)
                self.assertEqual(
                    [line[:3] for line in lines[:3]],
                    [("1", "42", "12"), ("2", "continued", "7"), ("3", "continued", "12")],
                )
                self.assertEqual(lines[3][:2], ("4", str(2**64 - 1)))
                self.assertRegex(lines[0][3], r"truncated: 12 steps +equal$")
                self.assertRegex(lines[1][3], r"reset before its end +equal$")
                self.assertRegex(lines[2][3], r"truncated: 12 steps +equal$")
                self.assertRegex(text, r"\n4 episodes equal to the bit \(\d+ steps\)\n$")

    def test_free_running_recorded_from_the_midst_of_an_episode(self):
        self.serve(env="Walker2d-v5", real_time_factor=2.0, paused=True, seed="3")
        for _ in range(4):
            self.ask("step", action=[0.5] * 6)
        recorder = self.start_recording(self.server)
        heard = self.record("/transition", Transition)
        self.ask("unpause")
        heard.wait(lambda m: m.episode >= 5, "more episodes")
        self.stop_recorder(recorder)
        status, text, _ = replay(self.bag)
        self.assertEqual(status, 0, text)
        lines = self.episodes(text)
        self.assertEqual([line[0] for line in lines[:4]], ["1", "2", "3", "4"])
        self.assertEqual([line[1] for line in lines[:4]], ["3"] + ["continued"] * 3)
        for line in lines:
            self.assertRegex(line[3], " equal$")
        self.assertRegex(text, r"episodes equal to the bit \(\d+ steps\)\n$")

    def test_launch_records_every_episode_from_its_first_state(self):
        self.addCleanup(rospy.delete_param, "/use_sim_time")
        for mode in ("free", "lockstep"):
            for seeds in ("", "5 6"):  # with seeds the agent resets, also in free mode
                with self.subTest(mode=mode, seeds=seeds):
                    self.launch_with_recording(mode, seeds)

    def launch_with_recording(self, mode, seeds):
        launched = Launched(
            "walker.launch",
            *("env:=Walker2d-v5", "agent:=random", "mode:=" + mode, "seeds:=" + seeds),
            *("recording:=" + self.bag, "rviz:=false", "status:=true"),
        )
        self.addCleanup(launched.stop)
        heard = self.record("/transition", Transition, waits=False)

        def has_walked():  # more episodes than checked below: the recorder may lag behind this test
            return any(message.episode >= 8 for message in heard.messages())

        wait_for(has_walked, "more episodes", process=launched)
        heard.close()
        self.assertEqual(launched.stop(), 0, launched.output())
        status, text, _ = replay(self.bag)
        self.assertEqual(status, 0, text)
        lines = self.episodes(text)
        self.assertEqual([line[0] for line in lines[:4]], ["1", "2", "3", "4"], text)
        for line in lines:
            self.assertRegex(line[3], " equal$", text)
        self.assertRegex(text, r"episodes equal to the bit \(\d+ steps\)\n$")

    def test_server_waits_for_the_recorder(self):
        for mode in ("free", "lockstep"):
            with self.subTest(mode=mode):
                self.server = self.start(
                    "/walker_sim",
                    **{"env": "Walker2d-v5", "mode": mode, "seed": "3"},
                    **{"wait_for_recorder": "recorder", "diagnostic_period": 0.05},
                )
                transitions = self.record("/transition", Transition)
                self.assert_it_waits()
                other = self.start_recorder(self.bag, "transition", "spec")
                self.assert_it_waits()
                self.stop_recorder(other)
                self.assertEqual(transitions.messages(), [])
                recorder = self.start_recording(self.server)
                self.server.wait_until_it_serves()
                if mode == "lockstep":
                    self.ask("reset")
                    self.walk(6, 3)
                transitions.wait(lambda m: m.step == 3, "a few steps")
                self.ask("reset")
                self.stop_recorder(recorder)
                self.assert_diagnosed("not recorded: ")
                self.assertEqual(self.server.stop(), 0)
                transitions.close()
                status, text, _ = replay(self.bag)
                self.assertEqual(status, 0, text)
                self.assertEqual(self.episodes(text)[0][:2], ("1", "3"))

    def test_missing_recorder_is_logged(self):
        server = self.start("/alone/walker_sim", wait_for_recorder="bag")
        words = "/alone/bag does not listen to episode_record (parameter"
        wait_for(lambda: f"WARN] Nothing moves yet: {words}" in server.output(), "a warning")
        self.assertEqual(server.stop(), 0)
        self.assertIn(f"INFO] Waiting for the recorder: {words}", server.output())

    def assert_it_waits(self):
        """/diagnostics names the missing topic, and ~reset is not registered."""
        self.assert_diagnosed("nothing moves yet: ")
        self.assertNotEqual(self.server.master.lookupService(CALLER, "/walker_sim/reset")[0], 1)

    def assert_diagnosed(self, consequence):
        diagnostics = self.record("/diagnostics", DiagnosticArray)
        words = consequence + "/recorder does not listen to episode_record"
        diagnostics.wait(
            lambda m: any(
                status.level == DiagnosticStatus.WARN and status.message.startswith(words)
                for status in m.status
            ),
            words,
        )
        diagnostics.close()

    def test_bad_usage_and_unreadable_bags_end_with_status_2(self):
        with open(self.bag, "w", encoding="utf-8") as file:
            file.write("no bag")
        for arguments, words in (
            ([], "Usage: replay BAG"),
            (["--fast", self.bag], "--fast: unknown option"),
            ([self.bag + "s"], self.bag + "s: no such file"),
            ([self.bag], self.bag + ": is not a bag"),
        ):
            status, text, errors = replay(*arguments)
            self.assertEqual((status, text), (2, ""))
            self.assertIn(words, errors)
        status, text, errors = replay("--help")
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("rosbag record episode_record", text)

    def test_nothing_to_compare_ends_with_status_1(self):
        rosbag.Bag(self.bag, "w").close()
        status, text, _ = replay(self.bag)
        self.assertEqual(status, 1)
        self.assertIn("No episode in the bag", text)
