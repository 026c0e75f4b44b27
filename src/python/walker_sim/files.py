"""Paths of the files that ship with the package, and the writing of a user's files."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import secrets
import shutil
from pathlib import Path
from typing import Any, Iterator

_HERE = Path(__file__).resolve().parent

NOT_REPLACEABLE = (errno.EACCES, errno.EPERM, errno.EBUSY, errno.EROFS)
"""Errors of making a file beside a writable one or of renaming it: the folder is not writable, or
the file alone is mounted into a container."""


def package_file(name: str) -> Path | None:
    """Returns the path of a file in the repository or the installation; None if there is none.

    `name` is relative to the repository, e.g. ``assets/policies/Walker2d-v5.safetensors``.
    """
    # A wheel; the repository; a catkin workspace's install space.
    for folder in (_HERE / "share", _HERE.parents[2], _HERE.parents[3] / "share" / "walker_sim"):
        if (folder / name).is_file():
            return folder / name
    return None


def replace_file(path: Path, content: bytes | memoryview) -> None:
    """Writes a file beside `path`, which it replaces when all of it is on the disk: `path` has the
    old or the new content at any time. Writes directly to a pipe, a device or a file descriptor,
    and to a file that cannot be replaced.

    An OSError, such as that of a full disk, names `path`.
    """
    try:
        number = descriptor_of(path)
        if number is not None:
            print(end="", flush=True)  # what has been printed comes first
            with open(number, "wb", closefd=False) as stream:
                stream.write(content)
            return
        if path.exists() and not path.is_file():
            path.write_bytes(content)
            return
        target = Path(os.path.realpath(path))  # a link stays a link
        unfinished = beside(target)
        if target.exists():
            target.open("ab").close()  # refuses a file without the permission to write
        try:
            with unfinished.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if target.exists():
                shutil.copymode(target, unfinished)
            unfinished.replace(target)
        except BaseException as error:
            with contextlib.suppress(OSError):
                unfinished.unlink()
            if getattr(error, "errno", None) not in NOT_REPLACEABLE or not target.exists():
                raise
            target.write_bytes(content)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def replace_figure(path: Path, figure: Any, **keywords: Any) -> None:
    """Writes a matplotlib figure as `replace_file`. `keywords`: of its `savefig`."""
    content = io.BytesIO()  # Pillow's error on a full disk would have no errno
    figure.savefig(content, format=path.suffix[1:], **keywords)
    replace_file(path, content.getbuffer())


def beside(path: Path) -> Path:
    """Returns the path of a new file in the same folder."""
    # At most 255 bytes, also for a long name in four bytes per character.
    return path.with_name(f"{path.name[:60]}.{secrets.token_hex(4)}.new")


def remove_unfinished(path: Path) -> None:
    """Removes what a killed `replace_file` has left beside `path`."""
    for file in path.parent.glob(f"{path.name}.{8 * '[0-9a-f]'}.new"):
        file.unlink(missing_ok=True)


def descriptor_of(path: Path) -> int | None:
    """Returns the file descriptor of this process that `path` names, e.g. 1 of /dev/stdout; None if
    it is another path. Its file, if any, must neither be replaced nor truncated."""
    found = re.fullmatch(r"/dev/std(out|err)|/(?:dev|proc/self)/fd/([0-9]{1,9})", str(path))
    if not found:
        return None
    return int(found[2] or {"out": 1, "err": 2}[found[1]])


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Lets the error of a full disk or quota name `path`, unless it names a file already."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) and error.filename is None:
            error.filename = str(path)
        raise
