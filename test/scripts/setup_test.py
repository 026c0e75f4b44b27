#!/usr/bin/python3
"""The set-up that the commands share prints only when there is something to do."""

import os
import subprocess
import tempfile
import unittest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
# Stubs for everything external: packages, networks and compilers.
STUBS = """
set -euo pipefail
source "$ROOT/scripts/setup.sh"
build=$FOLDER logs=$FOLDER/log venv=$FOLDER/venv ros_build=$FOLDER/.ros devel=$FOLDER/devel
BOX2D_SOURCE_DIR=$FOLDER MUJOCO_DIR=$FOLDER ros_options=(-DMUJOCO_DIR=$FOLDER -DBOX2D_SOURCE_DIR=)
base_packages=(one two)
mkdir -p "$logs"
missing_packages() { printf '%s' "${MISSING:-}"; }
install_packages() { :; }
make_venv() { mkdir -p "$1"; }
within() {
  case $2 in
    cmake) mkdir -p "$ros_build" ;;
    ninja) printf '[0/1] Re-checking globbed directories...\\n%s' "$NINJA"; return "${STATUS:-0}" ;;
  esac
}
"""


class SetupTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def set_up(self, **variables):
        variables = {
            "NINJA": "[1/1] cd x && /usr/bin/python3 /usr/lib/genmsg/genmsg_check_deps.py\n",
            **variables,
        }
        ended = subprocess.run(
            ["bash", "-c", STUBS + "locked set_up_all"],
            env={**os.environ, "ROOT": ROOT, "FOLDER": self.folder, **variables},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(ended.stdout, "")
        return ended.returncode, sorted(ended.stderr.splitlines())

    def test_where_all_is_ready_it_is_silent(self):
        self.set_up()
        self.assertEqual(self.set_up(), (0, []))

    def test_the_first_time_each_step_speaks(self):
        status, lines = self.set_up(MISSING="two\n", NINJA="[1/2] Building\n[2/2] Linking\n")
        self.assertEqual(status, 0, lines)
        self.assertEqual(len(lines), 4, lines)
        self.assertTrue(lines[0].startswith("build: "), lines)
        self.assertTrue(lines[1].startswith("configure: "), lines)
        self.assertTrue(lines[1].endswith(f", MUJOCO_DIR={self.folder}"), lines)
        self.assertEqual(lines[2], "packages: installing 1 of 2 and what they need")
        self.assertTrue(lines[3].startswith("virtual environment: installing "), lines)

    def test_a_build_that_has_something_to_do_speaks_once_and_is_in_the_log(self):
        self.set_up()
        status, lines = self.set_up(NINJA="[1/2] Building\n[2/2] Linking\n")
        self.assertEqual((status, len(lines)), (0, 1), lines)
        self.assertTrue(lines[0].startswith("build: "), lines)
        with open(os.path.join(self.folder, "log", "build_ros.log"), encoding="utf-8") as log:
            self.assertIn("[2/2] Linking\n", log.read())

    def test_a_build_that_fails_shows_why(self):
        self.set_up()
        status, lines = self.set_up(NINJA="FAILED: walker\n", STATUS="3")
        self.assertEqual(status, 3, lines)
        self.assertIn("  | FAILED: walker", lines)
        self.assertTrue(any("failed with status 3" in line for line in lines), lines)


if __name__ == "__main__":
    unittest.main()
