"""./scripts/wheels with this system's compiler and Python: refused arguments, the contents of the
wheel and the source package, and that the trial of a wheel can fail."""

import email
import hashlib
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from typing import NamedTuple

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TEST = ROOT / "test"
sys.path.append(str(TEST))
from elf import missing_protection  # noqa: E402

TOOLS = ROOT / "build/.wheel_tools/bin"
PYTHON = "/usr/bin/python3"
VERSION = re.search("<version>(.*)</version>", (ROOT / "package.xml").read_text()).group(1)


def run(*command, **variables):
    # Warnings are errors, as in other tests, so that both share a compiler cache.
    variables = {"CMAKE_ARGS": "-DWALKER_SIM_WERROR=ON", **variables}
    return subprocess.run(
        list(map(str, command)),
        env={**os.environ, **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def make_wheels(*arguments):
    return run(ROOT / "scripts/wheels", *arguments)


class Built(NamedTuple):
    folder: pathlib.Path
    wheel: pathlib.Path
    source: pathlib.Path
    told: str


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheels")
    done = make_wheels("--here", "--wheel-dir", folder, PYTHON)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    (source,) = folder.glob("*.tar.gz")
    return Built(folder, wheel, source, done.stdout)


def pythons_version():
    program = "import sys; print('%d.%d' % sys.version_info[:2])"
    return subprocess.check_output([PYTHON, "-c", program], text=True).strip()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--no-such"], "--no-such: unknown"),
        (["--no-try", "--only-try"], "--no-try and --only-try: only one of them"),
        (["--wheel-dir"], "--wheel-dir: needs a folder"),
        (["3.4"], "PYTHON = 3.4: must be a CPython 3.8 or later"),
        (["/bin/true"], "PYTHON = /bin/true: must be a CPython 3.8 or later"),
        # Python of a virtual environment
        ([sys.executable], f"PYTHON = {sys.executable}: must be"),
    ],
)
def test_what_is_refused(arguments, words):
    done = make_wheels("--no-try", *arguments)
    assert done.returncode == 1
    assert words in done.stderr
    assert done.stdout == ""


def test_what_it_says(built):
    lines = built.told.splitlines()
    assert lines[0] == f"here, Python {pythons_version()}"
    assert lines[-1] == "1 Pythons, 1 trials, 0 failed"
    told = "\n".join(lines)
    assert len(re.findall(r"sha256 \w{16}, as recorded", told)) == 6
    assert re.search(r"import walker_sim: \d\.\d{3} s, the processor \d\.\d{3} s", told)
    for path in (built.wheel, built.source):
        assert re.search(rf"^[\d.]+MB  {re.escape(path.name)}$", told, re.MULTILINE)


def test_the_name_promises_no_older_glibc_than_is_there(built):
    tag = "cp" + pythons_version().replace(".", "")
    named = re.fullmatch(
        rf"walker_sim-{VERSION}-{tag}-{tag}-(?:manylinux\w+\.)*manylinux_(\d+)_(\d+)_"
        rf"{platform.machine()}\.whl",
        built.wheel.name,
    )
    assert named, built.wheel.name
    glibc = tuple(map(int, os.confstr("CS_GNU_LIBC_VERSION").split()[1].split(".")))
    assert tuple(map(int, named.groups())) <= glibc
    with zipfile.ZipFile(built.wheel) as archive:
        text = archive.read(f"walker_sim-{VERSION}.dist-info/WHEEL").decode()
    tags = email.message_from_string(text).get_all("Tag")
    assert {f"{tag}-{tag}-{part}" for part in built.wheel.stem.split("-")[-1].split(".")} == set(
        tags
    )


def needed_glibc(library):
    told = subprocess.check_output(["readelf", "--version-info", "--wide", library], text=True)
    return {tuple(map(int, v.split("."))) for v in re.findall(r"Name: GLIBC_([\d.]+)", told)}


