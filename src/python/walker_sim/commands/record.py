"""``record``: records episodes in a file, or checks that a file's episodes repeat to the bit."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from walker_sim.commands import options as common
from walker_sim.commands.episodes import Episode, play
from walker_sim.commands.policies import POLICY_HELP, make_policies, policy_text
from walker_sim.commands.progress import shown
from walker_sim.transport import Specification, Walkers, libm_of, release_of

FORMAT = 1
EPISODES = 10

DESCRIPTION = """\
Plays one episode for each seed and writes all of it to one .npz file. With --check FILE repeats
the actions of such a file from its seeds and says whether every bit of every observation, reward,
flag and info is equal.
"""

FILE_HELP = """\
The file, for numpy.load(FILE), without pickle. T steps, E episodes, in the order of the seeds:
  seeds                           (E,) uint64
  episode_starts                  (E + 1,) int64: episode e has the steps [e] to [e + 1], and the
                                  states from [e] + e: one more than steps, its first the reset's
  observations, infos             (T + E, observation size), (T + E, info names): the states
  actions                         (T, action size) float32
  rewards, terminated, truncated  (T,) float64, bool, bool
  info_names                      of the columns of infos, where NaN is an absent value
  id, parameter_names, parameter_values, policy, transport
                                  what played, and where
  engine, engine_version          of what played, with the variant of the C library ("libm")
  walker_sim_version, numpy_version
                                  of this machine, also where a server played
  format                          1
"""

EPILOG = f"""\
{common.WALKER_HELP}
{POLICY_HELP}
{FILE_HELP}
examples:
  python3 -m walker_sim record BipedalWalker-v3 --output walk.npz
  python3 -m walker_sim record Walker2d-v5 --policy model.zip --seeds 0:50 --output expert.npz
  python3 -m walker_sim record --check walk.npz
  python3 -m walker_sim record --check walk.npz --transport ros    # the same bits over ROS
