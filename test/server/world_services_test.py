"""Worlds over ROS: whose they are, from when on, what was drawn, records, and refusals.

promises_test.py compares episodes in worlds.
"""

import copy

from processes import LoggedProcess
from server_harness import (
    DT,
    STATE_TOPICS,
    ServerTest,
    nanoseconds,
    random_actions,
    same_experience,
    to_message,
    values_of,
)
from walker_sim._core import world_presets
from walker_sim.msg import (
    EnvironmentSpec,
    Episode,
    EpisodeRecord,
    World,
    WorldParameter,
)

MIXED = "{gravity: [-12, -8], action_delay: [0, 0.1], observation_delay: [0, 0.1], dropout: 0.1}"


def ranges_of(parameters):
    return {each.name: (each.low, each.high) for each in parameters}


class WorldServicesTest(ServerTest):
    def walk(self, count, seed=1):
        return self.play(random_actions(4, count, seed))

    def reset(self, seed=3, wanted=None):
        return self.ask("reset", has_seed=True, seed=seed, world=wanted or World())

    def test_set_world_can_be_typed(self):
        self.serve(mode="lockstep")
        command = ["rosservice", "call", "/walker_sim/set_world", "{worlds: [{preset: moon}]}"]
        typed = LoggedProcess(command)
        self.assertEqual(typed.wait(), 0, typed.output())
        self.assertIn("success: True", typed.output())
        self.assertEqual(values_of(self.reset().world), {"gravity": -1.62})

    def test_set_world_is_published_and_acts_from_the_next_reset(self):
        self.serve(mode="lockstep")
        specs = self.record("/spec", EnvironmentSpec)
        episodes = self.record("/episode", Episode)
        self.assertEqual(self.reset().world, [])
        self.ask("set_world", worlds=[to_message({"gravity": [-5.0, -3.0], "dropout": 0.0})])
        spec = specs.wait(lambda m: m.world.parameters)
        self.assertEqual(ranges_of(spec.world.parameters), {"dropout": (0, 0), "gravity": (-5, -3)})
        self.assertEqual(spec.world.preset, "")
        self.assertEqual(str(self.call("get_spec").spec), str(spec))
        drawn = values_of(self.reset().world)
        self.assertEqual(drawn["dropout"], 0)
        self.assertTrue(-5 < drawn["gravity"] < -3, drawn)
        episode = episodes.wait(lambda m: m.episode == 2)
        self.assertEqual(values_of(episode.world), drawn)
        self.assertEqual(episodes.wait(lambda m: m.episode == 1).world, [])
        self.ask("set_world", worlds=[to_message("gymnasium")], environments=[0])
        self.assertEqual(specs.wait(lambda m: m.world.preset == "gymnasium").world.parameters, [])
        self.assertEqual(self.reset().world, [])

    def test_the_worlds_that_a_server_can_have(self):
        no_floor = self.model_file(('name="floor"', 'name="floor" euler="0 2 0"'))
        walker = {"env": "Walker2d-v5"}
        for parameters in ({}, walker, {**walker, "xml_file": no_floor}):
            with self.subTest(str(parameters)):
                self.serve(mode="lockstep", world="{gravity: [-12, -8]}", **parameters)
                self.reset(wanted=to_message("moon"))
                worlds = self.call("get_worlds")
                self.assertEqual(ranges_of(worlds.launch.parameters), {"gravity": (-12, -8)})
                for preset in world_presets():
                    is_taken = self.call("set_world", worlds=[to_message(preset)]).success
                    self.assertEqual(preset in worlds.presets, is_taken, preset)
                self.assertIn("gravity", worlds.parameters)
                has_level = "xml_file" not in parameters
                self.assertEqual("ground_roughness" in worlds.parameters, has_level)

    def test_free_running_server_keeps_its_world(self):
        self.serve(world="{gravity: [-12, -8]}", max_episode_steps=20, real_time_factor=0.0)
        episodes = self.record("/episode", Episode)
        first = episodes.wait().episode + 1
        begun = [episodes.wait(lambda m, n=n: m.episode == n) for n in range(first, first + 3)]
        gravities = {values_of(episode.world)["gravity"] for episode in begun}
        self.assertEqual(len(gravities), 3, "each episode draws anew")
        self.assertTrue(all(-12 < gravity < -8 for gravity in gravities), gravities)
        number = self.reset(wanted=to_message({"gravity": -2.0})).transition.episode
        for n in (number, number + 1, number + 2):
            episode = episodes.wait(lambda m, n=n: m.episode == n)
            self.assertEqual(values_of(episode.world), {"gravity": -2.0})

    def test_a_record_has_its_episode_s_world(self):
        """~restore takes it on a server with another world, for this episode alone."""
        self.serve(mode="lockstep", world=MIXED)
        records = self.record("/episode_record", EpisodeRecord)
        begun = self.reset()
        self.assertEqual(len(values_of(begun.world)), 4)
        record = self.ask("snapshot").record
        self.reset(4)
        for message in (record, records.wait()):
            self.assertEqual(str(message.episode.world), str(begun.world))
        self.serve(mode="lockstep", world="{gravity: -20}")
        restored = self.ask("restore", record=record)
        self.assertEqual(str(restored.world), str(begun.world))
        self.assertEqual(values_of(self.reset().world), {"gravity": -20})
        numbers = self.reset(wanted=World("", begun.world))
        self.assertEqual(str(numbers.world), str(begun.world))
        self.assertTrue(same_experience(numbers.transition, begun.transition))

    def test_a_refused_world_is_neither_published_nor_kept(self):
        """worlds_test.cpp in this folder and in test/ros has all refusals."""
        self.serve(mode="lockstep", world="{gravity: -4}")
        begun = self.reset()
        specs = self.record("/spec", EnvironmentSpec)
        record = self.ask("snapshot").record
        twice = World("", [WorldParameter("gravity", -1, -1, False)] * 2)
        for service, fields in (
            ("set_world", {"worlds": [twice]}),
            ("reset", {"has_seed": True, "seed": 5, "world": twice}),
            ("reset_batch", {"worlds": [twice]}),
        ):
            reply = self.call(service, **fields)
            self.assertFalse(reply.success, service)
            self.assertIn("gravity is given twice", reply.status_message, service)
        for parameters, words in (
            ([WorldParameter("gravity", -4, -3, False)], "must be a number, or a range of"),
            (twice.parameters, "gravity is given twice"),
            ([WorldParameter("gravty", -4, -4, False)], "gravty = -4.0: unknown"),
            ([WorldParameter("gravity", -4000, -4000, False)], "must be in"),
            ([WorldParameter("gravity", -5, -5, False)], "of the record: checksum"),
            ([], "of the record: checksum"),
        ):
            wrong = copy.deepcopy(record)
            wrong.episode.world = parameters
            reply = self.call("restore", record=wrong)
            self.assertFalse(reply.success, parameters)
            self.assertIn(words, reply.status_message)
        self.assertEqual(self.ask("snapshot").record, record)
        self.assertEqual(str(self.reset().world), str(begun.world))
        self.assertEqual(len(specs.messages()), 1, "the latched one")

    def test_stamps_of_a_delayed_world_are_those_of_the_measurements(self):
        self.serve(mode="lockstep", world="{observation_delay: 0.06, dropout: 0.2}")
        topics = ("joint_states", "imu", "odom", "contacts", "scan")
        heard = [self.record(f"/{name}", STATE_TOPICS[f"/{name}"]) for name in topics]
        transforms = self.record("/tf", STATE_TOPICS["/tf"])
        stamps = [nanoseconds(self.reset().transition)]
        for action in random_actions(4, 40):
            stamps.append(nanoseconds(self.ask("step", action=action).transition))
            transforms.at(stamps[-1])  # the other topics' queues hold the newest message only
        last = nanoseconds(self.reset(4).transition)
        for recorder in heard:
            recorder.at(last)
            found = recorder.stamps()
            self.assertEqual(found, sorted(set(found)), "strictly increasing")
            self.assertEqual(set(found[:-1]) - set(stamps[:-3]), set(), "at least three steps old")
            self.assertGreater(len(found), 10)
            self.assertLess(len(found), len(stamps) - 3, "dropped ones are not published")
        transforms.at(last)
        self.assertEqual(len(transforms.messages()), len(stamps) + 1, "the true state")

    def test_states_held_back_have_the_stamps_of_their_measurements(self):
        world, actions = "{observation_delay: 0.06, dropout: 0.5}", random_actions(4, 30)
        self.serve(mode="lockstep", world=world, max_topic_rate=0.0)
        heard = self.record("/joint_states", STATE_TOPICS["/joint_states"])
        transforms = self.record("/tf", STATE_TOPICS["/tf"])
        begin = nanoseconds(self.reset(7).transition)
        for action in actions:
            transforms.at(nanoseconds(self.ask("step", action=action).transition))
        heard.at(nanoseconds(self.reset(7).transition))
        positions = {nanoseconds(message) - begin: message.position for message in heard.messages()}

        self.serve(mode="lockstep", world=world, max_topic_rate=200.0)
        heard = self.record("/joint_states", STATE_TOPICS["/joint_states"])
        for _ in range(600):  # more than are shown after a pause
            begin = nanoseconds(self.reset(7).transition)
        heard.at(begin)
        known = 0
        for _ in range(10):
            begin = nanoseconds(self.reset(7).transition)
            for action in actions:
                end = nanoseconds(self.ask("step", action=action).transition)
            heard.wait(lambda m, b=begin, e=end: b < nanoseconds(m) <= e, "the last measurements")
            for message in heard.messages():
                expected = positions.get(nanoseconds(message) - begin)
                if expected:
                    self.assertEqual(message.position, expected)
                    known += 1
        self.assertGreaterEqual(known, 10)

    def test_unknown_measurements_are_not_published(self):
        """Those from before the first subscriber or a ~restore: their stamps or values are lost."""
        self.serve(mode="lockstep", world="{observation_delay: 0.06}")
        self.reset()
        before = self.walk(5)
        record = self.ask("snapshot").record
        heard = self.record("/joint_states", STATE_TOPICS["/joint_states"])
        first = nanoseconds(before[-1]) + DT
        expected = [first + i * DT for i in range(4)]
        self.step_and_hear(7, expected, heard)
        restored = nanoseconds(self.ask("restore", record=record).transition)
        later = [restored + i * DT for i in range(4)]
        self.step_and_hear(6, later, heard)
        last = nanoseconds(self.reset(4).transition)
        heard.at(last)
        self.assertEqual(heard.stamps(), [*expected, *later, last])

    def step_and_hear(self, num_steps, stamps, heard):
        """Steps, and awaits these stamps after the last steps: the queue holds one message."""
        for awaited in [None] * (num_steps - len(stamps)) + stamps:
            self.ask("step", action=[0.1] * 4)
            if awaited:
                heard.at(awaited)
