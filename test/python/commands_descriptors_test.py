"""Every command works with closed standard file descriptors, as in a daemon."""

import itertools
import os
import subprocess
import sys

import pytest

ID = "Walker2d-v5"
PATIENCE = 120.0  # timeout that only a failing test reaches [s]
CLOSED = [*itertools.combinations(range(3), 1), *itertools.combinations(range(3), 2), (0, 1, 2)]
# Commands that need no learner, and the file that each writes to its working directory.
COMMANDS = {
    "evaluate": (f"{ID} --episodes 2 --csv made --plot plot.png", "made"),
    "record": (f"{ID} --episodes 1 --output made.npz", "made.npz"),
    "hash": (f"{ID} --steps 10", None),
    "bench": (f"{ID} --seconds 0.01 --num-envs 1", None),
    "play": (f"{ID} --help", None),
    "train": ("--help", None),
    "convert": ("--help", None),
}


def run_closed(closed, arguments, folder):
    closing = " ".join(f"{number}{'<' if number == 0 else '>'}&-" for number in closed)
    command = ["bash", "-c", f'exec "$@" {closing}', "bash", sys.executable, "-m", "walker_sim"]
    return subprocess.run(
        [*command, *arguments],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_works_with_closed_standard_descriptors(command, tmp_path):
    arguments, made = COMMANDS[command]
    for closed in CLOSED if command == "evaluate" else [(0,), (1,), (2,), (0, 1, 2)]:
        ended = run_closed(closed, [command, *arguments.split()], tmp_path)
        assert ended.returncode == 0, (closed, ended.stdout, ended.stderr)
        assert b"Traceback" not in ended.stderr
        if 1 not in closed:
            assert ended.stdout, closed
        if made:
            (tmp_path / made).unlink()


def test_bad_input_keeps_its_status(tmp_path):
    for closed in CLOSED:
        assert run_closed(closed, ["evaluate", "Ant-v5"], tmp_path).returncode == 2


def test_what_is_written_is_the_same(tmp_path):
    arguments = ["evaluate", ID, "--episodes", "2"]
    whole = run_closed((), arguments, tmp_path).stdout
    assert run_closed((0, 2), arguments, tmp_path).stdout == whole


def test_the_package_leaves_the_descriptors_of_a_process_alone(tmp_path):
    code = (
        "import os, sys, walker_sim, walker_sim.commands\n"
        "walker_sim.commands.main(['hash', 'Hopper-v5', '--steps', '1'])\n"
        "try:\n    os.fstat(0)\nexcept OSError:\n    sys.exit(7)\n"
    )
    ended = subprocess.run(
        ["bash", "-c", 'exec "$@" 0<&-', "bash", sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ,
        stdout=subprocess.DEVNULL,
        timeout=PATIENCE,
        check=False,
    )
    assert ended.returncode == 7