"""


def _parser() -> common.Parser:
    parser = common.Parser("record", DESCRIPTION, EPILOG)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument(
        "--output", type=common.output_file, metavar="FILE", help="the .npz to be written"
    )
    action.add_argument(
        "--check", type=Path, metavar="FILE", help="repeat this one; ID and policy are the file's"
    )
    common.add_episodes(parser, EPISODES)
    common.add_walker_options(parser)
    common.add_num_envs(parser)
    return parser


def run(arguments: Sequence[str]) -> int:
    """Records or checks. Returns the exit status: 1 if a check found a difference."""
    options = _parser().parse_intermixed_args(arguments)
    if options.check:
        return _check(options)
    if options.output.suffix != ".npz":
        raise common.InputError(f"--output {options.output}: must end in .npz")
    env_id, parameters = common.walker_of(options.walker)
    seeds = common.chosen_seeds(options)
    walkers = common.make_walkers(options, env_id, parameters, options.num_envs, len(seeds))
    policies = make_policies(
        *(options.policy, env_id, parameters, walkers.specification), options.normalization
    )
    episodes = sorted(shown(play(walkers, seeds, policies, keeps_steps=True), len(seeds)))
    for episode in episodes:
        if episode.length == 0:
            raise common.InputError(
                f"seed {episode.seed}: the simulation failed at its reset: {episode.error}"
            )
    np.savez_compressed(options.output, **arrays_of(episodes, walkers.specification, options))
    walkers.close()
    steps = sum(episode.length for episode in episodes)
    size = options.output.stat().st_size / 1e6
    print(f"{options.output}: {len(episodes)} episodes, {steps:,} steps, {size:.1f} MB")
    return 0


def arrays_of(
    episodes: Sequence[Episode], specification: Specification, options: argparse.Namespace
) -> dict[str, Any]:
    """Returns the arrays of the file by name; see FILE_HELP."""
    all_steps = [episode.steps for episode in episodes]
    lengths = [episode.length for episode in episodes]
    return {
        "format": FORMAT,
        "id": specification["id"],
        "parameter_names": np.array(list(specification["parameters"]), np.str_),
        "parameter_values": np.array(list(specification["parameters"].values()), np.str_),
        "policy": policy_text(options),
        "transport": options.transport,
        "engine": specification["engine"],
        "engine_version": specification["engine_version"],
        "walker_sim_version": specification["version"],
        "numpy_version": np.__version__,
        "info_names": np.array(specification["info_names"], np.str_),
        "seeds": np.array([episode.seed for episode in episodes], np.uint64),
        "episode_starts": np.cumsum([0, *lengths], dtype=np.int64),
        "observations": np.concatenate([steps.observations for steps in all_steps]),
        "infos": np.concatenate([steps.infos for steps in all_steps]),
        "actions": np.concatenate([steps.actions for steps in all_steps]),
        "rewards": np.concatenate([steps.rewards for steps in all_steps]),
        "terminated": np.concatenate([steps.terminated for steps in all_steps]),
        "truncated": np.concatenate([steps.truncated for steps in all_steps]),
    }


class _Layout(NamedTuple):
    """Requirements of an array in a file."""

    dimensions: int
    types: tuple[type[Any], ...]
    rows: str = ""  # there is one row for each of the episodes, steps or states; empty: any number


_LAYOUTS = {
    "id": _Layout(0, (np.str_,)),
    "parameter_names": _Layout(1, (np.str_,)),
    "parameter_values": _Layout(1, (np.str_,)),
    "engine": _Layout(0, (np.str_,)),
    "engine_version": _Layout(0, (np.str_,)),
    "seeds": _Layout(1, (np.uint64,), "episodes"),
    "episode_starts": _Layout(1, (np.int64,)),
    "observations": _Layout(2, (np.float32, np.float64), "states"),
    "infos": _Layout(2, (np.float64,), "states"),
    "actions": _Layout(2, (np.float32,), "steps"),
    "rewards": _Layout(1, (np.float64,), "steps"),
    "terminated": _Layout(1, (np.bool_,), "steps"),
    "truncated": _Layout(1, (np.bool_,), "steps"),
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
        for array in arrays.values():
            if array.dtype.kind == "U":
                array.tolist()  # raises for invalid code points
    except Exception as error:  # damaged archives raise many types
        if isinstance(error, OSError) and error.filename is not None:
            raise
        reason = " ".join(str(error).split()) or type(error).__name__
        raise common.InputError(f"{path}: no recording of this command: {reason[:300]}") from error
    missing = {*_LAYOUTS} - {*arrays}
    if found != FORMAT or missing:
        what = f"without {', '.join(sorted(missing))}" if missing else f"of format {found}"
        raise common.InputError(f"{path}: a recording {what}; must be of format {FORMAT}")
    _check_layout(path, arrays)
    return arrays


def _check_layout(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    for name, layout in _LAYOUTS.items():
        array = arrays[name]
        if array.ndim != layout.dimensions or array.dtype.type not in layout.types:
            types = " or ".join(one.__name__ for one in layout.types)
            raise common.InputError(
                f"{path}: {name} has {array.ndim} dimensions and type {array.dtype}; must have "
                f"{layout.dimensions} and {types}"
            )
    starts, steps, episodes = arrays["episode_starts"], len(arrays["actions"]), len(arrays["seeds"])
    if starts.shape != (episodes + 1,) or starts[0] != 0 or starts[-1] != steps:
        raise common.InputError(
            f"{path}: episode_starts does not fit to {episodes} seeds and {steps} steps"
        )
    if episodes == 0 or (starts[1:] < starts[:-1]).any():
        raise common.InputError(f"{path}: episode_starts must go upwards, from one episode on")
    rows = {"episodes": episodes, "steps": steps, "states": steps + episodes}
    for name, layout in _LAYOUTS.items():
        if layout.rows and len(arrays[name]) != rows[layout.rows]:
            raise common.InputError(
                f"{path}: {name} has {len(arrays[name])} rows; must have {rows[layout.rows]}, one "
                f"for each of its {layout.rows}"
            )
    if len(arrays["parameter_names"]) != len(arrays["parameter_values"]):
        raise common.InputError(f"{path}: parameter_names does not fit to parameter_values")
    if not np.isfinite(arrays["actions"]).all():
        raise common.InputError(f"{path}: actions must be finite")


def _check(options: argparse.Namespace) -> int:
    for name in ("walker", "seeds", "episodes"):
        if getattr(options, name):
            raise common.InputError(
                f"--check {options.check}: {name} cannot be given, is the file's"
            )
    recorded = load(options.check)
    env_id = str(recorded["id"])
    texts = dict(zip(recorded["parameter_names"].tolist(), recorded["parameter_values"].tolist()))
    try:
        _, parameters = common.walker_of([env_id, *map("=".join, texts.items())])
    except common.InputError as error:
        raise common.InputError(f"{options.check}: {error}") from error
    try:
        walkers = common.make_walkers(options, env_id, parameters, options.num_envs, 1)
    except common.InputError as error:
        raise common.InputError(f"{options.check}: {error}") from error
    size = len(walkers.specification["action_low"])
    if recorded["actions"].shape[1] != size:
        raise common.InputError(
            f"{options.check}: actions have {recorded['actions'].shape[1]} values; must have "
            f"{size}, as {env_id} has them"
        )
    versions = walkers.specification["engine_version"], str(recorded["engine_version"])
    here, there = map(release_of, versions)
    if here != there:
        print(f"recorded on {recorded['engine']} {there}, repeated on {here}")
    here, there = map(libm_of, versions)
    if here and there and here != there:
        print(
            f"recorded with libm: {there}; repeated with libm: {here}: its sin, cos and pow differ "
            "in the last bit, so episodes may differ"
        )
    print(f"{'seed':>20}  steps     return", flush=True)
    equal = 0
    starts = recorded["episode_starts"]
    for index, seed in enumerate(recorded["seeds"].tolist()):
        length = int(starts[index + 1] - starts[index])
        total = sum(recorded["rewards"][starts[index] : starts[index + 1]].tolist())
        difference = repeat(walkers, seed, _part(recorded, index))
        equal += not difference
        print(f"{seed:>20}  {length:>5}  {total:>9.2f}  {difference or 'equal'}", flush=True)
    walkers.close()
    count = len(recorded["seeds"])
    all_equal = equal == count
    what = "equal to the bit" if all_equal else "equal"
    print(f"{equal} of {count} episodes {what} ({starts[-1]:,} steps)")
    return 0 if all_equal else 1


def _part(recorded: Mapping[str, NDArray[Any]], index: int) -> dict[str, NDArray[Any]]:
    begin, end = recorded["episode_starts"][index : index + 2]
    part = {
        name: recorded[name][begin + index : end + index + 1] for name in ("observations", "infos")
    }
    names = ("actions", "rewards", "terminated", "truncated")
    return {**part, **{name: recorded[name][begin:end] for name in names}}


def repeat(walkers: Walkers, seed: int, recorded: Mapping[str, NDArray[Any]]) -> str:
    """Repeats an episode in the first environment. Returns the first difference, empty if none."""
    actions = np.zeros((walkers.num_envs, recorded["actions"].shape[1]))
    observations, infos = walkers.reset([], [seed] * walkers.num_envs)
    error = walkers.reset_error(0)
    if error:
        return f"fails at its reset: {error}"
    values = {"observations": observations[0], "infos": infos[0]}
    difference = _differs(values, recorded, 0, 0)
    for step, action in enumerate(recorded["actions"], 1):
        if difference:
            return difference
        actions[0] = action
        batch = walkers.step(actions)
        ends = bool(batch.terminated[0] or batch.truncated[0])
        values = {"observations": batch.observations[0], "infos": batch.info[0]}
        difference = _differs(values, recorded, step, step)
        flags = {"terminated": batch.terminated[0], "truncated": batch.truncated[0]}
        outcome = {"rewards": batch.rewards[0], **flags}
        difference = difference or _differs(outcome, recorded, step - 1, step)
        if ends and step < len(recorded["actions"]) and not difference:
            return f"ends at step {step}"
    return difference


def _differs(
    values: Mapping[str, Any], recorded: Mapping[str, NDArray[Any]], row: int, step: int
) -> str:
    for name, value in values.items():
        ours, theirs = np.atleast_1d(value), np.atleast_1d(recorded[name][row])
        if ours.tobytes() == theirs.tobytes():
            continue
        if ours.shape != theirs.shape or ours.dtype != theirs.dtype:
            return f"{name} are {ours.shape} {ours.dtype}, recorded {theirs.shape} {theirs.dtype}"
        bytes_of = [array.view(np.uint8).reshape(len(array), -1) for array in (ours, theirs)]
        place = int(np.argmax((bytes_of[0] != bytes_of[1]).any(axis=1)))
        return (
            f"differs at step {step}: {name}[{place}] is {theirs[place].item()!r}, "
            f"repeated {ours[place].item()!r}"
        )
    return ""
