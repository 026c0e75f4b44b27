"""Options that commands share, and the parsing of their values."""

from __future__ import annotations

import argparse
import functools
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any, Sequence

import walker_sim.making
from walker_sim import _core
from walker_sim.commands import InputError as InputError
from walker_sim.commands import Parser as Parser
from walker_sim.registration import without_namespace
from walker_sim.walkers import TRANSPORTS, ServerAddress, Walkers
from walker_sim.worlds import to_world

DEFAULT_NUM_ENVS = 16  # in process
MAX_SEEDS = 1_000_000

ID_HELP = f"""\
ID, with or without "walker_sim/" before it, is one of
{", ".join(_core.ids())}"""
WALKER_HELP = f"""\
{ID_HELP}.
NAME=VALUE sets a parameter of the environment: hardcore=true, ctrl_cost_weight=0.01,
"healthy_z_range=[0.7, .inf]", xml_file=my.xml, max_episode_steps=200.
"""


def add_walker(parser: Parser, metavar: str = "ID|NAME=VALUE") -> None:
    parser.add_argument("walker", nargs="*", metavar=metavar, help="the environment; see below")


def add_walker_options(parser: Parser, metavar: str = "ID|NAME=VALUE") -> None:
    add_walker(parser, metavar)
    where = parser.add_argument_group("transport")
    where.add_argument(
        "--transport",
        choices=TRANSPORTS,
        default="inprocess",
        help="in this process (default), or on a lock-step server of the master ROS_MASTER_URI",
    )
    where.add_argument(
        "--server",
        default="/walker_sim",
        metavar="NAME",
        help="the server's node name (default: /walker_sim)",
    )
    where.add_argument(
        "--num-threads",
        type=count,
        metavar="N",
        help="threads that step walkers in process (default: one per processor)",
    )
    parser.set_defaults(world=None)


WORLD_HELP = (
    "level, physics, disturbances, delays and noise: a preset's name, a YAML file, or a text: "
    "'{gravity: -5, push_interval: [1, 3], friction_scale: {log: [0.5, 2]}}'. `worlds` lists "
    "presets and parameters"
)
DEFAULT_WORLD = "Gymnasium's, or over ROS the server's; a server keeps the world that it is given"


def add_world(parser: Parser, default: str = DEFAULT_WORLD) -> None:
    parser.add_argument("--world", metavar="WORLD", help=f"{WORLD_HELP} (default: {default})")


def add_worlds(parser: Parser) -> None:
    """Adds --world for one world or several; see `split_worlds`."""
    parser.add_argument(
        "--world",
        action="append",
        nargs="+",
        default=[],
        metavar="WORLD",
        dest="given_worlds",
        help=f"{WORLD_HELP}. Several are compared (default: {DEFAULT_WORLD})",
    )


def split_worlds(options: argparse.Namespace) -> None:
    """Sets `options.worlds`. What --world has taken after its first word and is an ID or NAME=VALUE
    goes to `options.walker`."""
    ids = [*_core.ids(), *(f"walker_sim/{one}" for one in _core.ids())]
    options.worlds = []
    for first, *others in options.given_worlds:
        options.worlds.append(first)
        for word in others:
            is_walker = word in ids or re.match("[a-z][a-z0-9_]*=", word)
            (options.walker if is_walker else options.worlds).append(word)


def add_num_envs(parser: Parser) -> None:
    """Adds the number of environments, which affects the duration but no result."""
    parser.add_argument(
        "--num-envs",
        type=count,
        metavar="N",
        help="environments stepped at once, which changes no result (default: "
        f"{DEFAULT_NUM_ENVS}, over ROS 1; over ROS it must be the server's num_envs)",
    )


def add_episodes(parser: Parser, episodes: int) -> None:
    parser.add_argument("--policy", default="heuristic", help="see below (default: heuristic)")
    parser.add_argument(
        "--normalization",
        type=Path,
        metavar="FILE.pkl",
        help="file of VecNormalize.save, with the statistics of a policy FILE.zip's observations. "
        "Opening such a file can run code",
    )
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--seeds",
        type=_seeds,
        metavar="SEEDS",
        help="one episode for each seed, given as single seeds and as ranges FIRST:END, which end "
        "before END: 0:100 or 3,7,20:30",
    )
    group.add_argument(
        "--episodes",
        type=_episodes,
        metavar="N",
        help=f"short for --seeds 0:N (default: {episodes})",
    )
    parser.set_defaults(default_episodes=episodes)


def chosen_seeds(options: argparse.Namespace) -> list[int]:
    seeds: list[int] | None = options.seeds
    return list(range(options.episodes or options.default_episodes)) if seeds is None else seeds


