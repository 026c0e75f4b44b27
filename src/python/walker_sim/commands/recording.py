"""The .npz file of recorded episodes."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim.commands import options as common
from walker_sim.commands.episodes import RecordedEpisode, Steps
from walker_sim.commands.minari_dataset import origin_of
from walker_sim.walkers import Specification
from walker_sim.worlds import text_of

FORMAT = 1
FORMAT_WITH_PUSHES = 2

FILE_HELP = """\
numpy.load(FILE) reads the file, without pickle. With T steps and E episodes in the order of seeds:
  seeds                           (E,) uint64
  episode_starts                  (E + 1,) int64: first step of each episode; its first state, the
                                  reset's, is [episode_starts[e] + e]
  observations, infos             (T + E, observation size), (T + E, info names): the states
  actions                         (T, action size) float32
  rewards, terminated, truncated  (T,) float64, bool, bool
  info_names                      columns of infos, where NaN is an absent value
  worlds                          (E,) what each episode has drawn from its world, as a text for
                                  --world; empty: Gymnasium's
  id, parameter_names, parameter_values, policy, transport
                                  what was recorded, and where
  engine, engine_version          with the variant of the C library ("libm")
  walker_sim_version, numpy_version
                                  versions on the recording client
  push_steps, push_forces         (P,) int64, (P, 2) float64: steps in which the trunk was pushed by
                                  hand (`play --web`), and the forces along x and z [N]
  format                          1; 2 with pushes by hand, else their arrays are absent
