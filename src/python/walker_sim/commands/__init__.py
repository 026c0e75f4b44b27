"""The command line: ``python3 -m walker_sim COMMAND``, one of `COMMANDS`."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import os
import sys
from pathlib import Path
from typing import Any, NoReturn, Sequence

import walker_sim
from walker_sim.files import naming

COMMANDS = {
    "evaluate": "prints a policy's return over seeds; writes a plot, CSV and JSON",
    "play": "shows a walker in a window or a browser, in real time",
    "record": "writes episodes to a file or a data set, or checks those of a file to the bit",
    "train": "trains a policy with Stable-Baselines3 on many walkers at once",
    "convert": "converts Stable-Baselines3 or ONNX models to policy files, policy files to ONNX",
    "bench": "measures steps per second beside Gymnasium's own walker",
    "worlds": "lists the presets and the parameters of --world, with their limits",
    "hash": "prints one number for all bits of a fixed run, to compare machines",
    "doctor": "examines the installation and names what is wrong, with the remedy",
}

EPILOG = """\
commands:
  {commands}

examples:
  python3 -m walker_sim evaluate BipedalWalker-v3 --policy heuristic --plot returns.png
  python3 -m walker_sim evaluate BipedalWalkerHardcore-v3 --policy shipped
  python3 -m walker_sim train BipedalWalker-v3
  python3 -m walker_sim play Walker2d-v5
  python3 -m walker_sim record Walker2d-v5 --episodes 10 --output gait.npz
  python3 -m walker_sim bench BipedalWalker-v3

Each command has --help. Exit status: 0 done, 1 a check found a difference or a policy failed, 2 bad
input or no connection, 130 interrupted.
"""


class InputError(Exception):
    """An input is invalid. The message names it, its value and what is allowed."""


class Parser(argparse.ArgumentParser):
    """Argument parser that keeps line breaks, allows no abbreviations and has one-line errors."""

    def __init__(self, command: str, description: str, epilog: str, **keywords: Any) -> None:
        super().__init__(
            prog=f"python3 -m walker_sim {command}".strip(),
            description=description,
            epilog=epilog,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            **keywords,
        )

    def error(self, message: str) -> NoReturn:
        """Prints the error and exits with status 2."""
        self.exit(2, f"{self.prog.replace('python3 -m ', '')}: {message}; see --help\n")


def _parser() -> Parser:
    lines = "\n  ".join(f"{name:<10}{text}" for name, text in COMMANDS.items())
    parser = Parser(
        "",
        "Gymnasium's bipedal walkers, the same bits in process and over ROS.",
        EPILOG.format(commands=lines),
        usage="python3 -m walker_sim [-h] [--version] COMMAND ...",
    )
    parser.add_argument(
        "--version", action="version", version=f"walker_sim {walker_sim.__version__}"
    )
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="see below")
    return parser


def _status_of(error: Exception) -> int | None:
    """Returns the exit status for an expected error; None if it needs a traceback."""
    if isinstance(error, (InputError, OSError)):  # the latter includes walker_sim.ConnectionError
        return 2
    if isinstance(error, ImportError):
        return None
    # Not imported above: `doctor` runs without an extension module and without Gymnasium.
    from walker_sim.commands.policies import PolicyFailed
    from walker_sim.errors import RequestRefused, ServerMismatch

    if isinstance(error, PolicyFailed) and error.__cause__ is None:
        return 1
    return 2 if isinstance(error, (RequestRefused, ServerMismatch)) else None


def _open_standard_streams() -> None:
    """Opens /dev/null for each of standard input, output and error that is closed.

    Otherwise the next file or socket would get its file descriptor, and printing would fail on
    ``sys.stdout = None``.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # gets the lowest free one
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))


class _Output:
    """Standard output, which the error of a full disk names."""

    def __init__(self, file: Any) -> None:
        self._file = file

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._file, name)
        is_writing = name in ("flush", "write", "writelines")
        return naming(Path("standard output"))(found) if is_writing else found


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status.

    `arguments` exclude the program's name; None: those of this process.
    """
    if arguments is None:
        _open_standard_streams()  # only in a process of our own
    given = list(sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # its encoding may lack the bars' characters
    command = _parser().parse_args(given[:1]).command
    try:
        output: Any = _Output(sys.stdout)
        with contextlib.redirect_stdout(output):
            status = int(importlib.import_module(f"walker_sim.commands.{command}").run(given[1:]))
            output.flush()  # a BrokenPipeError is handled below
        return status
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader has closed the pipe. The interpreter's last flush must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        expected = _status_of(error)
        if expected is None:
            raise
        # In one line: unprintable characters are escaped.
        text = "".join(
            character if character.isprintable() else repr(character)[1:-1]
            for character in str(error)
        )
        print(f"walker_sim {command}: {text}", file=sys.stderr)
        return expected
