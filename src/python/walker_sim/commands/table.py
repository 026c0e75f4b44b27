"""CSV of episodes, written as they end."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Iterable, Sequence

from walker_sim.commands.episodes import Episode

FIELDS = ("seed", "return", "length", "terminated", "truncated", "end")


class Table:
    """CSV file that has only whole lines at any time, in the order in which episodes end.

    Parameters
    ----------
    path
        File to overwrite. If it is not seekable, such as a pipe, `finish` writes all lines.
    info_names
        Columns besides those of every walker.
    """

    def __init__(self, path: Path, info_names: Sequence[str]) -> None:
        self._names = info_names
        self._file = path.open("wb")
        self._head = _line([*FIELDS, *info_names, "error"])
        self._append(self._head)

    def add(self, episode: Episode) -> None:
        self._append(self._line_of(episode))

    def finish(self, episodes: Iterable[Episode]) -> None:
        """Rewrites the file with the same episodes in this order, and closes it."""
        if self._file.seekable():
            self._file.seek(0)
        self._file.write(self._head + b"".join(map(self._line_of, episodes)))
        self._file.close()

    def _append(self, line: bytes) -> None:
        if self._file.seekable():
            self._file.write(line)
            self._file.flush()

    def _line_of(self, episode: Episode) -> bytes:
        """Returns a line, with all digits of numbers; absent info is empty."""
        info = [episode.info.get(name, "") for name in self._names]
        outcome = (episode.terminated, episode.truncated, episode.end)
        row = (episode.seed, episode.episode_return, episode.length, *outcome)
        return _line([*row, *info, episode.error])


def _line(row: Sequence[object]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(row)
    return text.getvalue().encode()
