"""The core library exports its own interface and no symbol of the engines."""

import os
import re
import subprocess


def symbols(*options):
    command = ["nm", "--dynamic", "--demangle", *options, os.environ["WALKER_SIM_CORE_LIBRARY"]]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()


def test_no_symbol_of_box2d_is_exported():
    defined = symbols("--defined-only")
    assert [line for line in defined if re.search(r"\bb2[A-Z_]|box2d", line, re.IGNORECASE)] == []
    assert any("walker::make(" in line for line in defined), "else the listing was not understood"


def test_box2d_is_linked_statically():
    needed = [line for line in symbols("--undefined-only") if "b2World" in line]
    assert needed == [], "it would be asked of another library"
