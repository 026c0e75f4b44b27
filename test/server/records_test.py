"""~snapshot and ~restore: contents, publication and concurrent calls.

promises_test.py continues episodes of all environments on another server.
"""

import copy
import signal
import time

from server_harness import ServerTest, bits, nanoseconds, random_actions, same_experience
from std_msgs.msg import Float64MultiArray
from walker_sim.msg import Episode, EpisodeRecord, Transition


class RecordsTest(ServerTest):
    long_record = None  # made by the first test that needs it

    def test_snapshot_has_the_episode(self):
        self.serve(mode="lockstep", env="Walker2d-v5")
        self.ask("reset", has_seed=True, seed=2**64 - 1)
        played = random_actions(6, 4, 3)
        last = self.play(played)[-1]
        record = self.ask("snapshot").record
        self.assertEqual(str(record.spec), str(self.call("get_spec").spec), "NaN included")
        self.assertEqual(
            bits(record.actions), bits([value for action in played for value in action])
        )
        episode = record.episode
        self.assertEqual((episode.has_seed, episode.seed), (True, 2**64 - 1))
        self.assertEqual((episode.episode, episode.length, episode.end_reason), (1, 4, ""))
        self.assertEqual(episode.episode_return, last.episode_return)
        self.assertEqual(nanoseconds(episode), nanoseconds(last))

    def test_restore_is_published_like_a_reset(self):
        self.serve(mode="lockstep")
        episodes = self.record("/episode", Episode)
        records = self.record("/episode_record", EpisodeRecord)
        transitions = self.record("/transition", Transition)
        self.ask("reset", has_seed=True, seed=5)
        self.play(random_actions(4, 7, 1))
        record = self.ask("snapshot").record
        last = self.play(random_actions(4, 3, 2))[-1]
        reply = self.ask("restore", record=record).transition
        self.assertEqual((reply.episode, reply.step), (2, 7))
        self.assertEqual(nanoseconds(reply), nanoseconds(last) + self.dt)
        self.assertTrue(same_experience(transitions.at(nanoseconds(reply)), reply))
        episode = episodes.wait(lambda m: m.episode == 2)
        self.assertEqual((episode.length, episode.end_reason), (7, ""))
        self.assertEqual((episode.has_seed, episode.seed), (True, 5))
        self.assertEqual(nanoseconds(episode), nanoseconds(reply))
        abandoned = records.wait()
        self.assertEqual(abandoned.episode.end_reason, "reset before its end")
        self.assertEqual((abandoned.episode.episode, abandoned.episode.length), (1, 10))
        self.assertEqual(nanoseconds(abandoned.episode), nanoseconds(last))
        self.assertEqual(bits(abandoned.actions[: 7 * 4]), bits(record.actions))
        self.assertEqual(abandoned.checksums[:8], record.checksums)
        self.assertEqual(len(abandoned.checksums), 11)

    def test_free_running_server_continues_a_restored_episode(self):
        self.serve(real_time_factor=5.0)
        transitions = self.record("/transition", Transition)
        self.ask("reset", has_seed=True, seed=5)
        transitions.wait(lambda m: m.episode == 2 and m.step == 20)
        self.ask("pause")
        record = self.ask("snapshot").record
        self.assertGreaterEqual(record.episode.length, 20)
        future = self.play([[0.0] * 4] * 20)
        self.ask("unpause")
        reply = self.ask("restore", record=record).transition
        self.assertEqual(reply.episode, 3)
        self.assertEqual(reply.step, record.episode.length)
        last = transitions.wait(lambda m: m.episode == 3 and m.step == future[-1].step)
        self.assertTrue(same_experience(last, future[-1]))
        stamps = transitions.stamps()
        self.assertEqual(stamps, sorted(set(stamps)))

    def test_failed_episode_is_restored_as_failed(self):
        model = self.model_file(('gear="100"', 'gear="1e14"'))
        self.serve(
            mode="lockstep", env="Walker2d-v5", xml_file=model, terminate_when_unhealthy=False
        )
        self.ask("reset", has_seed=True, seed=1)
        failed = self.play([[1.0] * 6] * 50)[-1]
        self.assertIn("MuJoCo", failed.error)
        record = self.ask("snapshot").record
        self.ask("reset", has_seed=True, seed=2)
        reply = self.ask("restore", record=record).transition
        self.assertTrue(same_experience(reply, failed))
        self.assertEqual(self.ask("reset").transition.step, 0)

    def test_model_file_is_read_once(self):
        model = self.model_file()
        self.serve(mode="lockstep", env="Walker2d-v5", xml_file=model)
        self.ask("reset", has_seed=True, seed=1)
        record = self.ask("snapshot").record
        future = self.play(random_actions(6, 20, 1))
        with open(model, "w", encoding="utf-8") as file:
            file.write("no model any more")
        self.ask("restore", record=record)
        self.assert_same_experiences(self.play(random_actions(6, 20, 1)), future)

    def test_ended_episode_is_restored_as_ended(self):
        self.serve(auto_reset=False, max_episode_steps=5, real_time_factor=10.0)
        transitions = self.record("/transition", Transition)
        begun = self.ask("reset", has_seed=True, seed=5).transition
        end = transitions.wait(lambda m: m.truncated and m.episode == begun.episode)
        record = self.ask("snapshot").record
        self.ask("reset", has_seed=True, seed=6)
        self.ask("pause")
        reply = self.ask("restore", record=record).transition
        self.assertTrue(same_experience(reply, end))
        self.ask("unpause")
        self.assertEqual(self.ask("snapshot").record.episode.episode, reply.episode, "stands still")

    def test_restore_clears_the_held_command(self):
        self.serve(command_timeout=0.0, real_time_factor=5.0)
        transitions = self.record("/transition", Transition)
        record = self.ask("snapshot").record
        commands = self.commander()

        def held(message):
            commands.publish(Float64MultiArray(data=[8.0] * 4))
            return message.step > 0 and list(message.action) == [0.1] * 4

        transitions.wait(held)
        time.sleep(0.2)  # for commands in flight
        reply = self.ask("restore", record=record).transition
        first = transitions.wait(lambda m: (m.episode, m.step) == (reply.episode, reply.step + 1))
        self.assertEqual(list(first.action), [0.0] * 4)

    def serve_long_record(self, **parameters):
        """Serves a Walker2d. Returns a record that takes long to restore, and its last transition.

        The duration depends on the machine, so tests send concurrent calls while the server is
        halted.
        """
        lasting = {"terminate_when_unhealthy": False, "max_episode_steps": 0}
        self.serve(env="Walker2d-v5", **lasting, **parameters)
        if not self.long_record:
            reset, step = self.client("reset"), self.client("step")
            reset(has_seed=True, seed=1)
            for action in random_actions(6, 8000, 1):
                last = step(action=action).transition
            RecordsTest.long_record = self.ask("snapshot").record, last
        return self.long_record

    def send_all_but_the_end(self, restoring, get_spec, record):
        """Waits until the server has read the part. Returns the rest, which starts the restore."""
        request = restoring.request_bytes(record=record)
        restoring.connection.sendall(request[:-1])
        self.pass_turns(get_spec)
        return request[-1:]

    def pass_turns(self, get_spec):
        """Waits for at least 50 turns of the server, which makes at most 8 calls per turn."""
        for _ in range(400):
            self.assertEqual(get_spec().spec.id, "Walker2d-v5")

    def test_other_clients_are_served_during_a_restore(self):
        record, present = self.serve_long_record(mode="lockstep")
        begun = self.ask("reset", has_seed=True, seed=2).transition
        restoring = self.client("restore")  # the server reads the first connection first
        get_spec, step = self.client("get_spec"), self.client("step")
        rest = self.send_all_but_the_end(restoring, get_spec, record)
        with self.server.halted():
            restoring.connection.sendall(rest)
            for _ in range(20):
                get_spec.send()
                step.send(action=[0.0] * 6)
        for count in range(1, 21):
            self.assertEqual(get_spec.receive().spec.id, "Walker2d-v5")
            other = step.receive().transition
            self.assertEqual((other.episode, other.step), (begun.episode, count), "not disturbed")
        restored = restoring.receive().transition
        self.assertTrue(same_experience(restored, present))
        self.assertEqual(restored.episode, begun.episode + 1)
        self.assertEqual(bits(self.ask("snapshot").record.actions), bits(record.actions))

    def test_reset_during_a_restore_does_not_affect_it(self):
        record, present = self.serve_long_record(mode="lockstep")
        self.ask("restore", record=record)
        future = self.play(random_actions(6, 100, 2))
        following = self.ask("reset").transition
        restoring, reset = self.client("restore"), self.client("reset")
        rest = self.send_all_but_the_end(restoring, self.client("get_spec"), record)
        with self.server.halted():
            restoring.connection.sendall(rest)
            for _ in range(20):
                reset.send(has_seed=True, seed=3)
        stamps = [reset.receive().transition for _ in range(20)]
        restored = restoring.receive().transition
        self.assertTrue(same_experience(restored, present))
        self.assertEqual(restored.episode, stamps[-1].episode + 1)
        self.assertGreater(nanoseconds(restored), nanoseconds(stamps[-1]))
        self.assert_same_experiences(self.play(random_actions(6, 100, 2)), future)
        self.assertTrue(same_experience(self.ask("reset").transition, following))

    def test_restores_are_executed_in_order(self):
        record, present = self.serve_long_record(mode="lockstep")
        self.ask("reset", has_seed=True, seed=4)
        short = self.ask("snapshot").record
        bad = copy.deepcopy(record)
        bad.checksums = [*bad.checksums[:-1], 0]
        clients = [self.client("restore") for _ in range(3)]
        get_spec = self.client("get_spec")
        records = (record, bad, short)
        rests = [
            self.send_all_but_the_end(client, get_spec, each)
            for client, each in zip(clients, records)
        ]
        # The server reads a long request in several turns, so a short one could overtake it.
        with self.server.halted():
            for client, rest in zip(clients, rests):
                client.connection.sendall(rest)
        replies = [client.receive() for client in clients]
        self.assertEqual([reply.success for reply in replies], [True, False, True])
        self.assertTrue(same_experience(replies[0].transition, present))
        self.assertIn("of the record: checksum = 0; repeated here", replies[1].status_message)
        first, last = replies[0].transition, replies[2].transition
        self.assertEqual((last.episode, last.step), (first.episode + 1, 0))

    def test_restore_is_cancelled_if_its_client_disconnects(self):
        record, _ = self.serve_long_record(mode="lockstep")
        begun = self.ask("reset", has_seed=True, seed=2).transition
        short = self.ask("snapshot").record
        gone = [self.client("restore") for _ in range(2)]
        get_spec = self.client("get_spec")
        with self.server.halted():
            for client in gone:
                client.send(record=record)
                client.close()
        self.pass_turns(get_spec)  # the server reads their requests
        restored = self.ask("restore", record=short).transition
        self.assertTrue(same_experience(restored, begun))
        self.assertEqual(restored.episode, begun.episode + 1, "the only one that was restored")

    def test_signal_cancels_pending_restores(self):
        record, _ = self.serve_long_record(mode="lockstep")
        get_spec = self.client("get_spec")
        restoring = [self.client("restore") for _ in range(20)]  # seconds of work
        for client in restoring:
            client.send(record=record)
        self.pass_turns(get_spec)
        self.assertEqual(self.server.stop(signal.SIGINT), 0, self.server.output())
        with self.assertRaises(ConnectionError):
            restoring[-1].receive()

    def test_free_running_server_steps_during_a_restore(self):
        self.dt = 8_000_000
        record, present = self.serve_long_record(real_time_factor=10.0, paused=True)
        transitions = self.record("/transition", Transition)
        begun = self.ask("reset", has_seed=True, seed=2).transition
        self.ask("unpause")
        restoring = self.client("restore")
        restoring.send(record=record)
        reply = restoring.receive().transition
        self.assertTrue(same_experience(reply, present))
        transitions.wait(lambda m: m.episode == reply.episode and m.step > reply.step + 10)
        states = transitions.messages()
        self.assertGreater(sum(m.episode == begun.episode for m in states), 10)
        self.assert_consecutive([m for m in states if m.episode == begun.episode])
        self.assert_consecutive([m for m in states if m.episode == reply.episode])

    def test_snapshot_and_restore_are_refused_with_reuse_world(self):
        self.serve(mode="lockstep")
        self.ask("reset", has_seed=True, seed=1)
        record = self.ask("snapshot").record
        self.serve(mode="lockstep", reuse_world=True)
        self.ask("reset", has_seed=True, seed=1)
        for name, fields in (("snapshot", {}), ("restore", {"record": record})):
            reply = self.call(name, **fields)
            self.assertFalse(reply.success)
            self.assertIn("reuse_world", reply.status_message)
        records = self.record("/episode_record", EpisodeRecord)
        self.assertEqual(self.ask("step", action=[0.0] * 4).transition.step, 1)
        self.ask("reset")
        published = records.wait()
        self.assertEqual((published.episode.episode, published.episode.length), (1, 1))
        self.assertEqual((published.actions, published.checksums), ((), ()))
