#!/usr/bin/python3
"""Many environments in one server: ~reset_batch, ~step_batch and the shown environment."""

import math
import sys

import rosgraph_msgs.msg
import rospy
import rostest
import std_msgs.msg
import visualization_msgs.msg
from server_harness import (
    SERVICES,
    STATE_TOPICS,
    ServerTest,
    bits,
    first_stamp,
    nanoseconds,
    same_experience,
)
from std_srvs.srv import Empty
from walker_sim.msg import Episode, EpisodeRecord, Transition

FALL = [1.0, 1.0, 1.0, -1.0]  # the walker falls within 60 steps
STAND = [0.0] * 4
OBSERVATION = 24
MODES = ("next_step", "same_step", "disabled")
ROWS = ("observations", "rewards", "terminated", "truncated", "episodes", "steps", "info")
FINAL_ROWS = ("final_environments", "final_observations", "final_info")


def row(values, index, width=OBSERVATION):
    return list(values[index * width : (index + 1) * width])


def same_reply(one, other):
    return all(
        bits(list(getattr(one, name))) == bits(list(getattr(other, name)))
        for name in ROWS + FINAL_ROWS
    )


class BatchTest(ServerTest):
    def serve(self, **parameters):
        parameters.setdefault("mode", "lockstep")
        server = super().serve(**parameters)
        self.num_envs = parameters.get("num_envs", 1)
        self.clients = {
            name: server.client(name, SERVICES[name])
            for name in ("reset", "step", "reset_batch", "step_batch")
        }
        for client in self.clients.values():
            self.addCleanup(client.close)
        return server

    def try_reset(self, environments=(), seeds=None):
        """@param seeds: None, or for each environment a seed or None"""
        given = [] if seeds is None else seeds
        return self.clients["reset_batch"](
            environments=list(environments),
            has_seed=[int(seed is not None) for seed in given],
            seeds=[seed or 0 for seed in given],
        )

    def reset(self, environments=(), seeds=None):
        reply = self.try_reset(environments, seeds)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        return reply

    def try_step(self, *actions):
        """@param actions: one for all environments, or one per environment"""
        many = actions * self.num_envs if len(actions) == 1 else actions
        return self.clients["step_batch"](actions=[value for action in many for value in action])

    def step(self, *actions):
        reply = self.try_step(*actions)
        self.assertTrue(reply.success, reply.status_message)
        self.assertEqual(reply.status_message, "")
        self.assertEqual(len(reply.observations), self.num_envs * OBSERVATION)
        for name in ("rewards", "terminated", "truncated", "episodes", "steps"):
            self.assertEqual(len(getattr(reply, name)), self.num_envs, name)
        return reply

    def step_until_the_end_of(self, environment, *actions):
        for _ in range(200):
            reply = self.step(*actions)
            if reply.terminated[environment]:
                return reply
        self.fail("this gait was to fall")

    # ------------------------------------------------------------ autoreset

    def test_next_step_resets_with_the_step_after_the_end(self):
        self.serve(num_envs=3)
        self.reset(seeds=[7, 8, 9])
        last = self.step_until_the_end_of(1, STAND, FALL, STAND)
        self.assertEqual(list(last.terminated), [0, 1, 0])
        self.assertEqual(list(last.final_environments), [])
        self.assertGreater(last.steps[1], 1)
        self.assertLess(last.rewards[1], -50)
        following = self.step(FALL)
        self.assertEqual(list(following.terminated), [0, 0, 0])
        self.assertEqual(following.rewards[1], 0)
        self.assertEqual(list(following.episodes), [1, 2, 1])
        self.assertEqual(list(following.steps), [last.steps[0] + 1, 0, last.steps[2] + 1])
        self.assertEqual(self.step(FALL).steps[1], 1)

    def test_same_step_resets_at_once_and_tells_the_last_observation(self):
        self.serve(num_envs=3, autoreset_mode="same_step", max_episode_steps=200)
        self.reset(seeds=[7, 8, 9])
        last = self.step_until_the_end_of(1, STAND, FALL, STAND)
        self.assertEqual(list(last.final_environments), [1])
        self.assertEqual(len(last.final_observations), OBSERVATION)
        self.assertNotEqual(list(last.final_observations), row(last.observations, 1))
        self.assertLess(last.rewards[1], -50)
        self.assertEqual(list(last.episodes), [1, 2, 1])
        self.assertEqual(last.steps[1], 0)
        following = self.step(STAND)
        self.assertEqual(list(following.final_environments), [])
        self.assertEqual(list(following.final_observations), [])
        self.assertEqual(following.steps[1], 1)

    def test_disabled_wants_a_reset(self):
        self.serve(num_envs=3, autoreset_mode="disabled")
        self.reset(seeds=[7, 8, 9])
        last = self.step_until_the_end_of(1, STAND, FALL, STAND)
        refused = self.try_step(STAND)
        self.assertFalse(refused.success)
        self.assertRegex(refused.status_message, "environment 1.*reset")
        for name in ROWS + FINAL_ROWS:
            self.assertEqual(len(getattr(refused, name)), 0, name)
        self.reset([1])
        following = self.step(STAND)
        self.assertEqual(list(following.episodes), [1, 2, 1])
        self.assertEqual(list(following.steps), [last.steps[0] + 1, 1, last.steps[2] + 1])

    def test_the_specification_tells_number_and_mode(self):
        for mode in MODES:
            self.serve(num_envs=3, autoreset_mode=mode)
            spec = self.call("get_spec").spec
            self.assertEqual((spec.num_envs, spec.autoreset_mode), (3, mode))
            self.server.stop()
        for auto_reset, mode in ((True, "next_step"), (False, "disabled")):
            self.serve(mode="free", auto_reset=auto_reset, autoreset_mode="same_step")
            self.assertEqual(self.call("get_spec").spec.autoreset_mode, mode)
            self.server.stop()

    # ------------------------------------------------------------ resets

    def test_a_reset_of_some_leaves_the_others_alone(self):
        self.serve(num_envs=4)
        self.reset(seeds=[1, 2, 3, 4])
        alone = [self.step(STAND) for _ in range(6)]
        self.reset(seeds=[1, 2, 3, 4])
        for i, expected in enumerate(alone):
            if i == 3:
                told = self.reset([3, 1], seeds=[9, None])
                self.assertEqual(len(told.observations), 2 * OBSERVATION)
            reply = self.step(STAND)
            for environment in (0, 2):
                self.assertEqual(
                    bits(row(reply.observations, environment)),
                    bits(row(expected.observations, environment)),
                )
        self.assertEqual(list(reply.steps), [6, 3, 6, 3])

    def test_a_seed_decides_alone_and_rows_come_as_listed(self):
        self.serve(num_envs=4)
        all_of_them = self.reset(seeds=[5, 6, 5, None])
        first = row(all_of_them.observations, 0)
        self.assertEqual(bits(row(all_of_them.observations, 2)), bits(first))
        self.assertNotEqual(row(all_of_them.observations, 1), first)
        some = self.reset([2, 0, 3], seeds=[6, None, 5])
        self.assertEqual(
            bits(row(some.observations, 0)), bits(row(all_of_them.observations, 1)), "seed 6"
        )
        self.assertEqual(bits(row(some.observations, 2)), bits(first), "seed 5")
        self.assertNotIn(row(some.observations, 1), [first, row(all_of_them.observations, 1)])

    def test_the_first_reset_takes_the_server_s_seed_and_the_index(self):
        largest = 2**64 - 1
        self.serve(num_envs=3, seed=str(largest), shown_environment=2)
        episodes = self.record("/episode", Episode)
        begun = self.reset()
        shown = episodes.wait()
        self.assertEqual((shown.has_seed, shown.seed, shown.environment), (True, 1, 2))
        again = self.reset(seeds=[largest, 0, 1])
        self.assertEqual(bits(begun.observations), bits(again.observations))
        self.reset()
        continued = episodes.wait(lambda m: m.episode == 3, "the third episode")
        self.assertFalse(continued.has_seed)
        self.assertNotEqual(continued.generator_state, shown.generator_state)

    # ------------------------------------------------------------ refusals

    def refusals(self):
        """Yields the replies to invalid calls, each with words of the message."""
        size = self.num_envs * 4
        bad = [0.0] * size
        bad[5] = math.nan
        too_large = [0.0] * size
        too_large[-1] = math.inf
        step, reset = self.clients["step_batch"], self.clients["reset_batch"]
        yield step(actions=[]), ["0 values", str(size)]
        yield step(actions=[0.0] * (size - 1)), [f"{size - 1} values", str(size)]
        yield step(actions=[0.0] * (size + 4)), [f"{size + 4} values", str(size)]
        yield step(actions=bad), ["environment 1", "knee_1", "nan", "finite"]
        yield step(actions=too_large), ["environment 2", "knee_2", "inf", "finite"]
        yield self.try_reset([0, 3]), ["environments[1] = 3", "num_envs = 3"]
        yield self.try_reset([2, 0, 2]), ["environments[2] = 2", "once"]
        yield self.try_reset([1], seeds=[1, 2]), ["seeds", "2", "1"]
        yield self.try_reset(seeds=[1]), ["seeds", "1", "3"]
        yield reset(environments=[], has_seed=[1] * 3, seeds=[]), ["has_seed", "3", "0"]
        yield reset(environments=[], has_seed=[], seeds=[1] * 3), ["has_seed", "0", "3"]

    def test_what_is_refused_moves_nothing(self):
        self.serve(num_envs=3)
        self.reset(seeds=[4, 5, 6])
        undisturbed = [self.step(FALL) for _ in range(12)]
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        transitions = self.record("/transition", Transition)
        self.reset(seeds=[4, 5, 6])
        for expected in undisturbed:
            for reply, words in self.refusals():
                self.assertFalse(reply.success)
                for word in words:
                    self.assertIn(word, reply.status_message)
            self.assertTrue(self.differ_in_episode_only(self.step(FALL), expected))
        told = transitions.wait_count(13)
        self.assertEqual([state.step for state in told], list(range(13)))
        self.assert_consecutive(told)
        clock.at(nanoseconds(told[-1]))
        self.assertLessEqual(len(clock.messages()), 14)  # a new subscription repeats the time

    def differ_in_episode_only(self, one, other):
        one.episodes = other.episodes
        return same_reply(one, other)

    def test_a_step_before_the_first_reset_is_refused(self):
        for mode in MODES:
            self.serve(num_envs=3, autoreset_mode=mode)
            for listed in ([], [1]):
                if listed:
                    self.reset(listed)
                reply = self.try_step(STAND)
                self.assertFalse(reply.success)
                self.assertRegex(reply.status_message, "environment 0.*reset")
            self.reset([0, 2])
            self.assertEqual(list(self.step(STAND).steps), [1, 1, 1])
            self.server.stop()

    def test_calls_for_one_walker_are_refused_with_what_to_call(self):
        self.serve(num_envs=2)
        self.reset()
        before = self.step(STAND)
        for name, fields in (
            ("reset", {}),
            ("step", {"action": STAND}),
            ("snapshot", {}),
            ("restore", {"record": EpisodeRecord()}),
        ):
            reply = self.call(name, **fields)
            self.assertFalse(reply.success, name)
            for word in (name, "num_envs = 2", "~reset_batch", "~step_batch"):
                self.assertIn(word, reply.status_message)
        gazebo = self.server.client("reset_simulation", Empty)
        self.addCleanup(gazebo.close)
        self.assertRaises(RuntimeError, gazebo)
        self.assertEqual(list(self.step(STAND).steps), [step + 1 for step in before.steps])

    def test_free_running_it_is_for_a_paused_simulation(self):
        self.serve(mode="free")
        refused = self.try_step(STAND)
        self.assertFalse(refused.success)
        for word in ("step_batch", "free", "pause"):
            self.assertIn(word, refused.status_message)
        self.call("pause")
        first = self.step(STAND)
        self.assertEqual(self.step(STAND).steps[0], first.steps[0] + 1)
        self.assertEqual(self.reset(seeds=[5]).observations, self.reset([0], [5]).observations)

    # ------------------------------------------------------------ time and topics

    def test_every_call_advances_the_clock_by_dt(self):
        self.serve(num_envs=3, shown_environment=1)
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        transitions = self.record("/transition", Transition)
        self.reset(seeds=[1, 2, 3])
        begin = nanoseconds(transitions.wait())
        self.step(STAND)
        clock.at(begin + self.dt)
        self.reset([0, 2])  # not the shown environment
        clock.at(begin + 2 * self.dt)
        self.step(STAND)
        clock.at(begin + 3 * self.dt)
        self.reset([1])
        clock.at(begin + 4 * self.dt)
        told = transitions.wait_count(4)
        self.assertEqual([(nanoseconds(state) - begin) // self.dt for state in told], [0, 1, 3, 4])
        self.assertEqual([state.step for state in told], [0, 1, 2, 0])

    def test_the_topics_tell_of_the_shown_environment(self):
        for mode in MODES:
            with self.subTest(mode=mode):
                server = self.serve(num_envs=3, shown_environment=1, autoreset_mode=mode)
                try:
                    self.compare_topics(mode)
                finally:
                    server.stop()

    def compare_topics(self, mode):
        recorders = {topic: self.record(topic, kind) for topic, kind in STATE_TOPICS.items()}
        rewards = self.record("/reward", std_msgs.msg.Float64)
        observations = self.record("/observation", std_msgs.msg.Float64MultiArray)
        episodes = self.record("/episode", Episode)
        scenes = self.record("/scene_markers", visualization_msgs.msg.MarkerArray)
        texts = self.record("/state_markers", visualization_msgs.msg.MarkerArray)
        told, total = [], 0.0
        for calls, states in enumerate(self.play_shown(mode), start=1):
            for step, observation, reward, ended in states:
                told = recorders["/transition"].wait_count(len(told) + 1)[: len(told) + 1]
                total = 0.0 if step == 0 else total + reward
                self.assertEqual((told[-1].environment, told[-1].step), (1, step))
                self.assertEqual(bits(told[-1].observation), bits(observation))
                self.assertEqual((told[-1].reward, told[-1].episode_return), (reward, total))
                self.assertEqual((told[-1].terminated, told[-1].truncated), (ended, False))
                self.assertEqual(list(told[-1].action), FALL if step else [])
                self.assertEqual(told[-1].error, "")
            # If a call makes two states, sensors, reward and observation show only the newer one.
            for recorder in recorders.values():
                recorder.at(nanoseconds(told[-1]))
            joints = recorders["/joint_states"].at(nanoseconds(told[-1]))
            self.assertAlmostEqual(joints.position[0], states[-1][1][4], places=5)
            rewards.wait(lambda m, last=told[-1]: m.data == last.reward, "the reward")
            observations.wait(
                lambda m, last=told[-1]: bits(m.data) == bits(last.observation), "the observation"
            )
            texts.wait_count(calls)
        self.assert_consecutive(told)
        for state in told:
            recorders["/clock"].at(nanoseconds(state))
            recorders["/tf"].at(nanoseconds(state))
        recorders.pop("/clock")  # a new subscription repeats the time
        for topic, recorder in recorders.items():
            stamps = [first_stamp(message) for message in recorder.messages()]
            self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])), topic)
        self.compare_episodes(episodes, told)
        scenes.wait_count(sum(state.step == 0 for state in told))

    def play_shown(self, mode):
        """Steps until the shown environment has fallen twice.

        Yields its new states after each call: (step, observation, reward, whether it ended).
        """
        begun = self.reset(seeds=[1, 2, 3])
        yield [(0, row(begun.observations, 1), 0.0, False)]
        falls, step = 0, 0
        while falls < 2:
            reply = self.step(STAND, FALL, STAND)
            new = (reply.steps[1], row(reply.observations, 1), reply.rewards[1])
            falls += reply.terminated[1]
            if reply.terminated[1] and mode == "same_step":
                final = row(reply.final_observations, 0)
                yield [
                    (step + 1, final, reply.rewards[1], True),
                    (0, row(reply.observations, 1), 0.0, False),
                ]
            else:
                yield [(*new, bool(reply.terminated[1]))]
            step = reply.steps[1]
            if reply.terminated[1] and mode == "disabled":
                again = self.reset([1])
                yield [(0, row(again.observations, 0), 0.0, False)]

    def compare_episodes(self, episodes, told):
        ends = [state for state in told if state.terminated]
        begins = [state for state in told if state.step == 0]
        kept = episodes.wait_count(len(ends) + len(begins))
        for state in ends:
            end = episodes.at(nanoseconds(state))
            self.assertEqual((end.environment, end.episode), (1, state.episode))
            self.assertEqual((end.length, end.episode_return), (state.step, state.episode_return))
            self.assertRegex(end.end_reason, "^terminated: .+")
        for state in begins:
            begun = episodes.at(nanoseconds(state))
            self.assertEqual((begun.environment, begun.episode), (1, state.episode))
            self.assertEqual((begun.length, begun.end_reason), (0, ""))
            self.assertEqual(begun.has_seed, state.episode == 1)
        self.assertEqual(len({message.generator_state for message in kept}), len(begins))

    def test_the_shown_environments_episodes_are_recorded(self):
        """At their end or the reset that abandons them, for a restore on another server."""
        self.serve(num_envs=3, shown_environment=2)
        transitions = self.record("/transition", Transition)
        records = self.record("/episode_record", EpisodeRecord)
        self.reset(seeds=[1, 2, 3])
        self.step_until_the_end_of(2, STAND, STAND, FALL)
        for _ in range(5):
            last = self.step(STAND, STAND, FALL)
        self.reset(environments=[0])
        self.assertFalse(self.try_reset(environments=[2, 2]).success)
        self.reset(environments=[2])
        told = transitions.wait(lambda m: (m.episode, m.step) == (2, last.steps[2]), "the state")
        ended, abandoned = records.wait_count(2)
        self.assertRegex(ended.episode.end_reason, "^terminated: .+")
        self.assertEqual(abandoned.episode.end_reason, "reset before its end")
        self.assertEqual((abandoned.episode.episode, abandoned.episode.length), (2, told.step))
        self.server.stop()
        self.serve(publish_clock=False)
        restored = self.call("restore", record=abandoned)
        self.assertTrue(restored.success, restored.status_message)
        self.assertTrue(same_experience(restored.transition, told))

    def test_one_environment_is_the_same_by_either_service(self):
        for mode in MODES:
            with self.subTest(mode=mode):
                server = self.serve(autoreset_mode=mode)
                try:
                    self.alternate(mode)
                finally:
                    server.stop()

    def alternate(self, mode):
        transitions = self.record("/transition", Transition)
        step = self.clients["step"]
        begun = self.clients["reset"](has_seed=True, seed=7).transition
        undisturbed = [begun]
        while not undisturbed[-1].terminated:
            undisturbed.append(step(action=FALL).transition)
        told = self.reset(seeds=[7])
        self.assertEqual(bits(told.observations), bits(begun.observation))
        for number, expected in enumerate(undisturbed[1:], start=1):
            if number % 2 and not expected.terminated:
                self.assertTrue(same_experience(step(action=FALL).transition, expected))
                continue
            reply = self.step(FALL)
            last = expected.terminated and mode == "same_step"
            observation = reply.final_observations if last else reply.observations
            self.assertEqual(bits(observation), bits(expected.observation))
            self.assertEqual(reply.rewards[0], expected.reward)
            self.assertEqual(bool(reply.terminated[0]), expected.terminated)
        self.assert_end_of_alternating(mode)
        count = len(undisturbed)
        self.assert_consecutive(transitions.wait_count(2 * count + 1))

    def assert_end_of_alternating(self, mode):
        """The last ~step_batch has ended the second episode."""
        if mode == "same_step":
            self.assertEqual(self.step(FALL).steps[0], 1)
            return
        refused = self.call("step", action=FALL)
        self.assertFalse(refused.success)
        self.assertIn("ended", refused.status_message)
        if mode == "disabled":
            self.assertIn("reset", self.try_step(FALL).status_message)
            self.reset()
            return
        bad = self.clients["step_batch"](actions=[0.0, math.nan, 0.0, 0.0])
        self.assertFalse(bad.success)
        self.assertIn("knee_1", bad.status_message)
        following = self.step(FALL)
        self.assertEqual((following.steps[0], following.rewards[0]), (0, 0))

    # ------------------------------------------------------------ errors and large batches

    def test_diagnostics_count_all_environments(self):
        self.serve(num_envs=4, autoreset_mode="same_step")
        self.reset(seeds=[1, 2, 3, 4])
        steps, ended = 0, 0
        while ended < 6:
            reply = self.step([1.5, 1.0, 1.0, -1.0], FALL, FALL, FALL)
            steps += 4
            ended += len(reply.final_environments)
        self.assertEqual(self.counter("steps"), steps)
        self.assertEqual(self.counter("num_envs"), 4)
        self.assertEqual(self.counter("finished_episodes"), ended)
        self.assertEqual(self.counter("terminated"), ended)
        self.assertEqual(self.counter("clamped_commands"), steps // 4)

    def test_an_engine_s_failure_elsewhere_is_counted_and_logged(self):
        self.serve(
            env="Walker2d-v5",
            num_envs=3,
            shown_environment=1,
            reset_noise_scale=1e6,
            terminate_when_unhealthy=False,
            autoreset_mode="disabled",
        )
        step = self.clients["step_batch"]
        self.reset(seeds=[2] * 3)
        for _ in range(300):
            reply = step(actions=[1.0] * 18)
            self.assertTrue(reply.success, reply.status_message)
            if any(reply.terminated):
                break
        self.assertEqual(list(reply.terminated), [1, 1, 1])
        self.assertEqual(self.counter("simulation_errors"), 3)
        self.assertRegex(self.server.output(), "Environment 0: the simulation failed: .*MuJoCo")
        self.reset([0, 1, 2])
        self.assertTrue(step(actions=[1.0] * 18).success)

    def test_a_reset_that_the_engine_refuses_concerns_its_own_environment(self):
        cramped = {**self.cramped_walker(), "max_episode_steps": 10}
        self.serve(**cramped)
        seeds = range(30)
        refused = [not self.clients["reset"](has_seed=True, seed=seed).success for seed in seeds]
        bad = next(seed for seed in seeds if refused[seed])
        good = [seed for seed in seeds if not refused[seed]]
        self.server.stop()
        words = "the simulation failed at its reset"
        for mode in MODES:
            self.serve(**cramped, num_envs=3, shown_environment=1, autoreset_mode=mode)
            undisturbed = self.play_cramped([good[0], good[1], good[2]])
            transitions = self.record("/transition", Transition)
            clock = self.record("/clock", rosgraph_msgs.msg.Clock)
            disturbed = self.play_cramped([good[0], bad, good[2]])
            begun = disturbed[0]
            self.assertTrue(begun.success)
            self.assertEqual(
                begun.status_message, f"environment 1: {words}: MuJoCo: Stack overflow"
            )
            self.assertEqual(row(begun.observations, 1, 17), [0.0] * 17)
            for one, other in zip(undisturbed, disturbed):
                for i in (0, 2):
                    told = row(one.observations, i, 17), row(other.observations, i, 17)
                    self.assertEqual(*map(bits, told))
            first = transitions.wait(lambda m: m.error == "MuJoCo: Stack overflow" and m.step == 0)
            self.assertTrue(first.terminated)
            begin = first_stamp(first)
            stamps = list(range(begin, begin + len(disturbed) * 8_000_000, 8_000_000))
            transitions.at(stamps[-1])
            told = [stamp for stamp in map(first_stamp, transitions.messages()) if stamp >= begin]
            self.assertEqual(told[: len(stamps)], stamps)
            # In the queue newer messages may replace older ones.
            clock.wait(lambda m, last=stamps[-1]: first_stamp(m) >= last)
            if mode == "disabled":
                self.assertEqual(len(disturbed), 1)
                refusal = self.try_step([0.5] * 6).status_message
                self.assertEqual(refusal, f"environment 1: {words}; reset first")
            else:
                self.assertEqual(disturbed[1].steps[1], 0, "its next step is its next reset")
            self.server.stop()

    def play_cramped(self, seeds):
        """Returns the replies to a reset and twelve steps, up to the first refusal."""
        replies = [self.try_reset(seeds=seeds)]
        while replies[-1].success and len(replies) < 13:
            replies.append(self.try_step([0.5] * 6))
        return [reply for reply in replies if reply.success]

    def test_a_thousand_environments(self):
        for env, size, width in (("BipedalWalker-v3", 4, 24), ("Walker2d-v5", 6, 17)):
            self.serve(env=env, num_envs=1024, shown_environment=1023)
            reply = self.reset()
            self.assertEqual(len(reply.observations), 1024 * width)
            for count in range(1, 4):
                reply = self.clients["step_batch"](actions=[0.25] * (1024 * size))
                self.assertTrue(reply.success, reply.status_message)
                self.assertEqual(set(reply.steps), {count})
            self.assertEqual(len(reply.observations), 1024 * width)
            self.server.stop()


if __name__ == "__main__":
    rospy.init_node("batch_test")
    rostest.rosrun("walker_sim", "batch_test", BatchTest, sys.argv)
