"""The commands as programs: interrupted, on a terminal, writing to a closed pipe."""

import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import time

import pytest
import walker_sim

COMMAND = [sys.executable, "-m", "walker_sim"]
POLICY = (
    "import time\nopen('began', 'w').close()\ndef act(observation): time.sleep(1); return [0] * 4\n"
)


def run(*arguments, **keywords):
    return subprocess.run([*COMMAND, *arguments], timeout=120, **keywords)


def test_version_and_help():
    shown = run("--version", capture_output=True, text=True)
    assert (shown.returncode, shown.stdout) == (0, f"walker_sim {walker_sim.__version__}\n")
    overview = run("--help", capture_output=True, text=True).stdout
    for command in ("evaluate", "record", "bench"):
        assert f"\n  {command}" in overview
        shown = run(command, "--help", capture_output=True, text=True)
        assert shown.returncode == 0
        assert f"python3 -m walker_sim {command} BipedalWalker-v3" in shown.stdout


def test_interrupt_ends_with_130(tmp_path):
    (tmp_path / "slow.py").write_text(POLICY)
    process = subprocess.Popen(
        [*COMMAND, "evaluate", "BipedalWalker-v3", "--policy", "slow:act"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that starts the tests in the background makes them ignore SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    while not (tmp_path / "began").exists():
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=120)
    assert (process.returncode, out, error) == (130, "", "interrupted\n")


def open_terminal():
    try:
        return pty.openpty()
    except OSError as error:
        pytest.skip(f"this system lends no terminals: {error}")


@pytest.mark.parametrize("on_terminal", [True, False])
def test_progress_bar_is_for_a_terminal(on_terminal):
    ours, theirs = open_terminal() if on_terminal else os.pipe()
    if on_terminal:
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("4H", 24, 100, 0, 0))
    arguments = ["evaluate", "BipedalWalker-v3", "--policy", "zero", "--episodes", "20"]
    process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # the terminal's other end is closed
            break
        if not part:
            break
        shown += part
    os.close(ours)
    assert process.wait(timeout=120) == 0
    assert (b"0/20" in shown and b" episodes" in shown) == on_terminal
    assert b"a second, policy included" in shown


def test_an_encoding_without_bars():
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    arguments = ["evaluate", "BipedalWalker-v3", "--policy", "zero", "--episodes", "3"]
    shown = run(*arguments, env=environment, stdout=subprocess.PIPE)
    assert shown.returncode == 0
    assert b"  ????" in shown.stdout


def test_a_reader_that_has_seen_enough():
    reading, writing = os.pipe()
    os.close(reading)
    arguments = ["evaluate", "BipedalWalker-v3", "--policy", "zero", "--episodes", "2"]
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONUNBUFFERED"}
    ended = run(*arguments, env=environment, stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert ended.returncode == 0
    assert "Broken" not in ended.stderr
    assert "Traceback" not in ended.stderr
