#!/usr/bin/python3
"""Views of rviz: their topics, and the prefix of their frames."""

import os
import pathlib
import sys
import unittest

import yaml

ROOT = pathlib.Path(os.path.abspath(__file__)).parents[2]
sys.path.insert(0, str(ROOT / "src" / "nodes"))
sys.dont_write_bytecode = True
import view  # noqa: E402

# The frame that the camera follows and all topics, by robot.
VIEWS = {
    "bipedal_walker": ("hull", ["scene_markers", "state_markers", "scan", "camera/image_raw"]),
    "walker2d": ("base_link", ["scene_markers", "state_markers", "scan", "camera/image_raw"]),
    "hopper": ("base_link", ["scene_markers", "state_markers", "scan", "camera/image_raw"]),
}


class ViewTest(unittest.TestCase):
    def each(self):
        for robot, (followed, topics) in VIEWS.items():
            text = (ROOT / "config" / f"{robot}.rviz").read_text(encoding="utf-8")
            with self.subTest(robot=robot):
                yield yaml.safe_load(text), followed, topics

    def test_every_frame_has_the_prefix(self):
        for configuration, followed, _ in self.each():
            manager = view.put_prefix(configuration, "second")["Visualization Manager"]
            self.assertEqual(manager["Global Options"]["Fixed Frame"], "second/odom")
            self.assertEqual(manager["Views"]["Current"]["Target Frame"], "second/" + followed)
            parts = manager["Displays"] + manager["Tools"]
            prefixes = {d["Class"]: d["TF Prefix"] for d in parts if "TF Prefix" in d}
            self.assertEqual(prefixes, {"rviz/RobotModel": "second", "walker_sim/Push": "second"})

    def test_topics_are_relative(self):
        for configuration, _, expected in self.each():
            displays = configuration["Visualization Manager"]["Displays"]
            keys = ("Topic", "Marker Topic", "Image Topic")
            self.assertEqual([d[key] for d in displays for key in keys if key in d], expected)
            camera = next(d for d in displays if d["Class"] == "rviz/Image")
            self.assertIs(camera["Enabled"], False, "pictures cost time")


if __name__ == "__main__":
    unittest.main()
