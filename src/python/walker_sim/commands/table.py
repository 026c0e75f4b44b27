"""CSV of episodes, written as they end."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Iterable, Sequence

from walker_sim.commands.episodes import Episode

FIELDS = ("seed", "return", "length", "terminated", "truncated", "end")


class Table:
    """CSV file that has only complete lines at any time.

    Lines are in the order in which episodes end and, after `finish`, in the order of their seeds.

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
        self._head = self._lines([[*FIELDS, *info_names, "error"]])
        self._put(self._head)

    def add(self, episode: Episode) -> None:
        self._put(self._lines([self._row(episode)]))

    def finish(self, episodes: Iterable[Episode]) -> None:
        """Rewrites the file with the same episodes in this order, and closes it."""
        lines = self._head + self._lines(self._row(episode) for episode in episodes)
        if self._file.seekable():
            self._file.seek(0)  # one write of the same length
        self._file.write(lines)
        self._file.close()

    def _put(self, line: bytes) -> None:
        if self._file.seekable():
            self._file.write(line)
            self._file.flush()

    def _row(self, episode: Episode) -> list[object]:
        """Returns a row, with all digits of numbers; absent info is empty."""
        info = [episode.info.get(name, "") for name in self._names]
        outcome = (episode.terminated, episode.truncated, episode.end)
        row = (episode.seed, episode.episode_return, episode.length, *outcome)
        return [*row, *info, episode.error]

    @staticmethod
    def _lines(rows: Iterable[Sequence[object]]) -> bytes:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        return text.getvalue().encode()
