"""``worlds``: lists presets and parameters of worlds."""

from __future__ import annotations

import math
from typing import Any, Sequence

from walker_sim import _core
from walker_sim.commands import options as common

DESCRIPTION = """\
Lists the presets of --world, or the parameters that a world can set in one environment. Each is a
number, or a range from which every episode draws, [LOW, HIGH] or, with a uniform logarithm,
{log: [LOW, HIGH]}. A parameter that a world does not set has Gymnasium's value.
"""

EPILOG = f"""\
{common.ID_HELP}.

examples:
  python3 -m walker_sim worlds
  python3 -m walker_sim worlds BipedalWalker-v3
"""


def run(arguments: Sequence[str]) -> int:
    parser = common.Parser("worlds", DESCRIPTION, EPILOG)
    parser.add_argument("id", nargs="?", metavar="ID", help="the environment; see below")
    options = parser.parse_args(arguments)
    print("\n".join(_parameters(options.id) if options.id else _presets()))
    return 0


def _presets() -> list[str]:
    names = _core.world_presets()
    width = max(map(len, names))
    return [f"{name:<{width}}  {_core.world_text(_core.load_world(name))}" for name in names]


def _parameters(name: str) -> list[str]:
    env_id, _ = common.walker_of([name])
    head = ("parameter", "unit", "Gymnasium's", "from", "to", "")
    rows = [head, *map(_row, _core.world_parameters(env_id))]
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _row(parameter: dict[str, Any]) -> tuple[str, ...]:
    default = parameter["default"]
    return (
        *(parameter["name"], parameter["unit"], "-" if math.isnan(default) else f"{default:g}"),
        *(f"{parameter['minimum']:g}", f"{parameter['maximum']:g}", parameter["description"]),
    )
