"""The commands as processes: signals, terminals, pipes, closed standard streams."""

import contextlib
import csv
import errno
import fcntl
import itertools
import os
import pathlib
import pty
import signal
import struct
import subprocess
import sys
import termios
import time

import pytest
import walker_sim
from walker_sim import files
from walker_sim.commands import main, table

COMMAND = [sys.executable, "-m", "walker_sim"]
ID = "Walker2d-v5"
ZERO = ["evaluate", "BipedalWalker-v3", "--policy", "zero", "--episodes", "3"]
PATIENCE = 120.0  # timeout that only a failing test reaches [s]


def run(*arguments, **keywords):
    return subprocess.run([*COMMAND, *arguments], timeout=PATIENCE, **keywords)


def test_version_and_help(command):
    assert command("--version").out == f"walker_sim {walker_sim.__version__}\n"
    overview = command("--help").out
    for name in ("evaluate", "record", "bench"):
        assert f"\n  {name}" in overview
        assert f"python3 -m walker_sim {name} BipedalWalker-v3" in command(name, "--help").out
    for name in ("convert", "hash", "worlds"):  # they refuse parameters
        assert "NAME=VALUE" not in command(name, "--help").out


# ---------------------------------------------------------------- evaluate's CSV


def rows_of(path):
    text = path.read_text()
    assert text.endswith("\n")
    return [*csv.DictReader(text.splitlines())]


@pytest.mark.parametrize(
    ("number", "earlier"),
    [(signal.SIGINT, None), (signal.SIGKILL, None), (signal.SIGINT, "an earlier evaluation's\n")],
    ids=["Ctrl-C", "killed", "beside"],
)
def test_interrupted_csv_has_whole_lines_of_ended_episodes(tmp_path, number, earlier):
    path = tmp_path / "returns.csv"
    if earlier:
        path.write_text(earlier)
    files = ["--csv", str(path), "--json", str(tmp_path / "summary.json")]
    process = subprocess.Popen(
        [*COMMAND, "evaluate", ID, "--seeds", "0:1000000", "--policy", "zero", *files],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that starts the tests in the background makes them ignore SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    try:
        end = time.monotonic() + PATIENCE
        written = path
        while not written.exists() or written.read_text().count("\n") < 21:
            written = next(tmp_path.glob("returns.csv.*.new"), path)
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < end
            time.sleep(0.01)
        process.send_signal(number)
        out, error = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    kept = rows_of(written)
    assert (written == path) == (earlier is None)
    assert earlier in (None, path.read_text())
    assert 20 <= len(kept) < 1_000_000
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert error == f"{written}: {len(kept)} of 1000000 episodes\ninterrupted\n"
        assert out == ""
    seeds = [int(row["seed"]) for row in kept]
    assert len({*seeds}) == len(seeds)
    # The kept rows equal those of an uninterrupted run with the same seeds.
    whole = tmp_path / "whole.csv"
    words = [",".join(map(str, sorted(seeds[:20]))), "--policy", "zero", "--csv", str(whole)]
    assert main(["evaluate", ID, "--seeds", *words]) == 0
    assert rows_of(whole) == sorted(kept[:20], key=lambda row: int(row["seed"]))


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ([*ZERO, "--json"], "a.json"),
        ([*ZERO, "--grid", "gravity=-5,-9", "--json"], "a.json"),
        ([*ZERO, "--plot"], "a.png"),
        ([*ZERO, "--grid", "gravity=-5,-9", "--plot"], "a.svg"),
        ([*ZERO, "--csv"], "a.csv"),
        (["record", *ZERO[1:], "--output"], "a.npz"),
    ],
)
def test_a_full_disk_keeps_the_earlier_file_and_is_named(words, name, tmp_path, capsys, full_disk):
    path = tmp_path / name
    path.write_bytes(b"earlier")
    with full_disk():
        assert main([*words, str(path)]) == 2
    assert f": [Errno 27] File too large: '{path}" in capsys.readouterr().err
    assert path.read_bytes() == b"earlier"
    assert [*tmp_path.iterdir()] == [path]
    assert main([*words, str(path)]) == 0
    assert path.stat().st_size > 100