def test_libraries_and_licences(built, tmp_path):
    with zipfile.ZipFile(built.wheel) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path)
    libraries = sorted(name for name in names if ".so" in name)
    assert len(libraries) == 2 and libraries[0].startswith("walker_sim/_core.")
    # no grafted libraries, and MuJoCo's original binary
    assert libraries[1] == "walker_sim/libmujoco.so.2.2.2"
    mujoco = (
        os.environ.get("MUJOCO_DIR")
        or subprocess.check_output([ROOT / "scripts/fetch_engines", "mujoco"], text=True).strip()
    )
    original = pathlib.Path(mujoco, "lib/libmujoco.so.2.2.2").read_bytes()
    assert (tmp_path / libraries[1]).read_bytes() == original
    licences = tmp_path / f"walker_sim-{VERSION}.dist-info/licenses"
    assert "Erin Catto" in (licences / "NOTICE").read_text()
    assert "BSD 3-Clause" in (licences / "LICENSE").read_text()
    assert "Apache License" in (licences / "mujoco/LICENSE").read_text()
    assert (licences / "mujoco/LICENSES_THIRD_PARTY.md").stat().st_size > 1000
    promised = re.search(r"manylinux_(\d+)_(\d+)_\w+\.whl", built.wheel.name).groups()
    for library in libraries:
        assert max(needed_glibc(tmp_path / library)) <= tuple(map(int, promised))
    assert missing_protection(tmp_path / libraries[0]) == []


def test_auditwheel_agrees(built):
    done = run(TOOLS / "auditwheel", "show", built.wheel)
    assert done.returncode == 0, done.stderr
    told = " ".join(done.stdout.split())
    platforms = built.wheel.stem.split("-")[-1].split(".")
    assert f'is consistent with the following platform tag: "{platforms[0]}"' in told


def test_the_source_package_is_the_same_of_another_folder(built, tmp_path):
    copy = tmp_path / "copy"
    copy.mkdir()
    with tarfile.open(built.source) as archive:
        names = archive.getnames()
        times = {member.mtime for member in archive}
        archive.extractall(copy)
    assert len(times) == 1 and len(names) == len(set(names))
    top = f"walker_sim-{VERSION}"
    for name in ("CMakeLists.txt", "LICENSE", "NOTICE", "scripts/fetch_engines", "pyproject.toml"):
        assert f"{top}/{name}" in names
    assert not [name for name in names if re.search(r"/(build|devel|\.git)/|\.(gif|pyc|so)$", name)]
    build = [TOOLS / "python", "-m", "build", "--no-isolation", "--sdist", "--outdir", tmp_path]
    done = run(*build, copy / top, SOURCE_DATE_EPOCH=str(times.pop()))
    assert done.returncode == 0, done.stdout + done.stderr
    again = (tmp_path / built.source.name).read_bytes()
    assert hashlib.sha256(again).digest() == hashlib.sha256(built.source.read_bytes()).digest()


@pytest.fixture
def trial(built, tmp_path):
    """Runs a copy of try_wheel.py, with copied recordings, in the trial environment."""
    for folder in ("python", "recordings"):
        (tmp_path / folder).mkdir()
    for name in ("try_wheel.py", "recorded_episodes.py"):
        shutil.copy(TEST / "python" / name, tmp_path / "python")
    for file in TEST.glob("recordings/*full_episodes.txt"):
        shutil.copy(file, tmp_path / "recordings")
    python = ROOT / f"build/.wheels/trial_{pythons_version()}/bin/python"
    return lambda *arguments: run(python, "-I", tmp_path / "python/try_wheel.py", *arguments)


# The column is that of the reward, or of the last number of the observation.
@pytest.mark.parametrize(("robot", "column"), [("", 28), ("walker2d_", 22), ("hopper_", 13)])
def test_a_trial_fails_by_one_bit(trial, tmp_path, robot, column):
    path = tmp_path / "recordings" / f"{robot}full_episodes.txt"
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines):
        words = line.split()
        if len(words) > column and words[0] != "#":
            words[column] = words[column][:-1] + "%x" % (int(words[column][-1], 16) ^ 1)
            lines[number] = " ".join(words)
    path.write_text("\n".join(lines))
    done = trial("any")
    assert done.returncode == 1
    assert re.search(r"sha256 \w{16}; must be \w{16}", done.stderr), done.stderr


def test_a_trial_fails_where_pictures_or_bareness_are_not_as_said(trial):
    drawn, missing = trial("drawn"), trial("missing")
    assert sorted([drawn.returncode, missing.returncode]) == [0, 1]
    bare = trial("--bare", "any")
    assert (bare.returncode, bare.stderr) == (1, "try_wheel: c++ is here\n")
