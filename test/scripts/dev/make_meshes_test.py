"""The committed meshes are those that scripts/dev/make_meshes writes."""

import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[3]


def test_it_writes_what_is_in_assets(tmp_path):
    subprocess.run(["/usr/bin/python3", ROOT / "scripts/dev/make_meshes", tmp_path], check=True)
    committed = [*ROOT.glob("assets/*.dae"), *ROOT.glob("assets/*.stl")]
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in committed}
    for path in committed:
        assert (tmp_path / path.name).read_bytes() == path.read_bytes(), f"{path.name} differs"
