"""The set-up that the commands share prints only when there is something to do."""

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
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


@pytest.fixture
def set_up(tmp_path):
    """Sets up with the stubs. Returns the status and the sorted lines on stderr."""

    def run(stubs=STUBS, **variables):
        check = "[1/1] cd x && /usr/bin/python3 /usr/lib/genmsg/genmsg_check_deps.py\n"
        ended = subprocess.run(
            ["bash", "-c", stubs + "locked set_up_all"],
            env={**os.environ, "ROOT": ROOT, "FOLDER": tmp_path, "NINJA": check, **variables},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        assert ended.stdout == ""
        return ended.returncode, sorted(ended.stderr.splitlines())

    return run


def test_where_all_is_ready_it_is_silent(set_up):
    set_up()
    assert set_up() == (0, [])


def test_the_first_time_each_step_speaks(set_up, tmp_path):
    status, lines = set_up(MISSING="two\n", NINJA="[1/2] Building\n[2/2] Linking\n")
    assert (status, len(lines)) == (0, 4), lines
    assert lines[0].startswith("build: ")
    assert lines[1].startswith("configure: ")
    assert lines[1].endswith(f", MUJOCO_DIR={tmp_path}")
    assert lines[2] == "packages: installing 1 of 2 and what they need"
    assert lines[3].startswith("virtual environment: installing ")


def test_a_build_that_has_something_to_do_speaks_once_and_is_in_the_log(set_up, tmp_path):
    set_up()
    status, lines = set_up(NINJA="[1/2] Building\n[2/2] Linking\n")
    assert (status, len(lines)) == (0, 1), lines
    assert lines[0].startswith("build: ")
    assert "[2/2] Linking\n" in (tmp_path / "log/build_ros.log").read_text()


def test_a_build_that_fails_shows_why(set_up):
    status, lines = set_up(NINJA="FAILED: walker\n", STATUS="3")
    assert status == 3, lines
    assert "  | FAILED: walker" in lines
    assert any("failed with status 3" in line for line in lines), lines


# A package tool fails while a file of its name is there, as if it needed a lock. `sleep` unlocks.
TOOLS = """
as_root() {
  shift 3
  local tool=$1
  case "$*" in *' update') tool=lists ;; esac
  if [ -e "$FOLDER/$tool" ]; then cat "$FOLDER/$tool"; echo; return 2; fi
  echo "$*" >>"$FOLDER/done"
}
sleep() { rm "$FOLDER"/{dpkg,lists,apt-get} 2>/dev/null || :; }
"""
LOCKED_TOOLS = STUBS.replace("install_packages() { :; }", TOOLS)


@pytest.mark.parametrize(
    ("tool", "error"),
    [
        ("dpkg", "dpkg: error: dpkg frontend lock was locked by another process with pid 7"),
        ("lists", "E: Could not get lock /var/lib/apt/lists/lock. It is held by process 7 (apt)"),
        ("apt-get", "E: Could not get lock /var/lib/dpkg/lock-frontend. It is held by process 7"),
    ],
)
def test_waits_for_another_process_that_installs_packages(set_up, tmp_path, tool, error):
    (tmp_path / tool).write_text(error)
    status, lines = set_up(stubs=LOCKED_TOOLS, MISSING="one\ntwo\n")
    assert status == 0, lines
    assert "packages: waiting for another process that installs packages" in lines
    configure, update, install = (tmp_path / "done").read_text().splitlines()
    assert configure == "dpkg --configure -a"
    assert update.endswith(" update")
    assert install.endswith(" install one two")


def test_does_not_repeat_what_fails_without_a_lock(set_up, tmp_path):
    (tmp_path / "lists").write_text("E: Failed to fetch http://block.example/locked")
    status, lines = set_up(stubs=LOCKED_TOOLS, MISSING="one\n")
    assert status != 0
    assert "  | E: Failed to fetch http://block.example/locked" in lines
    assert (tmp_path / "done").read_text() == "dpkg --configure -a\n"


@pytest.mark.parametrize(
    "closed", [">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-", "2>/dev/full"]
)
def test_messages_need_no_open_stream(closed, tmp_path):
    script = tmp_path / "script"
    script.write_text(
        f"set -euo pipefail\nsource {ROOT}/scripts/setup.sh\nsay words\necho words\n"
        f"exec readlink /proc/self/fd/{{0,1,2}} >{tmp_path}/streams\n"
    )
    subprocess.run(["bash", "-c", f"bash {script} {closed}"], check=True)
    assert len((tmp_path / "streams").read_text().splitlines()) == 3
