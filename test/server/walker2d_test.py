"""Walker2d on a server: commands, custom models, failing simulations."""

import math
import sys
import time

import sensor_msgs.msg
import tf2_msgs.msg
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from processes import wait_for
from server_harness import (
    MARKERS,
    STATE_TOPICS,
    STATE_VALUES,
    TransitionsTest,
    bits,
    nanoseconds,
    same_experience,
    statuses,
)
from walker_sim.msg import Episode, Transition

JOINTS = ["thigh_joint", "leg_joint", "foot_joint"]
JOINTS += ["thigh_left_joint", "leg_left_joint", "foot_left_joint"]
ZERO = [0.0] * 6
OVERFLOW = "MuJoCo: Stack overflow"
REFUSED = f"the simulation failed at its reset: {OVERFLOW}"
QUIET = 1.5  # wall seconds; with auto_reset a failed reset is retried every second
TOPICS = {**STATE_TOPICS, **STATE_VALUES, **MARKERS, "/episode": Episode}


def numbers_of(message):
    """All floats of a message, except a transition's info, where NaN means absent."""
    if isinstance(message, float):
        yield message
    elif isinstance(message, (list, tuple)):
        for element in message:
            yield from numbers_of(element)
    elif hasattr(message, "__slots__"):
        for name in message.__slots__:
            if not (isinstance(message, Transition) and name == "info"):
                yield from numbers_of(getattr(message, name))


