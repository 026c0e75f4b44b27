#!/usr/bin/python3
"""Options and error messages of `describe`, which writes robot descriptions."""

import filecmp
import os
import subprocess
import tempfile
import unittest

from catkin.find_in_workspaces import find_in_workspaces

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
DESCRIBE = find_in_workspaces(["libexec"], "walker_sim", "describe")[0]


def describe(*arguments):
    return subprocess.run(
        [DESCRIBE, *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


class DescribeTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def output_of(self, *arguments):
        done = describe(*arguments)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def assert_rejected(self, text, *arguments):
        done = describe(*arguments)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertTrue(done.stderr.startswith("describe: "), done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(text, done.stderr)

    def test_help_names_every_option(self):
        text = self.output_of("--help")
        self.assertEqual(text, self.output_of("-h"))
        for option in ("--urdf", "--meshes", "--engine", "--", "NAME=VALUE"):
            self.assertIn(option, text)

    def test_urdf_option_writes_the_same_text_to_a_file(self):
        path = os.path.join(self.folder, "robot.urdf")
        text = self.output_of("Walker2d-v5")
        self.assertIn('<robot name="walker2d">', text)
        self.assertEqual(self.output_of("Walker2d-v5", "--urdf", path), "")
        with open(path, encoding="utf-8") as file:
            self.assertEqual(file.read(), text)

    def test_default_id_is_bipedal_walker(self):
        self.assertEqual(self.output_of(), self.output_of("BipedalWalker-v3"))

    def test_parameters_change_the_environment(self):
        model = os.path.join(self.folder, "model.xml")
        with open(os.path.join(ROOT, "assets", "walker2d_v5.xml"), encoding="utf-8") as file:
            text = file.read()
        with open(model, "w", encoding="utf-8") as file:
            file.write(text.replace('name="foot_geom"', 'name="foot_geom" mass="7"'))
        self.assertNotEqual(
            self.output_of("Walker2d-v5", f"xml_file={model}"), self.output_of("Walker2d-v5")
        )

    def test_meshes_are_copied_and_overoutput_of(self):
        urdf = os.path.join(self.folder, "robot.urdf")
        for _ in range(2):
            self.output_of("--urdf", urdf, "--meshes", self.folder, "BipedalWalker-v3")
        meshes = sorted(name for name in os.listdir(self.folder) if name != "robot.urdf")
        with open(urdf, encoding="utf-8") as file:
            text = file.read()
        self.assertTrue(meshes)
        for name in meshes:
            self.assertIn(name, text)
            original, copy = (
                os.path.join(folder, name) for folder in (f"{ROOT}/assets", self.folder)
            )
            self.assertTrue(filecmp.cmp(original, copy, shallow=False))

    def test_unwritable_files_are_named(self):
        nowhere = os.path.join(self.folder, "nowhere")
        path = os.path.join(nowhere, "robot.urdf")
        self.assert_rejected(f"{path}: could not be written", "--urdf", path)
        urdf = os.path.join(self.folder, "robot.urdf")
        self.assert_rejected(
            "could not be written: No such file", "--urdf", urdf, "--meshes", nowhere
        )

    def test_wrong_arguments_are_named(self):
        self.assert_rejected("--color: unknown option; see --help", "--color")
        self.assert_rejected("--urdf: needs a value", "--urdf")
        self.assert_rejected("--meshes: needs a value", "Walker2d-v5", "--meshes")
        self.assert_rejected("Nobody-v0", "Nobody-v0")
        self.assert_rejected("--engine", "--", "--engine")  # an ID: no option follows "--"
        self.assert_rejected("legs", "Walker2d-v5", "legs=3")


if __name__ == "__main__":
    unittest.main()
