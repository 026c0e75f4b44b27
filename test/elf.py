"""Reads library search paths and hardening flags of ELF files."""

import re
import subprocess


def search_paths(file):
    """Returns the elements of RPATH and RUNPATH, or None if the file is not ELF."""
    with open(file, "rb") as stream:
        if stream.read(4) != b"\x7fELF":
            return None
    command = ["readelf", "--dynamic", "--wide", file]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    paths = re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", output)
    return [element for path in paths for element in path.split(":")]


def strange_paths(files):
    """Returns search paths not relative to $ORIGIN. An empty one is the current directory."""
    return [
        f"{file}: {element!r}"
        for file in files
        for element in search_paths(file) or []
        if not re.fullmatch(r"\$ORIGIN(/.+)?", element)
    ]


def missing_protection(file):
    command = ["readelf", "--file-header", "--segments", "--dynamic", "--dyn-syms", "--wide", file]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    wanted = {
        "position independent": r"Type: +DYN ",
        "read-only tables": r"^ +GNU_RELRO ",
        "all bound at the start": r"\((?:FLAGS\).*BIND_NOW|FLAGS_1\).*NOW)",
        "no code on the stack": r"^ +GNU_STACK( +0x\w+){5} RW +0x",
        "stack protector": r" UND __stack_chk_fail\b",
    }
    return [name for name, regex in wanted.items() if not re.search(regex, output, re.MULTILINE)]
