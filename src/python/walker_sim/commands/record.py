"""``record``: records episodes in a file or a data set, or checks that a file's episodes repeat to
the bit."""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.commands.episodes import RecordedEpisode, play, progress
from walker_sim.commands.minari_dataset import DatasetWriter
from walker_sim.commands.policies import POLICY_HELP, make_policies
from walker_sim.commands.recording import FILE_HELP, LAYOUTS, arrays_of, episode_of, load
from walker_sim.files import replace_file
from walker_sim.walkers import Specification, Walkers, release_of, variant_of
from walker_sim.worlds import World

EPISODES = 10

DESCRIPTION = """\
Plays one episode for each seed and writes the episodes to one .npz file or to a data set of Minari.
With --check FILE, resets with the seeds of such a file, repeats its actions and compares every bit
of observations, rewards, flags and infos.
"""

MINARI_HELP = """\
minari.load_dataset(DATASET_ID) reads a data set, which is in MINARI_DATASETS_PATH, or in
~/.minari/datasets. Its episodes have the file's arrays, and seed and options of the reset as
metadata; infos are NaN where absent. The data set's metadata has the environment and, as the file,
parameters, policy, world, transport, engine and versions.
"""

EPILOG = f"""\
{common.WALKER_HELP}
{POLICY_HELP}
{FILE_HELP}
{MINARI_HELP}
examples:
  python3 -m walker_sim record BipedalWalker-v3 --output walk.npz
  python3 -m walker_sim record Walker2d-v5 --policy model.zip --seeds 0:50 --output expert.npz
  python3 -m walker_sim record BipedalWalker-v3 --world hard --output hard.npz
  python3 -m walker_sim record Walker2d-v5 --policy shipped --minari walker2d/shipped-v0
  python3 -m walker_sim record --check walk.npz
  python3 -m walker_sim record --check walk.npz --transport ros    # the same bits over ROS
"""


def run(arguments: Sequence[str]) -> int:
    parser = common.Parser("record", DESCRIPTION, EPILOG)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument(
        "--output", type=common.output_file, metavar="FILE", help="the .npz file to write"
    )
    action.add_argument(
        "--minari", metavar="DATASET_ID", help="the data set to write, e.g. walker2d/shipped-v0"
    )
    action.add_argument(
        "--check", type=Path, metavar="FILE", help="repeat this file's episodes, on its environment"
    )
    common.add_episodes(parser, EPISODES)
    common.add_world(parser)
    common.add_walker_options(parser)
    common.add_num_envs(parser)
    options = parser.parse_intermixed_args(arguments)
    if options.check:
        return _check(options)
    if options.output and options.output.suffix != ".npz":
        raise common.InputError(f"--output {options.output}: must end in .npz")
    env_id, options.parameters = common.walker_of(options.walker)
    writer = None if options.minari is None else DatasetWriter(env_id, options)
    episodes, specification = _play(options, env_id)
    if writer is None:
        content = io.BytesIO()
        np.savez_compressed(content, **arrays_of(episodes, specification, options))
        replace_file(options.output, content.getbuffer())
        name, files = str(options.output), [options.output]
    else:
        folder = writer.write(episodes, specification)
        name, files = f"{options.minari} in {folder}", [*folder.glob("data/*")]
    steps = sum(episode.length for episode in episodes)
    size = sum(file.stat().st_size for file in files) / 1e6
    print(f"{name}: {len(episodes)} episodes, {steps:,} steps, {size:.1f} MB")
    return 0


def _play(options: argparse.Namespace, env_id: str) -> tuple[list[RecordedEpisode], Specification]:
    """Plays the episodes and returns them in the order of the seeds."""
    seeds = common.chosen_seeds(options)
    walkers = common.make_walkers(options, env_id, options.parameters, options.num_envs, len(seeds))
    specification = walkers.specification
    policies = make_policies(options, env_id, options.parameters, specification)
    episodes = []
    with progress(len(seeds)) as show:
        for episode in play(walkers, seeds, policies, keeps_steps=True):
            show(episode)
            episodes.append(episode)
    walkers.close()
    episodes.sort()
    for episode in episodes:
        if episode.length == 0:
            raise common.InputError(
                f"seed {episode.seed}: the simulation failed at its reset: {episode.error}"
            )
    return episodes, specification


