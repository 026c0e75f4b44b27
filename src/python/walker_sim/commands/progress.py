"""Progress bar of episodes."""

from __future__ import annotations

import importlib
import sys
from typing import Any, Iterable, Iterator

from walker_sim.commands.episodes import Episode


def shown(episodes: Iterable[Episode], total: int) -> Iterator[Episode]:
    """Yields the same episodes. With tqdm, shows a bar on standard error if it is a terminal."""
    try:
        tqdm: Any = importlib.import_module("tqdm").tqdm
    except ImportError:
        if sys.stderr.isatty():
            print("no progress bar without tqdm: pip install tqdm", file=sys.stderr)
        yield from episodes
        return
    returns = 0.0
    # disable=None: no bar if standard error is not a terminal.
    with tqdm(total=total, unit=" episodes", disable=None, leave=False) as bar:
        for count, episode in enumerate(episodes, 1):
            returns += episode.episode_return
            bar.set_postfix_str(f"mean return {returns / count:.1f}", refresh=False)
            bar.update()
            yield episode
