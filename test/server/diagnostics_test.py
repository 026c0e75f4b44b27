"""/diagnostics: keys, levels, messages and episode statistics."""

import math
import statistics
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from processes import LoggedProcess, wait_for
from server_harness import ServerTest
from std_msgs.msg import Float64MultiArray
from walker_sim.msg import Transition

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
KEYS = {
    "simulation": """environment engine engine_version version mode num_envs paused episode
        step episode_return steps simulation_errors pictures pictures_skipped""",
    "pace": """real_time_factor real_time_factor_wanted missed_deadlines jitter_p50_us
        jitter_p99_us jitter_p999_us jitter_max_us step_time_mean_us step_time_max_us""",
    "commands": """effort_command refused_commands contested_commands contested_steps
        clamped_commands command_timeouts pushes refused_pushes push_refusal""",
    "episodes": """finished_episodes return_mean return_std return_min return_max length_mean
        terminated truncated failed""",
}
JITTER = ("jitter_p50_us", "jitter_p99_us", "jitter_p999_us", "jitter_max_us")
STEP_TIME = ("step_time_mean_us", "step_time_max_us")


class Report:
    def __init__(self, status):
        self.level, self.message = status.level, status.message
        self.values = {pair.key: pair.value for pair in status.values}

    def numbers(self, keys):
        return [float(self.values[key]) for key in keys]


