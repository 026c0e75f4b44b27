"""``evaluate``: statistics of a policy's returns."""

from __future__ import annotations

import math
import sys
import time
from collections import ChainMap
from typing import Sequence

from walker_sim.commands import options as common
from walker_sim.commands import results
from walker_sim.commands.episodes import play, shown
from walker_sim.commands.policies import POLICY_HELP, make_policies, policy_text
from walker_sim.worlds import range_text

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


def run(arguments: Sequence[str]) -> int:
    options = _parser().parse_intermixed_args(arguments)
    env_id, parameters = common.walker_of(options.walker)
    if options.plot:
        results.check_format(options.plot)  # fails before the episodes, which may take hours
    seeds = common.chosen_seeds(options)
    walkers = common.make_walkers(options, env_id, parameters, options.num_envs, len(seeds))
    policies = make_policies(options, env_id, parameters, walkers.specification)
    worlds = walkers.worlds()  # over ROS they may be the server's own
    world = worlds[0] if all(one == worlds[0] for one in worlds) else worlds
    table = None
    if options.csv:
        table = results.Table(
            options.csv, walkers.specification["info_names"], [*ChainMap(*worlds)]
        )
    began = time.monotonic()
    episodes = []
    try:
        for episode in shown(play(walkers, seeds, policies), len(seeds)):
            episodes.append(episode)
            if table:
                table.add(episode)
    except KeyboardInterrupt:
        if table:
            print(f"{options.csv}: {len(episodes)} of {len(seeds)} episodes", file=sys.stderr)
        raise
    episodes.sort()
    seconds = time.monotonic() - began
    walkers.close()

    threshold = options.threshold
    if threshold is None and not math.isnan(walkers.specification["reward_threshold"]):
        threshold = walkers.specification["reward_threshold"]
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
        f"environments at once: {walkers.num_envs}",
        file=sys.stderr,
    )
    if table:
        table.finish(episodes)
    if options.json:
        head = {
            "id": env_id,
            "parameters": walkers.specification["parameters"],
            "policy": policy,
            "engine": walkers.specification["engine_version"],
        }
        if options.world is not None or world:
            head["world"] = world
        results.write_json(options.json, head, summary, episodes)
    if options.plot:
        results.write_plot(options.plot, title, episodes, summary, threshold)
    return 0
