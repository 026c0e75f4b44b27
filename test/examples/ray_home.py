"""Folders for Ray's files, for the tests of the examples with Ray."""

import contextlib
import pathlib
import tempfile


@contextlib.contextmanager
def short_folder():
    """A folder for Ray's sockets, whose paths may have at most 107 bytes."""
    with tempfile.TemporaryDirectory(prefix="ray_", dir="/tmp") as folder:
        yield pathlib.Path(folder)


def ray_home(folder):
    return {"HOME": str(folder), "RAY_TMPDIR": str(folder)}
