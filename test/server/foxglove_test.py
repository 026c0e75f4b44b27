"""config/foxglove.json: each topic, field and frame that it names is in a bag of a server."""

import json
import os
import pathlib
import re
import tempfile

import rosbag
from catkin.find_in_workspaces import find_in_workspaces
from processes import wait_for
from server_harness import ServerTest, recorded_topics

ROOT = pathlib.Path(__file__).resolve().parents[2]
STEPS = 5
# The environments with the most observations, and one with the least.
SERVERS = [
    ("BipedalWalker-v3", 24, 4, {}),
    (
        "Walker2d-v5",
        28,
        6,
        {"include_lidar_in_observation": True, "exclude_current_positions_from_observation": False},
    ),
    ("Hopper-v5", 11, 3, {}),
]
PATH = re.compile(r"(?P<topic>(?:/\w+)+)\.(?P<field>\w+)(?:\[(?P<index>\d+)\])?")


def load_layout():
    path = find_in_workspaces(["share"], "walker_sim", "config/foxglove.json")[0]
    return json.loads(pathlib.Path(path).read_text(encoding="utf-8"))


def panels_of(layout, kind):
    return [config for name, config in layout["configById"].items() if name.startswith(f"{kind}!")]


def leaves(node):
    """Returns the panels of a node of the layout's tree."""
    return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])


def topics_of_the_guide():
    """Returns the topics of the command that records a bag for the layout."""
    guide = (ROOT / "docs/ros_guide.md").read_text(encoding="utf-8")
    (section,) = re.findall(r"^## In Foxglove\n(.*?)^## ", guide, re.MULTILINE | re.DOTALL)
    (topics,) = re.findall(r"rosbag record -O \S+((?: /\w+)+)$", section, re.MULTILINE)
    return topics.split()


class FoxgloveTest(ServerTest):
    layout = load_layout()

    def series(self):
        """Returns the parsed paths of all plots and state transitions."""
        panels = panels_of(self.layout, "Plot") + panels_of(self.layout, "StateTransitions")
        texts = [path["value"] for panel in panels for path in panel["paths"]]
        self.assertEqual(len(texts), len(set(texts)))
        for text in texts:
            self.assertRegex(text, f"^{PATH.pattern}$")
        return [PATH.fullmatch(text) for text in texts]

    def record_bag(self, env_id, size, parameters):
        """Records an episode's first steps. Returns the messages of the bag by topic, decoded with
        the definitions in the bag, as Foxglove does."""
        folder = tempfile.TemporaryDirectory(prefix="foxglove_test_")
        self.addCleanup(folder.cleanup)
        bag, topics = os.path.join(folder.name, "run.bag"), topics_of_the_guide()
        server = self.serve(mode="lockstep", env=env_id, **parameters)
        recorder = self.start_recorder(bag, *topics)
        wait_for(lambda: recorded_topics(server) == set(topics), f"{topics} to be recorded")
        self.ask("reset", has_seed=True, seed=3)
        for _ in range(STEPS):
            self.ask("step", action=[0.1] * size)
        self.stop_recorder(recorder)
        server.stop()
        messages = {}
        with rosbag.Bag(bag) as file:
            for topic, message, _ in file.read_messages():
                messages.setdefault(topic, []).append(message)
        return messages

    def test_bags_have_what_the_layout_names(self):
        series = self.series()
        indices = {name: set() for name in ("action", "observation")}
        for path in series:
            if path["index"] is not None:
                indices[path["field"]].add(int(path["index"]))
        (scene,) = panels_of(self.layout, "3D")
        plotted = {path["topic"] for path in series}
        self.assertEqual(
            plotted | set(scene["topics"]) | {"/tf", "/tf_static"}, set(topics_of_the_guide())
        )
        most = {name: max(values) + 1 for name, values in indices.items()}
        self.assertEqual(indices, {name: set(range(count)) for name, count in most.items()})
        sizes = {"action": [], "observation": []}
        for env_id, observation_size, action_size, parameters in SERVERS:
            with self.subTest(env_id):
                messages = self.record_bag(env_id, action_size, parameters)
                self.assertEqual(set(messages), set(topics_of_the_guide()))
                sizes["observation"].append(observation_size)
                sizes["action"].append(action_size)
                for path in series:
                    self.check_series(path, messages[path["topic"]], observation_size, action_size)
                for topic in scene["topics"]:
                    self.assertEqual(messages[topic][0]._type, "visualization_msgs/MarkerArray")
                frames = {
                    transform.child_frame_id
                    for topic in ("/tf", "/tf_static")
                    for message in messages[topic]
                    for transform in message.transforms
                }
                self.assertIn(scene["followTf"], frames)
        # Each series has values in one of the bags, and each value has a series.
        self.assertEqual(most, {name: max(counts) for name, counts in sizes.items()})

    def check_series(self, path, messages, observation_size, action_size):
        """The field is a number or a truth value, or an array of the environment's size."""
        self.assertEqual(len(messages), STEPS + 1)
        for message in messages:
            self.assertGreater(message.header.stamp.to_nsec(), 0)
            value = getattr(message, path["field"])
            if path["index"] is None:
                self.assertIsInstance(value, (float, bool))
            elif path["field"] == "observation":
                self.assertEqual(len(value), observation_size)
            else:
                self.assertEqual(len(value), action_size if message.step else 0)

    def test_the_tree_has_each_panel_once(self):
        self.assertEqual(sorted(leaves(self.layout["layout"])), sorted(self.layout["configById"]))

    def test_series_use_the_time_of_the_simulation(self):
        for kind in ("Plot", "StateTransitions"):
            for panel in panels_of(self.layout, kind):
                for path in panel["paths"]:
                    self.assertEqual(path["timestampMethod"], "headerStamp")
                    self.assertTrue(path["enabled"])
        fields = {path["field"] for path in self.series()}
        self.assertLessEqual({"action", "observation", "reward", "episode_return"}, fields)
