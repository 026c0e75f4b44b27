"""Where programs and libraries look for libraries."""

import re
import subprocess


def search_paths(file):
    """The elements of RPATH and RUNPATH of an ELF file; None where it is none."""
    with open(file, "rb") as stream:
        if stream.read(4) != b"\x7fELF":
            return None
    command = ["readelf", "--dynamic", "--wide", file]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    paths = re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", told)
    return [element for path in paths for element in path.split(":")]


def strange_paths(files):
    """Elements that are not relative to the file itself: an empty one is the current directory."""
    return [
        f"{file}: {element!r}"
        for file in files
        for element in search_paths(file) or []
        if not re.fullmatch(r"\$ORIGIN(/.+)?", element)
    ]
