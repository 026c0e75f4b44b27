"""``evaluate``: statistics of a policy's returns."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import ChainMap
from typing import Any, Callable, NamedTuple, Sequence

from walker_sim.commands import options as common
from walker_sim.commands import plots, results
from walker_sim.commands.episodes import play, progress
from walker_sim.commands.grid import Grid, axis, make_grid, refuse_equal
from walker_sim.commands.policies import (
    POLICY_HELP,
    PolicyFailed,
    find_network,
    make_policies,
    policy_text,
)
from walker_sim.commands.table import Table
from walker_sim.episode_player import PlayedEpisode, make_player, play_jobs
from walker_sim.walkers import Specification
from walker_sim.worlds import World, range_text, to_world

EPISODES = 100

DESCRIPTION = """\
Plays one episode for each seed and prints the policy's mean return with its 95 % confidence
interval over seeds, median, standard deviation, lengths, and how the episodes ended. A seed
determines its episode: --num-envs, --num-threads and --transport change the duration and no digit
of the result.

With --grid, or with several worlds, it plays the same seeds in each world and in Gymnasium's, and
prints a table: mean return, share of episodes that fell, and mean of a seed's return minus its
return in Gymnasium's world. Each mean has its 95 % confidence interval.
"""

EPILOG = f"""\
{common.WALKER_HELP}
{POLICY_HELP}
An episode ends as arrived or fell (BipedalWalker), terminated (Walker2d, Hopper: unhealthy), time
limit, or failed (engine error, which the CSV contains).

examples:
  python3 -m walker_sim evaluate BipedalWalker-v3
  python3 -m walker_sim evaluate BipedalWalkerHardcore-v3 --policy model.zip --seeds 1000:1200 \\
      --csv hardcore.csv --plot hardcore.png
  python3 -m walker_sim evaluate Walker2d-v5 --policy my_policies:walk ctrl_cost_weight=0.01
  python3 -m walker_sim evaluate Walker2d-v5 --policy shipped --world pushed --csv pushed.csv
  python3 -m walker_sim evaluate BipedalWalker-v3 --policy shipped \\
      --grid push_impulse=0:40:10 --grid action_delay=0:0.06:0.02 --plot grid.png --worst 3
  python3 -m walker_sim evaluate Walker2d-v5 --policy shipped --world slippery moon noisy
  python3 -m walker_sim evaluate BipedalWalker-v3 --transport ros --episodes 20
