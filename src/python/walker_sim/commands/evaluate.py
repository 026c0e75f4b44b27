"""``evaluate``: statistics of a policy's returns."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import ChainMap
from typing import Any, Callable, NamedTuple, Sequence

from walker_sim.commands import options as common
from walker_sim.commands import results
from walker_sim.commands.episodes import Episode, play, play_network, progress
from walker_sim.commands.policies import (
    POLICY_HELP,
    PolicyFailed,
    find_network,
    make_policies,
    policy_text,
)
from walker_sim.episode_player import make_player
from walker_sim.transport import Specification
from walker_sim.worlds import World, range_text, to_world

EPISODES = 100

DESCRIPTION = """\
Plays one episode for each seed and prints the policy's mean return with its 95 % confidence
interval over seeds, median, standard deviation, lengths, and how the episodes ended. A seed
determines its episode: --num-envs, --num-threads and --transport change the duration and no digit
of the result.
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
    files = parser.add_argument_group("files")
    files.add_argument(
        "--csv",
        type=common.output_file,
        metavar="FILE",
        help="one line per episode with all digits, written as episodes end, so that Ctrl-C keeps "
        "them",
    )
    files.add_argument(
        "--json", type=common.output_file, metavar="FILE", help="the summary and the episodes"
    )
    files.add_argument(
        "--plot",
        type=common.output_file,
        metavar="FILE",
        help="returns by seed and their histogram: .png, .svg or .pdf (needs matplotlib)",
    )
    common.add_world(parser)
    common.add_walker_options(parser)
    common.add_num_envs(parser)
    return parser


class _Source(NamedTuple):
    """What plays the episodes."""

    specification: Specification
    worlds: Sequence[World]
    num_envs: int
    play: Callable[[Callable[[Episode], None]], None]


def _source(
    options: argparse.Namespace, env_id: str, parameters: dict[str, Any], seeds: Sequence[int]
) -> _Source:
    network = find_network(options, env_id, parameters)
    reuses = parameters.get("reuse_world") is True
    if network is None or options.transport == "ros" or reuses:
        return _stepped(options, env_id, parameters, seeds)
    try:
        world = to_world(env_id, options.world)
        num_threads = options.num_threads or 0
        player = make_player(env_id, parameters, num_threads, options.num_envs)
    except (ValueError, TypeError, RuntimeError) as error:
        raise common.InputError(str(error)) from error

    def play_all(receive: Callable[[Episode], None]) -> None:
        try:
            play_network(player, network, seeds, world, receive)
        except ValueError as error:  # a network that overflows
            raise PolicyFailed(f"--policy {options.policy}: {error}") from error

    return _Source(player.specification, [world], min(player.num_envs, len(seeds)), play_all)


def _stepped(
    options: argparse.Namespace, env_id: str, parameters: dict[str, Any], seeds: Sequence[int]
) -> _Source:
    walkers = common.make_walkers(options, env_id, parameters, options.num_envs, len(seeds))
    policies = make_policies(options, env_id, parameters, walkers.specification)

    def play_all(receive: Callable[[Episode], None]) -> None:
        for episode in play(walkers, seeds, policies):
            receive(episode)
        walkers.close()

    # Over ROS the worlds may be the server's own.
    return _Source(walkers.specification, walkers.worlds(), walkers.num_envs, play_all)


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    env_id, parameters = common.walker_of(options.walker)
    if options.plot:
        results.check_format(options.plot)  # fails before the episodes, which may take hours
    seeds = common.chosen_seeds(options)
    source = _source(options, env_id, parameters, seeds)
    specification, worlds = source.specification, source.worlds
    world = worlds[0] if all(one == worlds[0] for one in worlds) else worlds
    table = None
    if options.csv:
        table = results.Table(options.csv, specification["info_names"], [*ChainMap(*worlds)])
    began = time.monotonic()
    episodes: list[Episode] = []
    try:
        with progress(len(seeds)) as show:

            def receive(episode: Episode) -> None:
                episodes.append(episode)
                show(episode)
                if table:
                    table.add(episode)

            source.play(receive)
    except KeyboardInterrupt:
        if table:
            print(f"{options.csv}: {len(episodes)} of {len(seeds)} episodes", file=sys.stderr)
        raise
    episodes.sort()
    seconds = time.monotonic() - began

    threshold = options.threshold
    if threshold is None and not math.isnan(specification["reward_threshold"]):
        threshold = specification["reward_threshold"]
    summary = results.summarise(episodes, threshold)
    policy = policy_text(options)
    walker = " ".join([env_id, *(word for word in options.walker if "=" in word)])
    if options.world is not None or world:
        known = options.world or (range_text(world) if isinstance(world, dict) else "differs")
        walker += f", world {known}"
    title = f"{walker}, policy {policy}, {len(seeds)} episode{'s' if len(seeds) > 1 else ''}"
    returns = [episode.episode_return for episode in episodes]
    lines = [*results.report(summary, threshold), "", *results.histogram(returns)]
    print("\n".join([title, "", *lines]))
    steps = sum(episode.length for episode in episodes)
    # Standard output must be the same in every run.
    print(
        f"{steps:,} steps in {seconds:.1f} s: {steps / seconds:,.0f} a second, policy included; "
        f"environments at once: {source.num_envs}",
        file=sys.stderr,
    )
    if table:
        table.finish(episodes)
    if options.json:
        head = {
            "id": env_id,
            "parameters": specification["parameters"],
            "policy": policy,
            "engine": specification["engine_version"],
        }
        if options.world is not None or world:
            head["world"] = world
        results.write_json(options.json, head, summary, episodes)
    if options.plot:
        results.write_plot(options.plot, title, episodes, summary, threshold)
    return 0
