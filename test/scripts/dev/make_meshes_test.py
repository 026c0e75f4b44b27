#!/usr/bin/python3
"""The committed meshes are those that scripts/dev/make_meshes writes."""

import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]


class MakeMeshesTest(unittest.TestCase):
    def test_it_writes_what_is_in_assets(self):
        committed = [*ROOT.glob("assets/*.dae"), *ROOT.glob("assets/*.stl")]
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                ["/usr/bin/python3", ROOT / "scripts" / "dev" / "make_meshes", folder], check=True
            )
            written = {path.name: path.read_bytes() for path in pathlib.Path(folder).iterdir()}
        self.assertEqual(sorted(written), sorted(path.name for path in committed))
        for path in committed:
            self.assertTrue(written[path.name] == path.read_bytes(), f"{path.name} differs")


if __name__ == "__main__":
    unittest.main()