"""


def arrays_of(
    episodes: Sequence[RecordedEpisode], specification: Specification, options: argparse.Namespace
) -> dict[str, Any]:
    """Returns the arrays of the file by name; see FILE_HELP."""
    parameters = specification["parameters"]
    starts = np.cumsum([0, *(episode.length for episode in episodes)], dtype=np.int64)
    pushes = [
        (start + step, force)
        for start, episode in zip(starts, episodes)
        for step, force in episode.pushes
    ]
    return {
        "format": FORMAT_WITH_PUSHES if pushes else FORMAT,
        "id": specification["id"],
        "parameter_names": np.array(list(parameters), np.str_),
        "parameter_values": np.array(list(parameters.values()), np.str_),
        **origin_of(specification, options),
        "info_names": np.array(specification["info_names"], np.str_),
        "seeds": np.array([episode.seed for episode in episodes], np.uint64),
        "worlds": np.array(
            [text_of(episode.world) if episode.world else "" for episode in episodes], np.str_
        ),
        "episode_starts": starts,
        **{
            name: np.concatenate([getattr(episode.steps, name) for episode in episodes])
            for name in Steps._fields
        },
        **(_push_arrays(pushes) if pushes else {}),
    }


def _push_arrays(pushes: Sequence[tuple[int, Sequence[float]]]) -> dict[str, NDArray[Any]]:
    return {
        "push_steps": np.array([step for step, _ in pushes], np.int64),
        "push_forces": np.array([force for _, force in pushes], np.float64).reshape(-1, 2),
    }


# Dimensions and types of the arrays, and what their rows stand for, empty: any number of rows.
LAYOUTS: dict[str, tuple[int, str, str]] = {
    "id": (0, "str", ""),
    "parameter_names": (1, "str", ""),
    "parameter_values": (1, "str", ""),
    "engine": (0, "str", ""),
    "engine_version": (0, "str", ""),
    "seeds": (1, "uint64", "episodes"),
    "worlds": (1, "str", "episodes"),
    "episode_starts": (1, "int64", ""),
    "observations": (2, "float32 or float64", "states"),
    "infos": (2, "float64", "states"),
    "actions": (2, "float32", "steps"),
    "rewards": (1, "float64", "steps"),
    "terminated": (1, "bool", "steps"),
    "truncated": (1, "bool", "steps"),
    "push_steps": (1, "int64", "pushes"),
    "push_forces": (2, "float64", "pushes"),
}


def load(path: Path) -> dict[str, NDArray[Any]]:
    """Loads a recording; OSError if the file cannot be opened. An InputError says that the file is
    not a recording or is damaged, and names an inconsistent array."""
    if path.exists() and not path.is_file():
        raise common.InputError(f"{path}: must be a regular file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy warns of outdated formats
            with np.load(path) as file:
                arrays = {name: file[name] for name in file.files}
        found = int(arrays["format"])
        if "seeds" in arrays:  # written before there were worlds
            arrays.setdefault("worlds", np.full(np.shape(arrays["seeds"]), ""))
        if found == FORMAT:
            arrays = {**_push_arrays([]), **arrays}
        for array in arrays.values():
            if array.dtype.kind == "U":
                array.tolist()  # raises for invalid code points
    except Exception as error:  # damaged archives raise many types
        if isinstance(error, OSError) and error.filename is not None:
            raise
        reason = " ".join(str(error).split()) or type(error).__name__
        raise common.InputError(f"{path}: not a recording: {reason[:300]}") from error
    missing = {*LAYOUTS} - {*arrays}
    known = FORMAT, FORMAT_WITH_PUSHES
    if found not in known or missing:
        what = f"without {', '.join(sorted(missing))}" if found in known else f"of format {found}"
        allowed = " or ".join(map(str, known))
        raise common.InputError(f"{path}: a recording {what}; must be of format {allowed}")
    try:
        _check_layout(arrays)
    except ValueError as error:
        raise common.InputError(f"{path}: {error}") from error
    return arrays


def _check_layout(arrays: Mapping[str, NDArray[Any]]) -> None:
    for name, (dimensions, types, _) in LAYOUTS.items():
        array = arrays[name]
        if array.ndim != dimensions or array.dtype.type.__name__.rstrip("_") not in types.split():
            raise ValueError(
                f"{name} has {array.ndim} dimensions and type {array.dtype}; must have "
                f"{dimensions} and {types}"
            )
    starts, steps, episodes = arrays["episode_starts"], len(arrays["actions"]), len(arrays["seeds"])
    if starts.shape != (episodes + 1,) or starts[0] != 0 or starts[-1] != steps:
        raise ValueError(f"episode_starts does not fit {episodes} seeds and {steps} steps")
    if episodes == 0 or (starts[1:] < starts[:-1]).any():
        raise ValueError("episode_starts must be ascending, with at least one episode")
    pushed = arrays["push_steps"]
    counts = {"episodes": episodes, "steps": steps, "states": steps + episodes}
    counts["pushes"] = len(pushed)
    for name, (_, _, rows) in LAYOUTS.items():
        if rows and len(arrays[name]) != counts[rows]:
            raise ValueError(
                f"{name} has {len(arrays[name])} rows; must have {counts[rows]}, one for each of "
                f"its {rows}"
            )
    if len(arrays["parameter_names"]) != len(arrays["parameter_values"]):
        raise ValueError("parameter_names does not fit parameter_values")
    for name in ("actions", "push_forces"):
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} must be finite")
    if arrays["push_forces"].shape[1] != 2:
        raise ValueError("push_forces must have two columns, the forces along x and z")
    if (np.diff(pushed, prepend=-1) <= 0).any() or (pushed >= steps).any():
        raise ValueError(f"push_steps must be ascending, from 0 to {steps - 1}")


def episode_of(recorded: Mapping[str, NDArray[Any]], index: int) -> dict[str, NDArray[Any]]:
    """Returns one episode's rows of the arrays that have one for each step, state or push.
    `push_steps` count from the episode's first step."""
    begin, end = recorded["episode_starts"][index : index + 2]
    pushed = slice(*np.searchsorted(recorded["push_steps"], [begin, end]))
    rows = {
        "steps": slice(begin, end),
        "states": slice(begin + index, end + index + 1),
        "pushes": pushed,
    }
    episode = {
        name: recorded[name][rows[kind]] for name, (_, _, kind) in LAYOUTS.items() if kind in rows
    }
    episode["push_steps"] = episode["push_steps"] - begin
    return episode
