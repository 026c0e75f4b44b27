"""~set_state: what is published, recorded and refused. promises_test.py compares the bits."""

import copy
import math

from processes import LoggedProcess
from server_harness import ServerTest, bits, nanoseconds, random_actions, same_experience
from std_msgs.msg import Float64MultiArray
from walker_sim.msg import Episode, EpisodeRecord, Transition

STANDING = {"position": [0.5, 1.25, 0.1, 0.0, -0.2, 0.1], "velocity": [0.5, 0.0, 0.1] + [0.0] * 3}
LYING = {**STANDING, "position": [0.0, 0.1] + [0.0] * 4}
TYPED = "{position: [0, 1.25, 0, 0, 0, 0], velocity: [1, 0, 0, 0, 0, 0]}"


class SetStateTest(ServerTest):
    dt = 8_000_000

    def serve(self, **parameters):
        return super().serve(**{"mode": "lockstep", "env": "Hopper-v5", **parameters})

    def test_published_and_recorded(self):
        self.serve()
        transitions = self.record("/transition", Transition)
        episodes = self.record("/episode", Episode)
        records = self.record("/episode_record", EpisodeRecord)
        self.ask("reset", has_seed=True, seed=5)
        before = self.play(random_actions(3, 4))[-1]
        reply = self.ask("set_state", **STANDING).transition
        self.assertEqual((reply.episode, reply.step, reply.reward), (1, 4, 0))
        self.assertEqual(reply.episode_return, before.episode_return)
        self.assertEqual(bits(reply.observation[:5]), bits(STANDING["position"][1:]))
        self.assertEqual(nanoseconds(reply), nanoseconds(before) + self.dt)
        self.assertTrue(same_experience(transitions.at(nanoseconds(reply)), reply))
        self.ask("set_state", **LYING)
        ended = self.play(random_actions(3, 1))[-1]
        self.assertTrue(ended.terminated)
        records.wait(lambda m: m.episode.length == 5)
        continued = self.ask("set_state", **STANDING).transition  # an ended episode
        episodes.wait(lambda m: nanoseconds(m) == nanoseconds(continued) and not m.end_reason)
        future = self.play(random_actions(3, 3))
        record = self.ask("snapshot").record
        self.assertEqual([each.step for each in record.coordinates], [4, 4, 5])
        self.assertEqual(bits(record.coordinates[1].position), bits(LYING["position"]))
        self.assertEqual(len(record.checksums), 9)
        restored = self.ask("restore", record=record).transition
        self.assertTrue(same_experience(restored, future[-1]))
        self.assertEqual(self.ask("snapshot").record.coordinates, record.coordinates)
        self.assertEqual(self.ask("snapshot").record.checksums, record.checksums)
        wrong = copy.deepcopy(record)
        wrong.coordinates[2].velocity = [0.0] * 5
        reply = self.call("restore", record=wrong)
        words = "coordinates[2]: qvel has 5 values; must have 6, one per coordinate"
        self.assertEqual((reply.success, reply.status_message), (False, words))

    def test_refusals_change_nothing(self):
        self.serve(num_envs=2, shown_environment=1)
        words = "set_state: there is no episode yet; reset first"
        self.assertEqual(self.call("set_state", **STANDING).status_message, words)
        self.ask("reset_batch", has_seed=[True] * 2, seeds=[1, 2])
        before = self.ask("step_batch", actions=[0.5] * 6)
        for fields, words in (
            ({}, "qpos has 0 values; must have 6, one per coordinate"),
            ({"velocity": [0.0] * 7}, "qvel has 7 values; must have 6, one per coordinate"),
            ({"position": [0.0] * 5 + [math.nan]}, r"qpos[5] = nan; must be finite"),
            ({"velocity": [-math.inf] + [0.0] * 5}, r"qvel[0] = -inf; must be finite"),
            ({"environment": 2}, "environment = 2; must be below num_envs = 2"),
        ):
            reply = self.call("set_state", **({**STANDING, **fields} if fields else {}))
            self.assertEqual((reply.success, reply.status_message), (False, words))
        after = self.ask("step_batch", actions=[0.5] * 6)
        self.ask("reset_batch", has_seed=[True] * 2, seeds=[1, 2])
        again = [self.ask("step_batch", actions=[0.5] * 6) for _ in range(2)]
        self.assertEqual(
            [bits(each.observations) for each in again],
            [bits(each.observations) for each in (before, after)],
        )
        self.serve(env="BipedalWalker-v3")
        self.ask("reset")
        words = "BipedalWalker-v3 has no positions and velocities that can be set"
        self.assertIn(words, self.call("set_state", **STANDING).status_message)

    def test_after_a_failure_only_a_reset_helps(self):
        model = self.model_file(('gear="100"', 'gear="1e14"'))
        self.serve(env="Walker2d-v5", xml_file=model, terminate_when_unhealthy=False)
        self.ask("reset", has_seed=True, seed=1)
        self.assertIn("MuJoCo", self.play([[1.0] * 6] * 50)[-1].error)
        reply = self.call("set_state", position=[0.0, 1.25] + [0.0] * 7, velocity=[0.0] * 9)
        self.assertEqual(reply.status_message, "set_state: the simulation failed; reset first")

    def test_free_running_server_is_set_while_it_is_paused(self):
        self.serve(mode="free", command_timeout=0.0)
        transitions = self.record("/transition", Transition)
        words = "set_state: mode is free and the simulation runs; call ~pause first"
        self.assertIn(words, self.call("set_state", **STANDING).status_message)
        commands = self.commander()

        def is_held(message):
            commands.publish(Float64MultiArray(data=[20.0] * 3))
            return message.step > 0 and list(message.action) == [0.1] * 3

        transitions.wait(is_held)
        self.ask("pause")
        reply = self.ask("set_state", **STANDING).transition
        self.ask("unpause")
        first = transitions.wait(lambda m: (m.episode, m.step) == (reply.episode, reply.step + 1))
        self.assertEqual(list(first.action), [0.0] * 3, "the held command is cleared")

    def test_it_can_be_typed(self):
        self.serve()
        self.ask("reset")
        typed = LoggedProcess(["rosservice", "call", "/walker_sim/set_state", TYPED])
        self.assertEqual(typed.wait(), 0, typed.output())
        self.assertIn("success: True", typed.output())
