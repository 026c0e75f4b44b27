#!/usr/bin/python3
"""Options and error messages of `describe`, which writes robot descriptions."""

import filecmp
import os
import pathlib
import resource
import subprocess
import tempfile
import unittest

from catkin.find_in_workspaces import find_in_workspaces

ROOT = pathlib.Path(os.path.abspath(__file__)).parents[2]
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
        self.folder = pathlib.Path(folder.name)
        self.urdf = self.folder / "robot.urdf"

    def output_of(self, *arguments):
        done = describe(*arguments)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def assert_rejected(self, text, *arguments):
        done = describe(*arguments)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertTrue(done.stderr.startswith("describe: "), done.stderr)
        # A limit of file sizes also stops what measures the coverage, which reports it.
        lines = [line for line in done.stderr.splitlines() if not line.startswith("libgcov")]
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertIn(text, done.stderr)

    def test_help_names_every_option(self):
        text = self.output_of("--help")
        self.assertEqual(text, self.output_of("-h"))
        for option in ("--urdf", "--meshes", "--engine", "--", "NAME=VALUE"):
            self.assertIn(option, text)

    def test_urdf_option_writes_the_same_text_to_a_file(self):
        text = self.output_of("Walker2d-v5")
        self.assertIn('<robot name="walker2d">', text)
        self.assertEqual(self.output_of("Walker2d-v5", "--urdf", self.urdf), "")
        self.assertEqual(self.urdf.read_text(encoding="utf-8"), text)

    def test_default_id_is_bipedal_walker(self):
        self.assertEqual(self.output_of(), self.output_of("BipedalWalker-v3"))

    def test_parameters_change_the_environment(self):
        model = self.folder / "model.xml"
        text = (ROOT / "assets" / "walker2d_v5.xml").read_text(encoding="utf-8")
        text = text.replace('name="foot_geom"', 'name="foot_geom" mass="7"')
        model.write_text(text, encoding="utf-8")
        self.assertNotEqual(
            self.output_of("Walker2d-v5", f"xml_file={model}"), self.output_of("Walker2d-v5")
        )

    def test_meshes_are_copied_and_overwritten(self):
        for _ in range(2):
            self.output_of("--urdf", self.urdf, "--meshes", self.folder, "BipedalWalker-v3")
        meshes = set(self.folder.iterdir()) - {self.urdf}
        text = self.urdf.read_text(encoding="utf-8")
        self.assertTrue(meshes)
        for copy in meshes:
            self.assertIn(copy.name, text)
            self.assertTrue(filecmp.cmp(ROOT / "assets" / copy.name, copy, shallow=False))

    def test_unwritable_files_are_named(self):
        nowhere = self.folder / "nowhere"
        path = nowhere / "robot.urdf"
        self.assert_rejected(f"{path}: could not be written", "--urdf", path)
        arguments = ("--urdf", self.urdf, "--meshes", nowhere)
        self.assert_rejected("could not be written: No such file", *arguments)

    def test_a_full_disk_keeps_the_earlier_file(self):
        self.urdf.write_text("earlier", encoding="utf-8")
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, limit[1]))  # inherited
        self.addCleanup(resource.setrlimit, resource.RLIMIT_FSIZE, limit)
        arguments = ("--urdf", self.urdf, "Hopper-v5")
        self.assert_rejected(f"{self.urdf}: could not be written: File too large", *arguments)
        self.assertEqual(self.urdf.read_text(encoding="utf-8"), "earlier")
        self.assertEqual([*self.folder.iterdir()], [self.urdf])

    def test_wrong_arguments_are_named(self):
        self.assert_rejected("--color: unknown option; see --help", "--color")
        self.assert_rejected("--urdf: needs a value", "--urdf")
        self.assert_rejected("--meshes: needs a value", "Walker2d-v5", "--meshes")
        self.assert_rejected("Nobody-v0", "Nobody-v0")
        self.assert_rejected("--engine", "--", "--engine")  # an ID: no option follows "--"
        self.assert_rejected("legs", "Walker2d-v5", "legs=3")


if __name__ == "__main__":
    unittest.main()
