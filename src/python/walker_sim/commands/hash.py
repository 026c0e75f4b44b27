"""``hash``: a hash of all bits of a fixed run, for comparison between machines."""

from __future__ import annotations

from typing import Sequence

import walker_sim
from walker_sim import _core
from walker_sim.commands import options as common
from walker_sim.commands.reference_run import NUM_WALKERS, RUN, SimulationFailed, reference_hash
from walker_sim.registration import without_namespace
from walker_sim.transport import libm_of

STEPS = 10_000

DESCRIPTION = f"""\
Plays a run in which every bit is fixed and prints the SHA-256 of all observations, rewards, flags
and infos: {NUM_WALKERS} walkers of each environment with the seeds 0 to {NUM_WALKERS - 1}. Even
seeds act by the heuristic, odd seeds at random. Threads, environments at once, processor, compiler
and transport do not change the hash; docs/reliability.md lists the expected ones. Those of Walker2d
and Hopper depend on the C library's sin, cos and pow, whose variant is printed as "libm".
"""

EPILOG = f"""\
ID, with or without "walker_sim/" before it, is one of
{", ".join(_core.ids())} (default: all of them).

The variable WALKER_SIM_KERNEL (off, sse2, avx2, avx512) selects the vector instructions.

examples:
  python3 -m walker_sim hash
  python3 -m walker_sim hash Walker2d-v5 --steps 1000 --num-envs 3 --num-threads 1
  python3 -m walker_sim hash BipedalWalker-v3 --transport ros
"""


def _parser() -> common.Parser:
    parser = common.Parser("hash", DESCRIPTION, EPILOG)
    parser.add_argument(
        "--steps",
        type=common.count,
        default=STEPS,
        metavar="N",
        help=f"steps of each walker (default: {STEPS:,}); each number has its own hash",
    )
    common.add_walker_options(parser)
    common.add_num_envs(parser)
    return parser


def run(arguments: Sequence[str]) -> int:
    """Prints a hash for each environment. Returns the exit status."""
    options = _parser().parse_intermixed_args(arguments)
    ids = [_id_of(word) for word in options.walker] or _core.ids()
    size = f"{NUM_WALKERS} x {options.steps:,} steps"
    print(f"walker_sim {walker_sim.__version__}, run {RUN}: {size}")
    for env_id in ids:
        walkers = common.make_walkers(options, env_id, {}, options.num_envs, NUM_WALKERS)
        try:
            found = reference_hash(walkers, options.steps)
        except SimulationFailed as error:
            raise common.InputError(f"{env_id}: {error}") from error
        finally:
            walkers.close()
        version = walkers.specification["engine_version"]
        engine = f"{walkers.specification['engine']} {version.partition(' (')[0]}"
        libm = libm_of(version)
        print(f"{found}  {env_id}, {engine}{libm and f', libm: {libm}'}", flush=True)
    return 0


def _id_of(word: str) -> str:
    if "=" in word:
        raise common.InputError(f"{word}: parameters cannot be set; the run has the defaults")
    return common.walker_of([without_namespace(word)])[0]