def test_a_link_and_its_files_permissions_stay(tmp_path, command):
    path, link = tmp_path / "a.json", tmp_path / "link.json"
    path.write_text("earlier")
    path.chmod(0o640)
    link.symlink_to(path)
    command(*ZERO, "--json", link)
    assert link.is_symlink()
    assert path.read_text().startswith("{")
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("option", ["--json", "--csv"])
@pytest.mark.parametrize("is_mounted", [False, True])
def test_a_file_that_cannot_be_replaced_is_overwritten(
    is_mounted, option, tmp_path, command, monkeypatch
):
    """It is mounted alone, or no file can be made beside it, as in /sys."""

    def refuse(*_):
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))

    path = tmp_path / "a"
    path.write_text("earlier")
    if is_mounted:
        monkeypatch.setattr(pathlib.Path, "replace", refuse)
    for module in (files, table) if not is_mounted else ():
        monkeypatch.setattr(module, "beside", lambda path: pathlib.Path("/sys/walker_sim.new"))
    command(*ZERO, option, path)
    assert path.stat().st_size > 100
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("option", ["--json", "--csv"])
def test_standard_output_in_a_file_is_written_to_directly(option, tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("earlier\n")
    with path.open("a") as file:
        run(*ZERO, option, "/dev/stdout", stdout=file, check=True)
    text = path.read_text()
    assert text.startswith("earlier\n")
    assert "mean return" in text
    assert ('"outcomes"' if option == "--json" else "seed,return,") in text
    assert [*tmp_path.iterdir()] == [path]


def test_episodes_of_a_csv_that_cannot_be_finished_are_named(tmp_path, capsys, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "a.csv")

    path = tmp_path / "a.csv"
    path.write_text("earlier")
    monkeypatch.setattr(table, "replace_file", refuse)
    assert main([*ZERO, "--csv", str(path)]) == 2
    (unfinished,) = {*tmp_path.iterdir()} - {path}
    count = len(rows_of(unfinished))
    assert f"{unfinished}: {count} of {count} episodes" in capsys.readouterr().err


def test_csv_to_a_pipe_is_sorted(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    process = subprocess.Popen([*COMMAND, "evaluate", ID, "--seeds", "3,1,2", "--csv", str(path)])
    try:
        with path.open() as file:
            rows = [*csv.DictReader(file)]
        assert process.wait(PATIENCE) == 0
    finally:
        process.kill()
    assert [row["seed"] for row in rows] == ["3", "1", "2"]


# ---------------------------------------------------------------- standard streams


@pytest.mark.parametrize("on_terminal", [True, False])
def test_only_a_terminal_shows_a_progress_bar(on_terminal):
    try:
        ours, theirs = pty.openpty() if on_terminal else os.pipe()
    except OSError as error:
        pytest.skip(f"no pseudo-terminal: {error}")
    if on_terminal:
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("4H", 24, 100, 0, 0))
    process = subprocess.Popen([*COMMAND, *ZERO], stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    shown = b""
    with contextlib.suppress(OSError):  # the terminal's other end is closed
        while part := os.read(ours, 4096):
            shown += part
    os.close(ours)
    assert process.wait(PATIENCE) == 0
    assert (b"0/3" in shown and b" episodes" in shown) == on_terminal
    assert b"a second, policy included" in shown


def test_encoding_without_block_characters():
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    shown = run(*ZERO, env=environment, stdout=subprocess.PIPE)
    assert shown.returncode == 0
    assert b"  ????" in shown.stdout


def test_closed_pipe_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONUNBUFFERED"}
    ended = run(*ZERO, env=environment, stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert ended.returncode == 0
    assert "Broken" not in ended.stderr
    assert "Traceback" not in ended.stderr


def test_error_names_full_standard_output():
    with open("/dev/full", "w") as full:
        ended = run("worlds", stdout=full, stderr=subprocess.PIPE, text=True)
    error = "walker_sim worlds: [Errno 28] No space left on device: 'standard output'\n"
    assert (ended.returncode, ended.stderr) == (2, error)


CLOSED = [streams for count in (1, 2, 3) for streams in itertools.combinations(range(3), count)]
# Arguments of each command that needs no learner, and the file that it writes.
ARGUMENTS = {
    "evaluate": (f"{ID} --episodes 2 --csv made --plot plot.png", "made"),
    "record": (f"{ID} --episodes 1 --output made.npz", "made.npz"),
    "hash": (f"{ID} --steps 10", None),
    "bench": (f"{ID} --seconds 0.01 --num-envs 1", None),
    "play": (f"{ID} --help", None),
    "train": ("--help", None),
    "convert": ("--help", None),
}


def run_closed(closed, command, folder):
    """Runs a command line with these standard streams closed."""
    closing = " ".join(f"{number}{'<' if number == 0 else '>'}&-" for number in closed)
    return subprocess.run(
        ["bash", "-c", f'exec "$@" {closing}', "bash", *command],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.mark.parametrize("command", ARGUMENTS)
def test_works_with_closed_standard_streams(command, tmp_path):
    arguments, made = ARGUMENTS[command]
    for closed in CLOSED if command == "evaluate" else [(0,), (1,), (2,), (0, 1, 2)]:
        ended = run_closed(closed, [*COMMAND, command, *arguments.split()], tmp_path)
        assert ended.returncode == 0, (closed, ended.stdout, ended.stderr)
        assert b"Traceback" not in ended.stderr
        if 1 not in closed:
            assert ended.stdout, closed
        if made:
            (tmp_path / made).unlink()


def test_closed_standard_streams_change_no_status_or_output(tmp_path):
    for closed in CLOSED:
        assert run_closed(closed, [*COMMAND, "evaluate", "Ant-v5"], tmp_path).returncode == 2
    command = [*COMMAND, "evaluate", ID, "--episodes", "2"]
    whole = run_closed((), command, tmp_path).stdout
    assert run_closed((0, 2), command, tmp_path).stdout == whole


def test_a_call_from_python_opens_no_standard_stream(tmp_path):
    code = (
        "import os, sys, walker_sim, walker_sim.commands\n"
        "walker_sim.commands.main(['hash', 'Hopper-v5', '--steps', '1'])\n"
        "try:\n    os.fstat(0)\nexcept OSError:\n    sys.exit(7)\n"
    )
    assert run_closed((0,), [sys.executable, "-c", code], tmp_path).returncode == 7
