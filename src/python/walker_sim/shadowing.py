"""Files that hide modules, such as a user's random.py in the working directory.

For ``doctor``, which names them. Imports nothing that such a file could break.
"""

from __future__ import annotations

import os
import sys
from importlib.machinery import ModuleSpec, PathFinder

EXEMPT = ("sitecustomize", "test", "usercustomize", "walker_sim")
"""Modules that may be on the path twice."""

files: dict[str, str] = {}
"""Files that would have hidden modules, by the modules' names."""


def unhide() -> None:
    """Makes later imports find the hidden modules, and sets `files`."""
    specs = _hidden_modules()
    for name in specs:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, _Finder(specs))


class _Finder:
    def __init__(self, specs: dict[str, ModuleSpec]) -> None:
        self._specs = specs

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        return self._specs.get(name)


def _hidden_modules() -> dict[str, ModuleSpec]:
    """Examines the folders before Python's own, except those of installed packages."""
    specs: dict[str, ModuleSpec] = {}
    for index, folder in enumerate(sys.path):
        if folder == os.path.dirname(os.__file__):
            break
        if os.path.basename(folder) in ("site-packages", "dist-packages"):
            continue
        try:
            entries = os.listdir(folder)
        except OSError:  # no folder, or one that imports cannot read either
            continue
        for entry in entries:
            is_package = os.path.exists(os.path.join(folder, entry, "__init__.py"))
            name = entry if is_package else entry[: -len(".py")]
            if not (is_package or entry.endswith(".py")) or name in (*EXEMPT, *specs):
                continue
            file = os.path.join(folder, entry)
            hidden = PathFinder.find_spec(name, sys.path[index + 1 :])
            loaded = getattr(sys.modules.get(name), "__file__", None) or file
            if hidden and hidden.origin and loaded.startswith(file):
                specs[name], files[name] = hidden, file
    return specs
