"""Releases that scripts/dev/check_release accepts and refuses."""

import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
VERSION = re.search("<version>(.*)</version>", (ROOT / "package.xml").read_text()).group(1)


@pytest.mark.parametrize(
    ("tag", "heading", "words"),
    [
        (f"v{VERSION}", f"{VERSION} (2026-11-24)", ""),
        (f"v{VERSION}", f"{VERSION} (2026-11-25)", "have the line date-released: 2026-11-25"),
        (f"v{VERSION}", "Forthcoming", f'begins with "Forthcoming": must be "{VERSION} ('),
        (VERSION, f"{VERSION} (2026-11-24)", f"TAG = {VERSION}: must be v{VERSION}"),
        ("v99.0.0", f"{VERSION} (2026-11-24)", f"TAG = v99.0.0: must be v{VERSION}"),
    ],
)
def test_a_release(tmp_path, tag, heading, words):
    (tmp_path / "scripts/dev").mkdir(parents=True)
    for name in (
        "package.xml",
        *map("scripts/".__add__, ("setup.sh", "packages.sh", "dev/check_release")),
    ):
        shutil.copy(ROOT / name, tmp_path / name)
    changes = f"^^^^\nChangelog\n^^^^\n\n{heading}\n{'-' * len(heading)}\n* A change\n"
    (tmp_path / "CHANGELOG.rst").write_text(changes)
    (tmp_path / "CITATION.cff").write_text(f"version: {VERSION}\ndate-released: 2026-11-24\n")
    done = subprocess.run(
        [str(tmp_path / "scripts/dev/check_release"), tag],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode == 0) == (words == "")
    assert words in done.stderr
