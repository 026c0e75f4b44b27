"""The CSV of episodes, a line each, written as they end."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Iterable, Sequence

from walker_sim.commands.episodes import Episode

FIELDS = ("seed", "return", "length", "terminated", "truncated", "end")


class Table:
    """A file that has, at any time, whole lines alone: the episodes that have ended, in the order
    in which they did, and at last in the order of their seeds.

    Parameters
    ----------
    path
        Is written anew. What is no regular file, such as a pipe, gets all lines at last.
    info_names
        Columns beside those of every walker.
    """

    def __init__(self, path: Path, info_names: Sequence[str]) -> None:
        self._names = info_names
        self._file = path.open("wb")
        self._head = self._lines([[*FIELDS, *info_names, "error"]])
        self._put(self._head)

    def add(self, episode: Episode) -> None:
        """An episode has ended."""
        self._put(self._lines([self._row(episode)]))

    def finish(self, episodes: Iterable[Episode]) -> None:
        """The same episodes in the order that the file is to have."""
        lines = self._head + self._lines(self._row(episode) for episode in episodes)
        if self._file.seekable():
            self._file.seek(0)  # as long as what it has now, in one piece
        self._file.write(lines)
        self._file.close()

    def _put(self, line: bytes) -> None:
        if self._file.seekable():
            self._file.write(line)
            self._file.flush()

    def _row(self, episode: Episode) -> list[object]:
        """Numbers with all digits, absent info empty."""
        info = [episode.info.get(name, "") for name in self._names]
        outcome = (episode.terminated, episode.truncated, episode.end)
        row = (episode.seed, episode.episode_return, episode.length, *outcome)
        return [*row, *info, episode.error]

    @staticmethod
    def _lines(rows: Iterable[Sequence[object]]) -> bytes:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        return text.getvalue().encode()
