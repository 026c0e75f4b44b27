"""Many environments in one server: the shown environment and failures.

promises_test.py compares all replies of ~reset_batch and ~step_batch.
"""

import rosgraph_msgs.msg
from server_harness import (
    FALL,
    MARKERS,
    STATE_TOPICS,
    STATE_VALUES,
    ServerTest,
    bits,
    nanoseconds,
    same_experience,
)
from walker_sim.msg import Episode, EpisodeRecord, Transition

ZERO = [0.0] * 4
OBSERVATION = 24
MODES = ("next_step", "same_step", "disabled")
ROWS = ("observations", "rewards", "terminated", "truncated", "episodes", "steps", "info")
FINAL_ROWS = ("final_environments", "final_observations", "final_info")


def row(values, index, width=OBSERVATION):
    return list(values[index * width : (index + 1) * width])


class BatchTest(ServerTest):
    def serve(self, **parameters):
        self.num_envs = parameters.get("num_envs", 1)
        return super().serve(**{"mode": "lockstep", **parameters})

    def reset(self, environments=(), seeds=()):
        has_seed = [1] * len(seeds)
        return self.ask("reset_batch", environments=environments, has_seed=has_seed, seeds=seeds)

    def step(self, *actions):
        """@param actions: one for all environments, or one per environment"""
        many = actions * self.num_envs if len(actions) == 1 else actions
        return self.ask("step_batch", actions=[value for action in many for value in action])

    def test_paused_server_steps(self):
        self.serve(mode="free", paused=True)
        first = self.step(ZERO)
        self.assertEqual(self.step(ZERO).steps[0], first.steps[0] + 1)
        self.assertEqual(self.reset(seeds=[5]).observations, self.reset([0], [5]).observations)

    def test_every_call_advances_the_clock_by_dt(self):
        self.serve(num_envs=3, shown_environment=1)
        clock = self.record("/clock", rosgraph_msgs.msg.Clock)
        transitions = self.record("/transition", Transition)
        self.reset(seeds=[1, 2, 3])
        begin = nanoseconds(transitions.wait())
        self.step(ZERO)
        clock.at(begin + self.dt)
        self.reset([0, 2])  # not the shown environment
        clock.at(begin + 2 * self.dt)
        self.step(ZERO)
        clock.at(begin + 3 * self.dt)
        self.reset([1])
        clock.at(begin + 4 * self.dt)
        states = transitions.wait_count(4)
        self.assertEqual([(nanoseconds(m) - begin) // self.dt for m in states], [0, 1, 3, 4])
        self.assertEqual([state.step for state in states], [0, 1, 2, 0])

    def test_topics_show_the_shown_environment(self):
        for mode in MODES:
            with self.subTest(mode=mode):
                self.serve(num_envs=3, shown_environment=1, autoreset_mode=mode)
                self.compare_topics(mode)

    def compare_topics(self, mode):
        recorders = {topic: self.record(topic, kind) for topic, kind in STATE_TOPICS.items()}
        rewards, observations = (self.record(*topic) for topic in STATE_VALUES.items())
        scenes, texts = (self.record(*topic) for topic in MARKERS.items())
        episodes = self.record("/episode", Episode)
        published, total = [], 0.0
        for calls, states in enumerate(self.play_shown(mode), start=1):
            for step, observation, reward, ended in states:
                count = len(published) + 1
                published = recorders["/transition"].wait_count(count)[:count]
                last = published[-1]
                total = 0.0 if step == 0 else total + reward
                self.assertEqual((last.environment, last.step), (1, step))
                self.assertEqual(bits(last.observation), bits(observation))
                self.assertEqual((last.reward, last.episode_return), (reward, total))
                self.assertEqual((last.terminated, last.truncated), (ended, False))
                self.assertEqual(list(last.action), FALL if step else [])
                self.assertEqual(last.error, "")
            # If a call makes two states, sensors, reward and observation show only the newer one.
            for recorder in recorders.values():
                recorder.at(nanoseconds(last))
            rewards.wait(lambda m, last=last: m.data == last.reward, "the reward")
            observations.wait(lambda m, last=last: bits(m.data) == bits(last.observation))
            texts.wait_count(calls)
        self.assert_consecutive(published)
        for state in published:
            recorders["/clock"].at(nanoseconds(state))
            recorders["/tf"].at(nanoseconds(state))
        recorders.pop("/clock")  # a new subscription repeats the time
        for topic, recorder in recorders.items():
            stamps = recorder.stamps()
            self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])), topic)
        self.compare_episodes(episodes, published)
        scenes.wait_count(sum(state.step == 0 for state in published))

    def play_shown(self, mode):
        """Steps until the shown environment has fallen twice.

        Yields its new states after each call: (step, observation, reward, whether it ended).
        """
        begun = self.reset(seeds=[1, 2, 3])
        yield [(0, row(begun.observations, 1), 0.0, False)]
        falls, step = 0, 0
        while falls < 2:
            reply = self.step(ZERO, FALL, ZERO)
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

    def compare_episodes(self, episodes, published):
        ends = [state for state in published if state.terminated]
        begins = [state for state in published if state.step == 0]
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
            seed = (True, 2) if state.episode == 1 else (False, 0)
            self.assertEqual((begun.has_seed, begun.seed), seed)
        self.assertEqual(len({message.generator_state for message in kept}), len(begins))

    def test_the_shown_environments_episodes_are_recorded(self):
        """At their end or the reset that abandons them, for a restore on another server."""
        self.serve(num_envs=3, shown_environment=2)
        transitions = self.record("/transition", Transition)
        records = self.record("/episode_record", EpisodeRecord)
        self.reset(seeds=[1, 2, 3])
        while not self.step(ZERO, ZERO, FALL).terminated[2]:
            pass
        for _ in range(5):
            last = self.step(ZERO, ZERO, FALL)
        self.reset(environments=[0])
        self.assertFalse(self.call("reset_batch", environments=[2, 2]).success)
        self.reset(environments=[2])
        state = transitions.wait(lambda m: (m.episode, m.step) == (2, last.steps[2]), "the state")
        ended, abandoned = records.wait_count(2)
        self.assertRegex(ended.episode.end_reason, "^terminated: .+")
        self.assertEqual(abandoned.episode.end_reason, "reset before its end")
        self.assertEqual((abandoned.episode.episode, abandoned.episode.length), (2, state.step))
        self.serve(publish_clock=False)
        restored = self.ask("restore", record=abandoned)
        self.assertTrue(same_experience(restored.transition, state))

    def test_engine_failure_in_another_environment_is_counted_and_logged(self):
        self.serve(
            env="Walker2d-v5",
            num_envs=3,
            shown_environment=1,
            reset_noise_scale=1e6,
            terminate_when_unhealthy=False,
            autoreset_mode="disabled",
        )
        step = self.client("step_batch")
        transitions = self.record("/transition", Transition)
        self.reset(seeds=[2] * 3)
        for _ in range(300):
            reply = step(actions=[1.0] * 18)
            self.assertTrue(reply.success, reply.status_message)
            if any(reply.terminated):
                break
        self.assertEqual(list(reply.terminated), [1, 1, 1])
        self.assertTrue(transitions.wait(lambda m: "MuJoCo" in m.error).terminated)
        self.assertEqual(self.counter("simulation_errors"), 3)
        self.assertRegex(self.server.output(), "Environment 0: the simulation failed: .*MuJoCo")
        refused = step(actions=[1.0] * 18)
        self.assertFalse(refused.success)
        for name in ROWS + FINAL_ROWS:
            self.assertEqual(len(getattr(refused, name)), 0, name)
        self.reset([0, 1, 2])
        self.assertTrue(step(actions=[1.0] * 18).success)
