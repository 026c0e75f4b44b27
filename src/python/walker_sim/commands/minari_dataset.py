"""Writes episodes as a data set of Minari, Farama's library for offline reinforcement learning."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import re
import shutil
import warnings
from pathlib import Path
from typing import Any, Iterator, Sequence

import gymnasium
import numpy as np

from walker_sim.commands.episodes import RecordedEpisode
from walker_sim.commands.options import InputError
from walker_sim.commands.policies import policy_text
from walker_sim.files import naming, replace_file
from walker_sim.registration import NAMESPACE
from walker_sim.walkers import Specification, release_of
from walker_sim.worlds import range_text, read_world, text_of

# Minari's own pattern, but a namespace has no empty folder and the version is not optional: Minari
# accepts an id without one and then fails, as it does for a namespace of a single letter.
_ID = re.compile(r"(?!./[^/]*$)([-\w]+/)*[-\w]+-v[0-9]+", re.ASCII)
_NAMESPACE = "namespace_metadata.json"  # Minari's file in each folder of a namespace


class DatasetWriter:
    """Writer of a new data set. Making it refuses all that can be refused before episodes are
    played, with an InputError.

    Parameters
    ----------
    env_id
        The environment of the episodes.
    options
        Options of `record`, with `minari`, the id of the data set, and `parameters`.
    """

    def __init__(self, env_id: str, options: argparse.Namespace) -> None:
        self._options = options
        self._minari = _import_minari()
        self._check_id()
        self._environment = _make_environment(env_id, options)

    def _check_id(self) -> Path:
        """Returns the folder of the data set; InputError if the id is invalid or taken."""
        dataset_id = self._options.minari
        if not _ID.fullmatch(dataset_id):
            raise InputError(
                f"--minari {dataset_id}: must be NAME-vN, with or without FOLDER/ before; a single "
                "FOLDER needs two characters"
            )
        folder = Path(self._minari.storage.get_dataset_path(dataset_id))
        if folder.exists():
            raise InputError(f"--minari {dataset_id}: {folder} exists; `minari delete` removes it")
        return folder

    def write(self, episodes: Sequence[RecordedEpisode], specification: Specification) -> Path:
        """Writes the episodes in their order and returns the data set's folder.

        The environment of `recover_environment` repeats an episode to the bit after a reset with
        the `seed` and `options` of its metadata. If writing fails, no part of the data set stays.
        """
        folder = self._check_id()  # again: the episodes took their time
        new = [one for one in folder.parents if not one.exists()]  # the innermost first
        policy = policy_text(self._options)
        engine = f"{specification['engine']} {release_of(specification['engine_version'])}"
        try:
            with naming(folder), warnings.catch_warnings(), _hdf5_in_memory() as files:
                # Author and link of a data set are its publisher's to add.
                words = r"`(author|author_email|code_permalink|eval_env)` is"
                warnings.filterwarnings("ignore", words)
                dataset = self._minari.create_dataset_from_buffers(
                    self._options.minari,
                    [_buffer_of(episode, specification["info_names"]) for episode in episodes],
                    env=self._environment,
                    algorithm_name=policy,
                    description=(
                        f"{len(episodes)} episodes of {specification['id']} with policy {policy}, "
                        f"recorded by walker_sim {specification['version']} on {engine}"
                    ),
                )
            for path, content in files.items():
                replace_file(path, content.getbuffer())
            world = self._options.world
            metadata = {
                "dataset_size": dataset.storage.get_size(),
                **origin_of(specification, self._options),
                "parameters": dict(specification["parameters"]),
                "world": range_text(read_world(world)) if world is not None else "",
            }
            with naming(folder):
                dataset.storage.update_metadata(metadata)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            for one in new:
                if one.exists() and {file.name for file in one.iterdir()} <= {_NAMESPACE}:
                    shutil.rmtree(one, ignore_errors=True)
            raise
        return folder


@contextlib.contextmanager
def _hdf5_in_memory() -> Iterator[dict[Path, io.BytesIO]]:
    """Lets h5py write to memory, and yields the content by path: on a full disk h5py prints a
    hundred lines and ends the process by SIGSEGV."""
    h5py: Any = importlib.import_module("h5py")
    files: dict[Path, io.BytesIO] = {}

    class MemoryFile(h5py.File):  # type: ignore[misc]
        def __init__(self, name: Any, *arguments: Any, **keywords: Any) -> None:
            super().__init__(files.setdefault(Path(name), io.BytesIO()), *arguments, **keywords)

    file, h5py.File = h5py.File, MemoryFile
    try:
        yield files
    finally:
        h5py.File = file


def _import_minari() -> Any:
    try:
        for name in ("h5py", "PIL"):  # Minari imports them when it writes, and does not declare PIL
            importlib.import_module(name)
        return importlib.import_module("minari")
    except ImportError as error:
        raise InputError(
            f"--minari: needs Minari: pip install 'minari[hdf5]' pillow ({error})"
        ) from error


def _make_environment(env_id: str, options: argparse.Namespace) -> Any:
    """Makes the environment whose specification and spaces the data set has. It is in process also
    if the episodes are a server's, so that every reader of the data set can make it."""
    keywords = dict(options.parameters)
    if keywords.get("max_episode_steps") == 0:
        keywords["max_episode_steps"] = -1  # Gymnasium's word for no limit
    try:
        if options.world is not None:
            keywords["world"] = range_text(read_world(options.world))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*is out of date")  # v4, which the user has chosen
            return gymnasium.make(f"{NAMESPACE}/{env_id}", **keywords)
    except (ValueError, TypeError, RuntimeError) as error:
        raise InputError(str(error)) from error


def _buffer_of(episode: RecordedEpisode, info_names: Sequence[str]) -> Any:
    buffer: Any = importlib.import_module("minari.data_collector").EpisodeBuffer
    steps = episode.steps
    infos = np.array(steps.infos)
    return buffer(
        seed=episode.seed,
        options={"world": text_of(episode.world)} if episode.world else None,
        observations=np.array(steps.observations),
        actions=np.array(steps.actions),
        rewards=np.array(steps.rewards, np.float64),
        terminations=np.array(steps.terminated),
        truncations=np.array(steps.truncated),
        infos={name: infos[:, column] for column, name in enumerate(info_names)},
    )


def origin_of(specification: Specification, options: argparse.Namespace) -> dict[str, str]:
    """Returns what recordings say of their origin, beside the environment."""
    return {
        "policy": policy_text(options),
        "transport": options.transport,
        "engine": specification["engine"],
        "engine_version": specification["engine_version"],
        "walker_sim_version": specification["version"],
        "numpy_version": np.__version__,
    }
