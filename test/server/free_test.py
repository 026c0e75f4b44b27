"""A free-running server: resets, pausing, the same bits at any pace, and effort commands."""

import time

from processes import wait_for
from server_harness import (
    DT,
    STATE_TOPICS,
    TransitionsTest,
    bits,
    first_stamp,
    nanoseconds,
    same_experience,
)
from std_msgs.msg import Float64MultiArray
from walker_sim.msg import Episode

ZERO = [0.0] * 4
STAND = [80.0, 80.0, -80.0, 80.0]  # [N m]; while it is held, the walker stands astride
QUIET = 0.3  # wall seconds in which 15 steps would pass, or more at a higher pace


class FreeTest(TransitionsTest):
    def assert_nothing_moves(self):
        """Asks the server, because messages from before may still be in flight."""
        before = self.ask("snapshot").record
        time.sleep(QUIET)
        self.assertEqual(self.ask("snapshot").record, before)

    def test_resets_itself_at_the_start_and_after_each_end(self):
        # autoreset_mode is for ~step_batch, and auto_reset for a server that steps by itself.
        modes = {"auto_reset": True, "autoreset_mode": "same_step"}
        self.serve(seed=str(2**64 - 1), max_episode_steps=25, real_time_factor=2.0, **modes)
        self.assertEqual(self.call("get_spec").spec.autoreset_mode, "next_step")
        episodes = self.record("/episode", Episode)
        self.transitions.wait(lambda m: m.episode == 4 and m.step == 5, "the fourth episode")
        transitions = self.transitions.messages()
        self.assert_consecutive(transitions)
        self.assertEqual({m.step for m in transitions if m.truncated}, {25})
        self.assertFalse(any(m.terminated for m in transitions))
        published = {(m.episode, m.length): m for m in episodes.messages()}
        for number in (3, 4):
            begun = published[number, 0]
            self.assertFalse(begun.has_seed)
            self.assertEqual(begun.end_reason, "")
        self.assertRegex(published[3, 25].end_reason, "^truncated: .*25")
        self.assertNotEqual(published[3, 0].generator_state, published[4, 0].generator_state)
        self.assertEqual(published[3, 0].generator_state, published[3, 25].generator_state)

    def test_seed_parameter_is_used_by_the_first_reset_and_published(self):
        seeds = []
        for seed in (str(2**64 - 1), 0, "", ""):  # roslaunch passes digits as an integer
            self.serve(seed=seed, paused=True)
            episode = self.record("/episode", Episode).wait()
            self.assertEqual((episode.episode, episode.has_seed), (1, True))
            seeds.append(episode.seed)
            if seed == 0:
                self.assert_nothing_moves()
            first = self.call("step", action=ZERO).transition
            self.call("reset", has_seed=True, seed=episode.seed)
            again = self.call("step", action=ZERO).transition
            self.assertEqual(bits(again.observation), bits(first.observation))
        self.assertEqual(seeds[:2], [2**64 - 1, 0])
        self.assertNotEqual(*seeds[2:], "drawn seeds differ")

    def assert_step_is_refused(self, words):
        reply = self.call("step", action=[1.0] * 4)
        self.assertFalse(reply.success)
        self.assertIn(words, reply.status_message)

    def test_without_auto_reset_time_stops_at_the_end(self):
        self.serve(auto_reset=False, max_episode_steps=20, real_time_factor=10.0)
        self.assertEqual(self.call("get_spec").spec.autoreset_mode, "disabled")
        following = self.call("reset", has_seed=True, seed=3).transition
        for _ in range(2):
            number = following.episode
            last = self.transitions.wait(
                lambda m, n=number: m.episode == n and m.truncated, "the end"
            )
            self.assert_nothing_moves()
            self.assert_step_is_refused("the episode has ended")
            following = self.call("reset", has_seed=True, seed=3).transition
            self.assertEqual(nanoseconds(following), nanoseconds(last) + DT)
            self.assertEqual((following.episode, following.step), (last.episode + 1, 0))
        self.transitions.wait(
            lambda m: m.episode == following.episode and m.truncated, "the next end"
        )
        self.assertTrue(self.call("pause").success)
        self.assert_step_is_refused("reset")

    def test_a_subscriber_that_connects_in_a_pause_gets_the_present_state_once(self):
        self.serve(paused=True, seed="3")
        self.ask("step", action=ZERO)
        earlier = [self.record(topic, STATE_TOPICS[topic]) for topic in ("/tf", "/joint_states")]
        for recorder in earlier:
            recorder.wait()
        late = [self.subscribe(topic, STATE_TOPICS[topic]) for topic in ("/tf", "/joint_states")]
        stamp = nanoseconds(self.ask("snapshot").record.episode)
        self.assertEqual([first_stamp(subscriber.next()) for subscriber in late], [stamp] * 2)
        self.assert_nothing_moves()
        for step in (1, 2):
            self.ask("step", action=ZERO)
            stamps = [first_stamp(subscriber.next()) for subscriber in late]
            self.assertEqual(stamps, [stamp + step * DT] * 2)
        for recorder in earlier:
            stamps = [first_stamp(message) for message in recorder.wait_count(3)]
            self.assertEqual(stamps, [stamp, stamp + DT, stamp + 2 * DT])

    def test_paused_server_moves_only_by_step(self):
        self.serve(real_time_factor=10.0)
        self.transitions.wait_count(5)
        self.ask("pause")
        self.assert_nothing_moves()
        action = [0.5, -0.25, 0.125, 1.0]
        one = self.ask("step", action=action)
        self.assertEqual(bits(one.transition.action), bits(action))
        published = self.transitions.at(nanoseconds(one.transition))
        self.assertTrue(same_experience(published, one.transition))
        self.assert_nothing_moves()  # exactly one step
        two = self.call("step", action=action)
        self.assert_consecutive([one.transition, two.transition])
        begun = self.call("reset", has_seed=True, seed=1).transition
        self.assertEqual(nanoseconds(begun), nanoseconds(two.transition) + DT)
        self.assert_nothing_moves()  # a reset does not end the pause
        self.assertTrue(self.call("unpause").success)
        self.transitions.at(nanoseconds(begun) + 20 * DT)
        messages = self.transitions.messages()
        self.assert_consecutive([m for m in messages if nanoseconds(m) >= nanoseconds(begun)])

    def test_pauses_and_pace_change_no_bit(self):
        for env, size in (("BipedalWalker-v3", 4), ("Walker2d-v5", 6)):
            self.serve(env=env, paused=True, auto_reset=False, max_episode_steps=40)
            stepped = [self.call("reset", has_seed=True, seed=5).transition]
            stepped += [self.call("step", action=[0.0] * size).transition for _ in range(40)]
            for factor in (1.0, 20.0, 0.0):
                self.call("pause")
                self.call("set_real_time_factor", factor=factor)
                run = [self.call("reset", has_seed=True, seed=5).transition]
                self.transitions.at(nanoseconds(run[0]))
                self.transitions.clear()
                for count in (1, 10, 40):  # with pauses between
                    self.call("unpause")
                    self.transitions.wait_count(count)
                    self.call("pause")
                run += self.transitions.messages()
                self.assert_same_experiences(run, stepped)

    def drive(self, efforts):
        """Begins an episode under this command from its first step. Returns the publisher."""
        command = self.commander()
        self.drive_by(command, Float64MultiArray(data=efforts))
        return command

    def drive_by(self, command, message):
        """Publishes between the reset, which clears the held command, and the first step."""
        self.call("pause")
        self.call("reset", has_seed=True, seed=1)
        command.publish(message)
        time.sleep(0.3)  # if it arrives later, the walker only sags a little first
        self.call("unpause")
        self.transitions.wait(lambda m: any(m.action), "the command")

    def driven(self):
        """Transitions so far whose action is not zero."""
        return [m for m in self.transitions.messages() if any(m.action)]

    def test_command_is_held_in_newton_metres_until_the_next(self):
        self.serve(command_timeout=0.0, real_time_factor=2.0)
        command = self.drive(STAND)
        for efforts in ([79.3, 61.7, -55.1, 80.0], [42.0, 60.0, -80.0, 47.11], [40.0] * 4):
            command.publish(data=efforts)
            expected = bits([effort / 80 for effort in efforts])
            held = self.transitions.wait(lambda m, e=expected: bits(m.action) == e, "the command")
            command.publish(data=STAND[:3])  # refused
            later = nanoseconds(held) + 30 * DT
            self.assertEqual(bits(self.transitions.at(later).action), expected)
        self.assertEqual([self.counter(word) for word in ("timeouts", "refused")], [0, 3])

    def test_timeout_is_in_simulation_time(self):
        # The default of 0.5 s is 25 steps at any pace.
        for factor in (1.0, 8.0):
            self.serve(real_time_factor=factor)
            self.drive(STAND)
            begun = nanoseconds(self.driven()[0])
            self.transitions.at(begun + 40 * DT)
            driven = self.driven()
            self.assert_consecutive(driven)
            self.assertIn(len(driven), (24, 25, 26))
            after = self.transitions.at(nanoseconds(driven[-1]) + DT)
            self.assertEqual(list(after.action), ZERO)

    def test_new_command_renews_the_timeout(self):
        self.serve(command_timeout=2.0)
        command = self.drive(STAND)
        first = self.driven()[0]

        def renew():
            command.publish(data=STAND)
            time.sleep(0.2)
            return self.simulated_since(first) >= 2.5

        wait_for(renew, "2.5 s of simulation time")
        self.assertGreater(len(self.driven()), 120)
        self.assert_consecutive(self.driven())

    def test_timeout_is_in_wall_time_at_unlimited_pace(self):
        self.serve(command_timeout=1.0, real_time_factor=0.0, max_episode_steps=0)
        begin = time.monotonic()
        self.drive(STAND)
        first = self.driven()[0]
        self.transitions.wait(
            lambda m: nanoseconds(m) > nanoseconds(first) and not any(m.action), "the timeout"
        )
        self.assertGreater(time.monotonic() - begin, 0.8)
        simulated = nanoseconds(self.driven()[-1]) - nanoseconds(first)
        self.assertGreater(simulated, 55 * DT, "that was the timeout in simulation time")
        self.assertGreater(self.counter("timeouts"), 0)

    def simulated_since(self, message):
        """Simulation time [s] from this transition to the newest."""
        return (nanoseconds(self.transitions.messages()[-1]) - nanoseconds(message)) / 1e9

    def test_timeout_follows_the_real_time_factor(self):
        self.serve(command_timeout=20.0, max_episode_steps=0)
        self.drive(STAND)
        first = self.driven()[0]
        self.assertTrue(self.call("set_real_time_factor", factor=0.0).success)
        # Three times the timeout in simulation time; at factor 0 the timeout is in wall time.
        wait_for(lambda: self.simulated_since(first) > 60, "a minute of simulation time")
        self.assertEqual(self.counter("timeouts"), 0)
        self.call("pause")
        # Slow enough that no queue drops a transition.
        self.assertTrue(self.call("set_real_time_factor", factor=10.0).success)
        changed = self.call("step", action=STAND).transition
        self.call("unpause")
        late = self.transitions.wait(
            lambda m: nanoseconds(m) > nanoseconds(changed) and not any(m.action), "the timeout"
        )
        # The command keeps its age from wall time.
        simulated = (nanoseconds(late) - nanoseconds(changed)) / 1e9
        self.assertLess(simulated, 20.1, "that was the timeout in wall time")
        self.assertEqual(self.counter("timeouts"), 1)

    def test_timeout_0_means_never(self):
        for factor in (40.0, 0.0):
            self.serve(command_timeout=0.0, real_time_factor=factor, max_episode_steps=0)
            self.drive(STAND)
            first = self.driven()[0]
            begin = time.monotonic()
            wait_for(lambda n=first: self.simulated_since(n) > 20, "20 s of simulation time")
            time.sleep(max(0.0, begin + 1 - time.monotonic()))
            after = [m for m in self.transitions.messages() if m.step > first.step]
            self.assertTrue(all(any(m.action) for m in after if m.episode == first.episode))
            self.assertEqual(self.counter("timeouts"), 0)

    def test_reset_and_autoreset_clear_the_held_command(self):
        self.serve(command_timeout=0.0, real_time_factor=2.0, max_episode_steps=60)
        self.drive(STAND)
        driven = self.driven()[0]
        end = self.transitions.wait(
            lambda m: m.episode == driven.episode and m.truncated, "the time limit"
        )
        self.assertTrue(any(end.action), "held to the end")
        self.transitions.at(nanoseconds(end) + 20 * DT)
        self.drive(STAND)
        begun = self.call("reset", has_seed=True, seed=1).transition
        self.transitions.at(nanoseconds(begun) + 20 * DT)
        for message in self.transitions.messages():
            if message.episode in (driven.episode + 1, begun.episode) and message.step > 0:
                self.assertEqual(list(message.action), ZERO)

    def begin_without_command(self):
        """Returns the first 41 transitions of a running seeded episode."""
        number = self.call("reset", has_seed=True, seed=7).transition.episode
        self.call("unpause")
        self.transitions.wait(lambda m: (m.episode, m.step) == (number, 40), "40 steps")
        return [m for m in self.transitions.messages() if m.episode == number][:41]

    def test_seeded_reset_after_violent_commands_equals_a_fresh_server_s(self):
        walker2d = {"env": "Walker2d-v5", "terminate_when_unhealthy": False}
        for effort, parameters in ((80.0, {}), (100.0, walker2d)):
            self.serve(command_timeout=0.0, paused=True, **parameters)
            fresh = self.begin_without_command()
            command = self.commander()
            # BipedalWalker stands under the last, which is therefore still held at the reset.
            for action in ([-3, 3, 3, -3, 3, 3], [3e4, -3e4] * 3, [3, 3, -3, 3, -3, -3]):
                action = action[: len(fresh[1].action)]
                self.transitions.clear()
                self.drive_by(command, Float64MultiArray(data=[effort * a for a in action]))
                self.transitions.wait(lambda m, a=action: m.step > 5 and list(m.action) == a)
            again = self.begin_without_command()
            self.assert_same_experiences(again, fresh)