"""


def _parser() -> common.Parser:
    parser = common.Parser("evaluate", DESCRIPTION, EPILOG)
    common.add_episodes(parser, EPISODES)
    parser.add_argument(
        "--threshold",
        type=common.number,
        metavar="RETURN",
        help="print the fraction of episodes with at least this return (default: the environment's "
        "reward threshold, if any)",
    )
    parser.add_argument(
        "--worst",
        type=common.count,
        metavar="N",
        help="print commands that show the N episodes with the least returns",
    )
    files = parser.add_argument_group("files")
    files.add_argument(
        "--csv",
        type=common.output_file,
        metavar="FILE",
        help="one line per episode with all digits, written as episodes end, so that Ctrl-C keeps "
        "them; if FILE exists, the lines are in FILE.*.new until all have ended",
    )
    files.add_argument(
        "--json", type=common.output_file, metavar="FILE", help="the summary and the episodes"
    )
    files.add_argument(
        "--plot",
        type=common.output_file,
        metavar="FILE",
        help="returns by seed and their histogram, of a grid the mean returns as a heat map: .png, "
        ".svg or .pdf (needs matplotlib)",
    )
    common.add_worlds(parser)
    parser.add_argument(
        "--grid",
        type=axis,
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="values of a parameter for each --world, as FIRST:END:STEP, which includes END, or "
        "VALUE,VALUE,...: push_impulse=0:40:10. Several --grid options play all combinations",
    )
    common.add_walker_options(parser)
    common.add_num_envs(parser)
    return parser


class _Source(NamedTuple):
    """What plays the episodes."""

    specification: Specification
    worlds: Sequence[World]
    num_envs: int
    play: Callable[[Callable[[PlayedEpisode], None]], None]


def _source(
    options: argparse.Namespace,
    env_id: str,
    parameters: dict[str, Any],
    seeds: Sequence[int],
    grid: Grid | None,
) -> _Source:
    network = find_network(options, env_id, parameters)
    reuses = parameters.get("reuse_world") is True
    if reuses and (grid or options.worst):
        raise common.InputError(
            f"reuse_world=true: must be false with {'several worlds' if grid else '--worst'}, "
            "because an episode then depends on the earlier ones in its world"
        )
    if network is None or options.transport == "ros" or reuses:
        return _stepped(options, env_id, parameters, seeds, grid)
    try:
        worlds = grid.worlds() if grid else [to_world(env_id, options.world)]
        player = make_player(env_id, parameters, options.num_threads or 0, options.num_envs)
        play_jobs(player, [], worlds, [])  # checks the worlds: some errors depend on the parameters
        if grid:
            refuse_equal(grid, player.specification["dt"])
    except (ValueError, TypeError, RuntimeError) as error:
        raise common.InputError(str(error)) from error

    jobs = [(0, seed, world) for world in range(len(worlds)) for seed in seeds]

    def play_all(receive: Callable[[PlayedEpisode], None]) -> None:
        try:
            play_jobs(player, [network], worlds, jobs, receive)
        except ValueError as error:  # a network that overflows
            raise PolicyFailed(f"--policy {options.policy}: {error}") from None

    num_envs = min(player.num_envs, len(seeds) * len(worlds))
    return _Source(player.specification, worlds, num_envs, play_all)


def _stepped(
    options: argparse.Namespace,
    env_id: str,
    parameters: dict[str, Any],
    seeds: Sequence[int],
    grid: Grid | None,
) -> _Source:
    walkers = common.make_walkers(options, env_id, parameters, options.num_envs, len(seeds))
    policies = make_policies(options, env_id, parameters, walkers.specification)
    before = walkers.worlds()  # over ROS they may be the server's own
    worlds = grid.worlds() if grid else before
    if grid:
        try:
            for world in worlds:
                walkers.set_world([], [world])
        except ValueError as error:
            raise common.InputError(str(error)) from error
        finally:
            walkers.set_world([], before)
        refuse_equal(grid, walkers.specification["dt"])

    def play_all(receive: Callable[[PlayedEpisode], None]) -> None:
        if not grid:
            for episode in play(walkers, seeds, policies):
                receive(episode)
        else:
            try:
                for index, world in enumerate(worlds):
                    walkers.set_world([], [world])
                    for episode in play(walkers, seeds, policies):
                        episode.order += index * len(seeds)
                        receive(episode)
            finally:
                walkers.set_world([], before)
        walkers.close()

    return _Source(walkers.specification, worlds, walkers.num_envs, play_all)


def _play(
    options: argparse.Namespace, source: _Source, number_of: int, table: Table | None
) -> list[PlayedEpisode]:
    """Plays all episodes, with a progress bar. Returns them in order."""
    episodes: list[PlayedEpisode] = []
    began = time.monotonic()
    try:
        with progress(number_of) as show:

            def receive(episode: PlayedEpisode) -> None:
                episodes.append(episode)
                show(episode)
                if table:
                    table.add(episode)

            source.play(receive)
        episodes.sort()
        if table:
            table.finish(episodes)
    except BaseException:
        if table and not table.is_stream:
            print(f"{table.written}: {len(episodes)} of {number_of} episodes", file=sys.stderr)
        raise
    seconds = time.monotonic() - began
    steps = sum(episode.length for episode in episodes)
    # Standard output must be the same in every run.
    print(
        f"{steps:,} steps in {seconds:.1f} s: {steps / seconds:,.0f} a second, policy included; "
        f"environments at once: {source.num_envs}",
        file=sys.stderr,
    )
    return episodes


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    common.split_worlds(options)
    env_id, parameters = common.walker_of(options.walker)
    if options.plot:  # fails before the episodes, which may take hours
        plots.check(options.plot, len(options.grid))
    seeds = common.chosen_seeds(options)
    grid = make_grid(env_id, options.worlds, options.grid, len(seeds))
    options.world = options.worlds[0] if options.worlds and not grid else None
    source = _source(options, env_id, parameters, seeds, grid)
    specification, worlds = source.specification, source.worlds
    table = None
    if options.csv:
        names = specification["info_names"], [*ChainMap(*worlds)]
        texts = ["gymnasium", *map(range_text, worlds[1:])]
        world_of = (lambda episode: texts[episode.order // len(seeds)]) if grid else None
        table = Table(options.csv, *names, world_of)
    count = len(seeds) * (len(worlds) if grid else 1)
    episodes = _play(options, source, count, table)

    threshold = options.threshold
    if threshold is None and not math.isnan(specification["reward_threshold"]):
        threshold = specification["reward_threshold"]
    head = {
        "id": env_id,
        "parameters": specification["parameters"],
        "policy": policy_text(options),
        "engine": specification["engine_version"],
    }
    known = grid.rows[0] if grid and len(grid.rows) == 1 else ""
    world = worlds[0] if all(one == worlds[0] for one in worlds) else worlds
    if not grid and (options.world is not None or world):
        known = options.world or (range_text(world) if isinstance(world, dict) else "differs")
        head["world"] = world
    found = results.summarise_worlds(grid, episodes, threshold)
    title = _title(options, head, known, len(found[0].episodes))
    print(f"{title} in each of {len(found)} worlds\n" if grid else f"{title}\n")
    asks = options.threshold is not None
    print(results.report(env_id, grid, found, threshold, asks))
    if options.json:
        results.write_json(options.json, head, grid, found)
    if options.plot:
        plots.write_plot(options.plot, title, env_id, grid, found, threshold)
    if options.worst:
        print("\n" + results.worst(episodes, options.worst, options))
    return 0


def _title(options: argparse.Namespace, head: dict[str, Any], known: str, number_of: int) -> str:
    walker = " ".join([head["id"], *(word for word in options.walker if "=" in word)])
    world = f", world {known}" if known else ""
    plural = "s" if number_of > 1 else ""
    return f"{walker}{world}, policy {head['policy']}, {number_of} episode{plural}"