class Walker2dTest(TransitionsTest):
    dt = 8_000_000

    def serve(self, **parameters):
        parameters.setdefault("env", "Walker2d-v5")
        super().serve(**parameters)

    def test_free_running_steps_at_125_hz(self):
        self.serve(terminate_when_unhealthy=False)
        begun = self.transitions.wait()
        late = self.transitions.wait(lambda m: m.step == begun.step + 250, "two seconds more")
        self.assertEqual(nanoseconds(late) - nanoseconds(begun), 250 * self.dt)
        self.assert_consecutive(self.transitions.messages())
        wait_for(  # a busy machine delays steps, but not their average
            lambda: abs(self.counter("real_time_factor") - 1) < 0.3, "a second in real time"
        )

    def test_command_is_in_newton_metres_and_clamped_at_100(self):
        self.serve(command_timeout=0.0, terminate_when_unhealthy=False)
        joints = self.record("/joint_states", sensor_msgs.msg.JointState)
        command = self.commander()
        self.assertEqual(self.counter("clamped"), 0)
        for efforts, clamped in (
            ([25.0, -50.0, 12.5, 100.0, -100.0, 0.0], 0),
            ([100.5, -1e6, 12.5, 0.0, 0.0, 33.0], 1),
        ):
            command.publish(data=efforts)
            wanted = bits([effort / 100 for effort in efforts])
            step = self.transitions.wait(
                lambda m, wanted=wanted: bits(m.action) == wanted, "the command, as given"
            )
            state = joints.at(nanoseconds(step))
            self.assertEqual(list(state.name), JOINTS)
            limited = [100 * max(-1.0, min(1.0, effort / 100)) for effort in efforts]
            self.assertEqual(list(state.effort), limited)
            self.assertEqual(self.counter("clamped"), clamped)
        command.publish(data=[1.7e308] * 6)
        huge = self.transitions.wait(lambda m: m.action and m.action[0] > 1e300, "a huge effort")
        self.assertTrue(all(map(math.isfinite, [huge.reward, huge.episode_return, *huge.info])))
        command.publish(data=[1.0] * 4)
        wait_for(lambda: self.counter("refused") == 1, "the refusal of four values")
        self.assertRegex(self.server.output(), "4 values; must have 6")

    def test_weak_motor_takes_any_effort(self):
        weak = self.model_file(('gear="100"', 'gear="0.1"'))
        self.serve(xml_file=weak, command_timeout=0.0)
        command = self.commander()
        command.publish(data=[1.7e308, -1.7e308, 0.05, 0.0, 0.0, 0.0])
        step = self.transitions.wait(lambda m: m.action and m.action[0] > 1, "the command")
        self.assertEqual(step.action[:3], (sys.float_info.max, -sys.float_info.max, 0.5))
        self.transitions.wait(lambda m: m.episode > step.episode, "the next episode")
        self.assertTrue(self.server.is_running())

    def test_trunk_may_be_called_base_link(self):
        named = self.model_file(('body name="torso"', 'body name="base_link"'))
        self.serve(mode="lockstep", xml_file=named)
        self.assertIn(named, self.call("get_spec").spec.parameter_values)
        static = self.record("/tf_static", tf2_msgs.msg.TFMessage)
        moving = self.record("/tf", tf2_msgs.msg.TFMessage)
        self.call("reset", has_seed=True, seed=1)
        parents = {t.child_frame_id: t.header.frame_id for t in moving.wait().transforms}
        self.assertEqual(parents["base_link"], "odom")
        self.assertEqual(parents["thigh"], "base_link")
        self.assertNotIn("base_link", [t.child_frame_id for t in static.wait().transforms])

    def assert_engine_failure_ends_the_episode(self):
        """Steps until the engine fails. No topic contains NaN, and the next reset succeeds."""
        recorders = [self.record(topic, kind) for topic, kind in TOPICS.items()]
        reset, step = self.client("reset"), self.client("step")
        for count in (1, 2):
            state = reset(has_seed=True, seed=2).transition
            self.assertEqual((state.error, state.terminated), ("", False))
            while not state.terminated:
                last, state = state, step(action=[1.0] * 6).transition
                self.assertLess(state.step, 300, "the simulation is unstable")
            self.assertIn("MuJoCo", state.error)
            self.assertEqual(state.reward, 0)
            self.assertEqual(bits(state.observation), bits(last.observation))
            self.assertFalse(step(action=ZERO).success, "only a reset is allowed")
            self.await_report(DiagnosticStatus.ERROR, f"simulation failed: {state.error}")
            for key in ("simulation_errors", "failed"):
                self.assertEqual(self.counter(key), count)
            following = reset(has_seed=True, seed=2)
            self.assertTrue(following.success, following.status_message)
            self.assertEqual(nanoseconds(following.transition), nanoseconds(state) + self.dt)
            self.await_report(DiagnosticStatus.OK)
            ended = self.transitions.at(nanoseconds(state))
            self.assertEqual((ended.error, ended.terminated), (state.error, True))
        end = recorders[list(TOPICS).index("/episode")].wait(lambda m: m.length > 0, "the end")
        self.assertRegex(end.end_reason, "^terminated: ")
        for recorder in recorders:
            recorder.wait()
            for message in recorder.messages():
                self.assertFalse(any(map(math.isnan, numbers_of(message))), recorder.topic)

    def test_engine_failure_ends_the_episode_with_an_error(self):
        failing = {"mode": "lockstep", "terminate_when_unhealthy": False}
        self.serve(reset_noise_scale=1e6, **failing)
        self.assert_engine_failure_ends_the_episode()
        unstable = self.model_file(
            ('timestep="0.002" integrator="RK4"', 'timestep="0.5" integrator="Euler"')
        )
        self.serve(xml_file=unstable, **failing)
        self.dt = 2_000_000_000
        self.assert_engine_failure_ends_the_episode()

    def test_free_running_continues_after_an_engine_failure(self):
        self.serve(reset_noise_scale=1e6, real_time_factor=4.0, paused=True)
        self.call("unpause")
        self.await_report(DiagnosticStatus.ERROR, "since the last report")
        self.transitions.wait(lambda m: m.episode == 5, "the fifth episode")
        self.assert_consecutive(self.transitions.messages())
        self.assertTrue(any(m.error for m in self.transitions.messages()))
        self.assertTrue(self.server.is_running())

    def sort_seeds(self):
        """Returns {seed: transition} of the seeds below 20 whose resets succeed, and the rest."""
        replies = {seed: self.call("reset", has_seed=True, seed=seed) for seed in range(20)}
        good = {seed: reply.transition for seed, reply in replies.items() if reply.success}
        bad = [seed for seed, reply in replies.items() if not reply.success]
        self.assertTrue(good and bad)
        for seed in bad:
            self.assertEqual(replies[seed].status_message, REFUSED)
        return good, bad

    def await_report(self, level, words=""):
        """Waits for diagnostics of the simulation with this level and these words."""

        def is_it(message):
            found = statuses(message, "simulation")
            return any(status.level == level and words in status.message for status in found)

        self.record("/diagnostics", DiagnosticArray).wait(is_it, words)

    def test_failed_reset_is_published_and_the_next_succeeds(self):
        self.serve(mode="lockstep", **self.cramped_walker())
        good, bad = self.sort_seeds()
        self.assertEqual(self.call("reset", has_seed=True, seed=bad[0]).status_message, REFUSED)
        states = self.transitions.wait_count(21)
        self.assertEqual([m.episode for m in states], list(range(1, 22)))
        for seed, (one, other) in enumerate(zip(states, states[1:])):
            self.assertEqual(nanoseconds(other), nanoseconds(one) + self.dt)
            self.assertEqual((one.step, one.terminated), (0, seed in bad))
            self.assertEqual(one.error, OVERFLOW if seed in bad else "")
        self.assertEqual(list(states[-1].observation), [0.0] * 17)
        self.assertTrue(all(map(math.isnan, states[-1].info)))
        self.assertEqual(self.counter("simulation_errors"), len(bad) + 1)
        words = f"simulation failed at its reset: {OVERFLOW}"
        self.await_report(DiagnosticStatus.ERROR, words)

        recorders = [self.record(topic, kind) for topic, kind in TOPICS.items()]  # no state to draw
        refused = self.call("step", action=ZERO)
        self.assertEqual(refused.status_message, "step: the simulation failed; reset first")
        self.assertIn("there is no episode", self.call("snapshot").status_message)
        self.assertIn("the simulation failed", self.call("render").status_message)

        self.ask("reset", has_seed=True, seed=next(iter(good)))
        for recorder in recorders:
            recorder.wait()

    def test_failed_resets_are_retried_once_a_second(self):
        cramped = {**self.cramped_walker(), "reset_noise_scale": 1e6}  # half of all resets fail
        self.serve(**cramped, paused=True)
        seed = self.find_failures(4)
        self.serve(**cramped, seed=str(seed), real_time_factor=0.0, max_episode_steps=50)
        self.transitions.wait(lambda m: m.episode == 2, "the second attempt")
        begin, used = time.monotonic(), self.server.processor_time()
        self.transitions.wait(lambda m: m.episode == 4, "the fourth attempt")
        self.assertLess(self.server.processor_time() - used, (time.monotonic() - begin) / 2)
        self.assertTrue(all(m.error == OVERFLOW for m in self.transitions.messages()))
        self.assertEqual(self.server.output().count("the simulation failed"), 1)
        self.assertIn(f"No episode: {REFUSED}", self.server.output())
        words = f"simulation failed at its reset: {OVERFLOW}"
        self.await_report(DiagnosticStatus.ERROR, words)
        self.assertEqual(self.counter("missed_deadlines"), 0)
        self.transitions.wait(lambda m: m.step > 0, "an episode")
        self.assert_consecutive(self.transitions.messages())

    def find_failures(self, count):
        """Returns a seed whose reset fails, as do the next `count - 1` resets without a seed."""
        reset = self.client("reset")
        for seed in range(1000):
            attempts = (reset(has_seed=i == 0, seed=seed).success for i in range(count))
            if not any(attempts):
                return seed
        raise AssertionError("no seed with so many failures")

    def test_without_auto_reset_a_failed_reset_is_not_retried(self):
        cramped = self.cramped_walker()
        self.serve(**cramped, paused=True)
        good, bad = self.sort_seeds()
        self.serve(**cramped, seed=str(bad[0]), auto_reset=False)
        episode = self.record("/episode", Episode).wait()
        self.assertEqual(episode.end_reason, "terminated: the simulation failed at its reset")
        self.assertEqual((episode.episode, episode.length), (1, 0))
        wait_for(lambda: "~reset begins the next" in self.server.output(), "what to do")
        self.transitions.clear()
        time.sleep(QUIET)
        episodes = [m.episode for m in self.transitions.messages()]
        self.assertIn(episodes, ([], [1]), "the failed start may come after its log, and no other")
        seed, first = next(iter(good.items()))
        self.assertTrue(self.call("reset", has_seed=True, seed=seed).success)
        self.transitions.wait(lambda m: m.step > 0, "the episode")
        begun = next(m for m in self.transitions.messages() if m.episode == 2)
        self.assertTrue(same_experience(begun, first))
