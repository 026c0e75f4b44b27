"""Runs the examples as a user does."""

import os
import pathlib
import subprocess
import sys

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
PATIENCE = 240  # with two busy cores [s]


def start_example(name, *arguments, folder, **environment):
    """examples/NAME.py as a process that runs within `folder`."""
    return subprocess.Popen(
        [sys.executable, EXAMPLES / f"{name}.py", *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )


def run_example(name, *arguments, folder, status=0, **environment):
    """What examples/NAME.py prints; it has to end with this status."""
    with start_example(name, *arguments, folder=folder, **environment) as process:
        try:
            text, _ = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    assert process.returncode == status, text
    return text


def assert_helps(name, folder):
    """Its --help says how it is called and what its options are."""
    text = run_example(name, "--help", folder=folder)
    assert f"python3 {name}.py" in text
    assert "--seed SEED" in text
