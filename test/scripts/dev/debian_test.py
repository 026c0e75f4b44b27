"""The sources of the Debian package that ./scripts/dev/debian writes."""

import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[3]
# The script up to where it builds.
WRITE = r"""
set -euo pipefail
cd "$ROOT/scripts/dev"
grep -q '^debian_build=' debian
source <(sed -e '/^debian_build=/,$d' -e "s|\${BASH_SOURCE\[0\]}|$PWD/debian|" debian)
write_debian "$FOLDER" 12
"""


def write(folder, **variables):
    environment = {**os.environ, "ROOT": str(ROOT), "FOLDER": str(folder), **variables}
    subprocess.run(["bash", "-c", WRITE], env=environment, stdin=subprocess.DEVNULL, check=True)
    return (folder / "debian/changelog").read_text(), (folder / "debian/control").read_text()


def test_the_package_has_the_time_of_its_sources(tmp_path):
    changelog, _ = write(tmp_path, SOURCE_DATE_EPOCH="1700000000")
    assert changelog.endswith(">  Tue, 14 Nov 2023 22:13:20 +0000\n")
    assert changelog == write(tmp_path, SOURCE_DATE_EPOCH="1700000000", TZ="Asia/Tokyo")[0]


def test_build_depends_names_no_essential_package(tmp_path):
    _, control = write(tmp_path)
    (packages,) = re.findall(r"^Build-Depends: (.*)$", control, re.MULTILINE)
    assert "cmake" in packages.split(", ")
    assert "build-essential" not in packages.split(", ")