class DiagnosticsTest(ServerTest):
    def serve(self, **parameters):
        super().serve(**parameters)
        self.diagnostics = self.record("/diagnostics", DiagnosticArray)

    def report_so_far(self, task, condition=lambda _: True, what="a report"):
        """Returns the task's first report, past or future, that meets the condition."""

        def reports(message):
            statuses = (s for s in message.status if s.name == f"walker_sim: {task}")
            return [report for report in map(Report, statuses) if report.values]

        message = self.diagnostics.wait(
            lambda m: any(map(condition, reports(m))), f"{what} about {task}"
        )
        return next(filter(condition, reports(message)))

    def report(self, task, condition=lambda _: True, what="a report"):
        """Returns the first report made after this call that meets the condition."""
        self.diagnostics.clear()
        self.report_so_far("simulation")  # one may be in flight
        self.diagnostics.clear()
        return self.report_so_far(task, condition, what)

    def test_keys_are_the_same_in_either_mode(self):
        for mode in ("free", "lockstep"):
            self.serve(mode=mode)
            spec = self.call("get_spec").spec
            for task, keys in KEYS.items():
                self.assertEqual(list(self.report(task).values), keys.split())
            values = self.report("simulation").values
            self.assertEqual(values["environment"], spec.id)
            self.assertEqual(values["engine"], spec.engine)
            self.assertEqual(values["engine_version"], spec.engine_version)
            self.assertEqual(values["version"], spec.version)
            self.assertEqual(values["mode"], mode)
            (message,) = self.diagnostics.messages()[-1:]
            self.assertEqual({status.hardware_id for status in message.status}, {spec.id})

    def test_simulation_has_the_state(self):
        self.serve(auto_reset=False, max_episode_steps=40, real_time_factor=2.0)
        self.report("simulation", lambda r: r.message.startswith("truncated: "), "the end")
        self.call("pause")
        self.call("reset", has_seed=True, seed=1)
        state = self.call("step", action=[0.0] * 4).transition
        paused = self.report("simulation", lambda r: r.values["step"] == "1", "one step")
        self.assertEqual((paused.level, paused.message), (OK, "paused"))
        self.assertEqual(paused.values["paused"], "True")
        self.assertEqual(paused.values["episode"], str(state.episode))
        self.assertAlmostEqual(
            float(paused.values["episode_return"]), state.episode_return, places=4
        )
        self.call("unpause")
        self.report("simulation", lambda r: r.message == "running", "running")

    def test_lockstep_waits_for_the_first_reset_and_has_no_pace(self):
        self.serve(mode="lockstep")
        waiting = self.report("simulation")
        self.assertEqual((waiting.level, waiting.message), (OK, "waits for the first reset"))
        pace = self.report("pace")
        self.assertEqual((pace.level, pace.values["real_time_factor_wanted"]), (OK, "-"))
        self.assertEqual({pace.values[key] for key in JITTER + STEP_TIME}, {"-"})
        commands = self.report("commands")
        self.assertRegex(commands.values["effort_command"], "refused")

    def test_jitter_and_step_time_of_a_paced_simulation(self):
        self.serve(diagnostic_period=0.5)
        pace = self.report("pace", lambda r: r.values["jitter_p50_us"] != "-", "jitter")
        self.assertEqual(sorted(pace.numbers(JITTER)), pace.numbers(JITTER))
        mean, longest = pace.numbers(STEP_TIME)
        self.assertTrue(0 < mean <= longest)
        self.assertLess(mean, 20_000, "a step of the environment takes microseconds")
        self.call("pause")
        begin = time.monotonic()
        still = self.report("pace", lambda r: r.values["jitter_p50_us"] == "-", "no jitter")
        self.assertEqual(float(still.values["real_time_factor"]), 0)
        self.assertEqual(still.values["step_time_mean_us"], "-")
        self.assertEqual(still.values["real_time_factor_wanted"], "1")
        paused = time.monotonic() - begin
        self.diagnostics.clear()
        self.call("unpause")
        pace = self.report_so_far("pace", lambda r: r.values["jitter_p50_us"] != "-", "jitter")
        self.assertLess(pace.numbers(JITTER)[-1], (paused - 0.02) * 1e6, "a pause is no jitter")

    def test_unpaced_simulation_has_step_time_but_no_jitter(self):
        self.serve(real_time_factor=0.0)
        pace = self.report("pace", lambda r: r.values["step_time_mean_us"] != "-", "steps")
        self.assertEqual({pace.values[key] for key in JITTER}, {"-"})
        self.assertEqual(pace.values["missed_deadlines"], "0")
        self.assertEqual((pace.level, pace.message), (OK, "as fast as it goes"))

    def test_overload_is_a_warning(self):
        self.serve(real_time_factor=1000.0)
        late = self.report("pace", lambda r: r.level == WARN, "a warning")
        self.assertRegex(late.message, "^cannot keep up: [0-9]+ deadlines? missed")
        self.assertGreater(float(late.values["missed_deadlines"]), 0)
        self.assertLess(float(late.values["real_time_factor"]), 1000)
        self.assertTrue(self.call("set_real_time_factor", factor=0.5).success)
        # The first report after the change still includes earlier misses.
        fine = self.report("pace", lambda r: r.level == OK, "that it keeps up")
        self.assertEqual(fine.values["real_time_factor_wanted"], "0.5")

    def test_state_of_the_effort_command(self):
        self.serve(command_timeout=0.3)
        none = self.report("commands")
        self.assertEqual((none.level, none.values["effort_command"]), (OK, "none: zero torque"))
        command = self.commander()
        self.assertNotIn("No effort command", self.server.output())
        for count in (1, 2):  # the next command ends the warning
            self.diagnostics.clear()
            command.publish(data=[0.0] * 4)
            self.report_so_far(
                "commands", lambda r: r.values["effort_command"] == "held", "a held one"
            )
            late = self.report("commands", lambda r: "timed out" in r.values["effort_command"])
            self.assertEqual(late.level, WARN)
            self.assertIn("no effort command for 0.3 s: zero torque", late.message)
            self.assertEqual(late.values["command_timeouts"], str(count))
        log = r"WARN.*No effort command for 0\.3 s: zero torque"
        self.assertRegex(self.server.output(), log)
        self.call("reset", has_seed=True, seed=1)
        none = self.report("commands", lambda r: r.level == OK, "the end of the warning")
        self.assertEqual(none.values["effort_command"], "none: zero torque")

    def test_refused_commands_warn_once(self):
        self.serve()
        self.commander().publish(data=[math.nan] * 4)
        warning = self.report_so_far(
            "commands", lambda r: r.values["refused_commands"] == "1", "the count"
        )
        self.assertEqual(warning.level, WARN)
        self.assertIn("1 effort command refused", warning.message)
        after = self.report("commands", lambda r: r.level == OK, "the end of the warning")
        self.assertEqual(after.values["refused_commands"], "1")

    def other_agent(self):
        """Publishes effort commands from another node."""
        words = "{data: [0.5, 0.5, 0.5, 0.5]}"
        other = ["rostopic", "pub", "-r", "20", "/effort_command", "std_msgs/Float64MultiArray"]
        self.addCleanup(LoggedProcess([*other, words]).kill)

    def test_second_agent_by_topic_is_a_warning(self):
        self.serve(command_timeout=30.0)
        command = self.commander()
        self.other_agent()
        held = self.report("commands", lambda r: r.values["effort_command"] == "held")
        self.assertEqual((held.level, held.values["contested_commands"]), (OK, "0"))
        command.publish(data=[0.0] * 4)
        warning = self.report_so_far("commands", lambda r: r.level == WARN, "a warning")
        self.assertIn("two agents drive the walker", warning.message)
        self.assertGreater(int(warning.values["contested_commands"]), 0)
        self.report("commands", lambda r: r.level == OK, "the end of the warning")
        self.assertIn("Two agents drive the walker: the effort command of /", self.server.output())
        self.assertIn("diagnostics_test", self.server.output())

    def test_name_of_an_agent_is_escaped(self):
        """The name is the callerid in the publisher's connection header."""
        self.serve(command_timeout=30.0)
        evil = "/x\n[ERROR] all is lost\x1b[2J" + "y" * 10_000
        command = rospy.Publisher(
            "/effort_command", Float64MultiArray, queue_size=1, headers={"callerid": evil}
        )
        self.addCleanup(command.unregister)
        wait_for(lambda: command.get_num_connections() >= 1, "the server to listen")
        self.other_agent()

        def is_warned():
            command.publish(data=[0.0] * 4)
            warning = "the effort command of /x\\n[ERROR] all is lost\\x1b[2Jyyy"
            return warning in self.server.output()

        wait_for(is_warned, "the warning")
        self.assertNotIn("\n[ERROR] all is lost", self.server.output())
        self.assertNotIn("y" * 1000, self.server.output())
        self.assertIn("bytes left out", self.server.output())

    def test_second_agent_by_step_is_a_warning(self):
        self.serve(mode="lockstep")
        mine = self.client("step")
        other = self.client("step", caller="/another")
        self.call("reset", has_seed=True, seed=1)
        actions = {"action": [0.0] * 4}
        mine(**actions)
        other(**actions)
        calm = self.report("commands")
        self.assertEqual((calm.level, calm.values["contested_steps"]), (OK, "0"))
        mine(**actions)
        warning = self.report_so_far("commands", lambda r: r.level == WARN, "a warning")
        self.assertIn("two agents step the walker: 1 step after another node's", warning.message)
        self.assertEqual(warning.values["contested_steps"], "1")
        self.assertRegex(
            self.server.output(),
            r"Two agents step the walker: /\S+ resumes after a step of /another \(1 such",
        )
        # A reset forgets earlier callers.
        self.call("reset", has_seed=True, seed=1)
        other(**actions)
        self.call("reset", has_seed=True, seed=1)
        mine(**actions)
        calm = self.report("commands", lambda r: r.level == OK, "the end of the warning")
        self.assertEqual(calm.values["contested_steps"], "1")

    def test_statistics_of_episodes(self):
        self.serve(mode="lockstep", max_episode_steps=100)
        none = self.report("episodes")
        self.assertEqual(none.values["finished_episodes"], "0")
        self.assertEqual(none.message, "no episode has ended yet")
        reset, step = self.client("reset"), self.client("step")
        ended = []
        for seed in range(4):  # with an odd seed the walker soon falls
            state = reset(has_seed=True, seed=seed).transition
            while not (state.terminated or state.truncated):
                state = step(action=[seed % 2, -1.0 * (seed % 2)] * 2).transition
            ended.append(state)
        report = self.report(
            "episodes", lambda r: r.values["finished_episodes"] == "4", "all episodes"
        )
        self.assertIn("over the last 4 episodes", report.message)
        returns = [state.episode_return for state in ended]
        for key, expected in (
            ("return_mean", statistics.fmean(returns)),
            ("return_std", statistics.pstdev(returns)),
            ("return_min", min(returns)),
            ("return_max", max(returns)),
            ("length_mean", statistics.fmean(state.step for state in ended)),
            ("terminated", 2),
            ("truncated", 2),
            ("failed", 0),
        ):
            value = float(report.values[key])
            self.assertTrue(math.isclose(value, expected, rel_tol=1e-5), (key, value, expected))

    def test_reports_are_a_period_apart(self):
        self.serve(diagnostic_period=0.2)
        self.record("/transition", Transition).wait_count(3)
        self.diagnostics.clear()
        begin = time.monotonic()
        time.sleep(2)
        count = len(self.diagnostics.messages())
        self.assertLessEqual(count, (time.monotonic() - begin) / 0.2 + 2)
        self.assertGreater(count, 2)
