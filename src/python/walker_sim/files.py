"""Paths of the files that ship with the package: settings and policies."""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).resolve().parent


def package_file(name: str) -> Path | None:
    """Returns the path of a file in the repository or the installation; None if there is none.

    `name` is relative to the repository, e.g. ``assets/policies/Walker2d-v5.safetensors``.
    """
    # A wheel; the repository; a catkin workspace's install space.
    for folder in (_HERE / "share", _HERE.parents[2], _HERE.parents[3] / "share" / "walker_sim"):
        if (folder / name).is_file():
            return folder / name
    return None
