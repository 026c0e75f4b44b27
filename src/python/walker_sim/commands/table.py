"""The CSV file of episodes."""

from __future__ import annotations

import contextlib
import csv
import io
from pathlib import Path
from typing import Callable, Iterable, Sequence, TextIO

from walker_sim.episode_player import PlayedEpisode
from walker_sim.files import NOT_REPLACEABLE, beside, descriptor_of, naming, replace_file
from walker_sim.worlds import Range, ends_of

FIELDS = ("seed", "return", "length", "terminated", "truncated", "end")


class Table:
    """CSV file that has only whole lines at any time, in the order in which episodes end.

    Parameters
    ----------
    path
        The file. If it exists already, the lines go to the file `written` beside it until `finish`,
        unless its folder is not writable. If it is a pipe or a file descriptor, `finish` writes all
        lines (`is_stream`).
    info_names, world_names
        Columns besides those of every walker: of infos, and of the parameters of the world.
    world_of
        Returns an episode's text for a first column ``world``; None: there is no such column.
    """

    def __init__(
        self,
        path: Path,
        info_names: Sequence[str],
        world_names: Sequence[str] = (),
        world_of: Callable[[PlayedEpisode], str] | None = None,
    ) -> None:
        self._info_names, self._world_names = info_names, world_names
        self._world_of = world_of
        self._path = self.written = path
        number = descriptor_of(path)
        if number is None and path.is_file():
            path.open("a").close()  # must be writable, which `finish` would find out after hours
            self.written = beside(path)
            try:
                self.written.touch()
            except OSError as error:
                if error.errno not in NOT_REPLACEABLE:
                    raise
                self.written = path
        # Flushes after each line.
        file = self.written if number is None else number
        self._file = open(file, "w", 1, "utf-8", newline="", closefd=number is None)
        self.is_stream = number is not None or not self._file.seekable()
        if self.is_stream:
            return
        try:
            self._write(self._file, [self._head()])
        except OSError:
            if self.written.is_file():
                with contextlib.suppress(OSError):
                    self.written.unlink()
            raise

    def add(self, episode: PlayedEpisode) -> None:
        if not self.is_stream:
            self._write(self._file, [self._row_of(episode)])

    def finish(self, episodes: Iterable[PlayedEpisode]) -> None:
        """Replaces the file by one that has the same episodes in this order."""
        rows: list[Sequence[object]] = [self._head(), *map(self._row_of, episodes)]
        if self.is_stream:
            self._write(self._file, rows)
            self._file.close()
            return
        self._file.close()
        text = io.StringIO(newline="")
        self._write(text, rows)
        replace_file(self._path, text.getvalue().encode())
        if self.written != self._path:
            self.written.unlink()

    def _write(self, file: TextIO, rows: Iterable[Sequence[object]]) -> None:
        with naming(self.written):
            csv.writer(file, lineterminator="\n").writerows(rows)

    def _head(self) -> list[str]:
        first = ["world"] if self._world_of else []
        return [*first, *FIELDS, *self._info_names, *self._world_names, "error"]

    def _row_of(self, episode: PlayedEpisode) -> list[object]:
        """Returns a row; absent info is empty."""
        info = [episode.info.get(name, "") for name in self._info_names]
        world = [_entry(episode.world.get(name, "")) for name in self._world_names]
        outcome = (episode.terminated, episode.truncated, episode.end)
        row = (episode.seed, episode.episode_return, episode.length, *outcome)
        first = [self._world_of(episode)] if self._world_of else []
        return [*first, *row, *info, *world, episode.error]


def _entry(drawn: float | Range | str) -> float | str:
    """Returns a number, or a range as in a world's text."""
    if isinstance(drawn, (float, str)):
        return drawn
    low, high = ends_of(drawn)
    return f"{{log: [{low}, {high}]}}" if isinstance(drawn, dict) else f"[{low}, {high}]"
