"""Where Ray writes, for the tests of the examples that use it."""

import contextlib
import pathlib
import tempfile


@contextlib.contextmanager
def short_folder():
    """For what Ray writes down. Its sockets are there too, and a socket's name may be 107 long."""
    with tempfile.TemporaryDirectory(prefix="ray_", dir="/tmp") as folder:
        yield pathlib.Path(folder)


def ray_home(folder):
    """The environment variables with which Ray writes nowhere else."""
    return {"HOME": str(folder), "RAY_TMPDIR": str(folder)}
