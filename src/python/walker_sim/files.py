"""Where the files are that come with the package: settings and policies."""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).resolve().parent


def package_file(name: str) -> Path | None:
    """The file of this name in the repository, or in what was installed; None where there is none.

    Parameters
    ----------
    name
        From the top of the repository, e.g. ``assets/policies/Walker2d-v5.safetensors``.
    """
    # In a wheel; in the repository; in a catkin workspace's install space.
    for folder in (_HERE / "share", _HERE.parents[2], _HERE.parents[3] / "share" / "walker_sim"):
        if (folder / name).is_file():
            return folder / name
    return None