def count(text: str, least: int = 1) -> int:
    """Parses an integer from `least`, 0 or 1, for argparse."""
    if re.fullmatch(r"[0-9]{19,}", text):  # below 2^63 in any case
        raise argparse.ArgumentTypeError(f"{text}: must be below 10^18")
    if not re.fullmatch(r"[0-9]+", text) or int(text) < least:
        limit = "above" if least else "from"
        raise argparse.ArgumentTypeError(f"{text}: must be a whole number {limit} 0")
    return int(text)


count_or_zero = functools.partial(count, least=0)


def counts(text: str) -> list[int]:
    """Parses comma-separated integers above 0, for argparse."""
    return [count(part.strip()) for part in text.split(",")]


def number(text: str, above: float = -math.inf) -> float:
    """Parses a finite number greater than `above`, for argparse."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not above < value < math.inf:
        limit = "" if above < 0 else f" above {above}"
        raise argparse.ArgumentTypeError(f"{text}: must be a number{limit}")
    return value


positive = functools.partial(number, above=0)


def port(text: str) -> int:
    """Parses the number of a TCP port, for argparse."""
    if not re.fullmatch(r"[0-9]{1,5}", text) or not 0 < int(text) < 1 << 16:
        raise argparse.ArgumentTypeError(
            f"{text}: must be a whole number from 1 to {(1 << 16) - 1}"
        )
    return int(text)


def _episodes(text: str) -> int:
    return _bounded(text, count(text))


def _bounded(text: str, number_of: int) -> int:
    if number_of > MAX_SEEDS:
        raise argparse.ArgumentTypeError(f"{text}: must be at most {MAX_SEEDS} episodes")
    return number_of


def _seeds(text: str) -> list[int]:
    seeds: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r" *([0-9]+)(?::([0-9]+))? *", part)
        if not found:
            raise argparse.ArgumentTypeError(
                f"{text}: must be comma-separated seeds and ranges, e.g. 0:100 or 3,7,20:30"
            )
        # Python's int takes 4300 digits at most.
        numbers = [int(one) if len(one) <= 4000 else 1 << 65 for one in found.groups() if one]
        first, end = numbers if found[2] else (numbers[0], numbers[0] + 1)
        if not first < end <= 1 << 64:
            raise argparse.ArgumentTypeError(
                f"{part}: must be ascending, with seeds from 0 to 2^64 - 1"
            )
        _bounded(text, len(seeds) + end - first)
        seeds.extend(range(first, end))
    seed, number_of = Counter(seeds).most_common(1)[0]
    if number_of > 1:
        raise argparse.ArgumentTypeError(f"{text}: must have seed {seed} once")
    return seeds


def walker_of(words: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Parses ID and NAME=VALUE. Returns the id without its namespace, and the parameters."""
    ids = [word for word in words if "=" not in word]
    if len(ids) != 1:
        what = f"{' '.join(ids)}: only one ID is allowed" if ids else "ID is missing"
        raise InputError(f"{what}; must be one of {', '.join(_core.ids())}")
    try:
        env_id = without_namespace(ids[0])
    except TypeError as error:
        raise InputError(str(error)) from error
    if env_id not in _core.ids():
        raise InputError(f"ID = {ids[0]}: must be one of {', '.join(_core.ids())}")
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise InputError(f"{word!a}: must be a text that UTF-8 can encode") from None
    try:
        parameters = _core.parse_assignments(env_id, [word for word in words if "=" in word])
    except ValueError as error:
        raise InputError(str(error)) from error
    return env_id, parameters


def make_walkers(
    options: argparse.Namespace,
    env_id: str,
    parameters: dict[str, Any],
    num_envs: int | None,
    max_envs: int,
) -> Walkers:
    """Makes the walkers of the options: in process at most `max_envs`, over ROS the server's.

    Their autoreset mode is next_step, so that an idle environment keeps stepping without a reset by
    the caller.
    """
    if options.transport == "ros" and options.num_threads is not None:
        raise InputError(
            f"--num-threads {options.num_threads}: over ROS it is the server's parameter"
        )
    reuses = parameters.get("reuse_world") is True
    count = num_envs or 1
    if options.transport == "inprocess":
        count = min(num_envs or (1 if reuses else DEFAULT_NUM_ENVS), max_envs)
    try:
        world = to_world(env_id, options.world)
        walkers = walker_sim.making.make_walkers(
            *(env_id, count, "next_step", parameters),
            ServerAddress(options.transport, options.server),
            options.num_threads or 0,
        )
        if options.world is not None:
            walkers.set_world([], [world])
    except (ValueError, TypeError, RuntimeError) as error:
        raise InputError(str(error)) from error
    if reuses and walkers.num_envs > 1:
        raise InputError(
            f"{walkers.num_envs} environments at once: must be 1 with reuse_world=true, because an "
            "episode then depends on the earlier ones in its world"
        )
    return walkers


def output_file(text: str) -> Path:
    """Parses the path of an output file, whose folder must exist, for argparse."""
    path = Path(text)
    if path.is_dir() or not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"{text}: must be a file in an existing folder")
    return path
