"""The commands' argument parser and error for invalid input, which need no extension module."""

from __future__ import annotations

import argparse
from typing import Any, NoReturn


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