def _check(options: argparse.Namespace) -> int:
    for name in ("walker", "seeds", "episodes", "world"):
        if getattr(options, name):
            raise common.InputError(f"--check {options.check}: not allowed with {name}")
    recorded = load(options.check)
    env_id = str(recorded["id"])
    pairs = zip(recorded["parameter_names"].tolist(), recorded["parameter_values"].tolist())
    try:
        _, parameters = common.walker_of([env_id, *map("=".join, pairs)])
        walkers = common.make_walkers(options, env_id, parameters, options.num_envs, 1)
        worlds = [_to_world(env_id, text) for text in recorded["worlds"].tolist()]
    except (common.InputError, ValueError) as error:
        raise common.InputError(f"{options.check}: {error}") from error
    if len(recorded["push_steps"]) and options.transport == "ros":
        raise common.InputError(
            f"{options.check}: has pushes by hand, which are repeated in process only; must be "
            "checked with --transport inprocess"
        )
    size = len(walkers.specification["action_low"])
    if recorded["actions"].shape[1] != size:
        raise common.InputError(
            f"{options.check}: actions have {recorded['actions'].shape[1]} values; must have "
            f"{size}, as in {env_id}"
        )
    versions = walkers.specification["engine_version"], str(recorded["engine_version"])
    here, there = map(release_of, versions)
    if here != there:
        print(f"recorded on {recorded['engine']} {there}, repeated on {here}")
    here, there = (variant_of(version, "libm") for version in versions)
    if here and there and here != there:
        print(
            f"recorded with libm: {there}; repeated with libm: {here}: its sin, cos and pow differ "
            "in the last bit, so episodes may differ"
        )
    here, there = (variant_of(version, "levels") or "boxes" for version in versions)
    of_levels = ("ground_", "obstacle_", "pit_", "stump_", "stair_")
    if here != there and any(name.startswith(of_levels) for world in worlds for name in world):
        raise common.InputError(
            f"{options.check}: recorded in levels of {there}; must be of {here}, as here"
        )
    print(f"{'seed':>20}  steps     return", flush=True)
    num_equal = 0
    for index, seed in enumerate(recorded["seeds"].tolist()):
        episode = episode_of(recorded, index)
        walkers.set_world([], [worlds[index]])
        difference = repeat(walkers, seed, episode)
        num_equal += not difference
        print(
            f"{seed:>20}  {len(episode['actions']):>5}  {sum(episode['rewards'].tolist()):>9.2f}  "
            f"{difference or 'equal'}",
            flush=True,
        )
    walkers.close()
    count = len(recorded["seeds"])
    what = "equal to the bit" if num_equal == count else "equal"
    print(f"{num_equal} of {count} episodes {what} ({len(recorded['actions']):,} steps)")
    return 0 if num_equal == count else 1


def _to_world(env_id: str, text: str) -> World:
    """Reads a text that `text_of` has written: no name of a preset or a file."""
    world = _core.parse_world(text.encode("utf-8", "surrogatepass"), "of the recording")
    _core.check_world(env_id, world)
    return world


def repeat(walkers: Walkers, seed: int, recorded: Mapping[str, NDArray[Any]]) -> str:
    """Repeats an episode in the first environment. Returns the first difference, empty if none."""
    actions = np.zeros((walkers.num_envs, recorded["actions"].shape[1]))
    observations, infos = walkers.reset([], [seed] * walkers.num_envs)
    error = walkers.reset_error(0)
    if error:
        return f"fails at its reset: {error}"
    difference = _difference((observations[0], infos[0]), recorded, 0)
    pushes = dict(zip(recorded["push_steps"].tolist(), recorded["push_forces"].tolist()))
    for step, action in enumerate(recorded["actions"], 1):
        if difference:
            break
        if step - 1 in pushes:
            try:
                walkers.pool("pushes").push_trunk(0, *pushes[step - 1])
            except ValueError as error:
                return f"cannot be pushed in step {step}: {error}"
        actions[0] = action
        batch = walkers.step(actions)
        outcome = batch.rewards[0], batch.terminated[0], batch.truncated[0]
        difference = _difference((batch.observations[0], batch.info[0], *outcome), recorded, step)
        if any(outcome[1:]) and step < len(recorded["actions"]):
            difference = difference or f"ends at step {step}"
    return difference


def _difference(values: Sequence[Any], recorded: Mapping[str, NDArray[Any]], step: int) -> str:
    """Compares observation and info and, after a step, reward, terminated and truncated."""
    names = ("observations", "infos", "rewards", "terminated", "truncated")
    for name, value in zip(names, values):
        row = step if LAYOUTS[name][2] == "states" else step - 1
        ours, theirs = np.atleast_1d(value), np.atleast_1d(recorded[name][row])
        if ours.tobytes() == theirs.tobytes():
            continue
        if ours.shape != theirs.shape or ours.dtype != theirs.dtype:
            return f"{name} are {ours.shape} {ours.dtype}, recorded {theirs.shape} {theirs.dtype}"
        bytes_of = [array.view(np.uint8).reshape(len(array), -1) for array in (ours, theirs)]
        index = int(np.argmax((bytes_of[0] != bytes_of[1]).any(axis=1)))
        return (
            f"differs at step {step}: {name}[{index}] is {theirs[index].item()!r}, "
            f"repeated {ours[index].item()!r}"
        )
    return ""
