"""Formats the benchmark's results as text, Markdown and JSON."""

import dataclasses
import math
import statistics

from measure import find

BEGIN, END = "<!-- bench begin: written by scripts/bench -->", "<!-- bench end -->"

# Title of each section's table, and the attributes of a row that form a line's label and a column.
TABLES = {
    "core": ("One core, one thread [steps/s of processor time]", ("environment",), "side"),
    "pool": ("Pools by size [steps/s]", ("environment", "threads", "side"), "num_envs"),
    "scaling": ("From one thread to two [steps/s]", ("environment", "num_envs"), "side"),
    "worlds": ("Worlds, 64 walkers on one core [steps/s]", ("environment",), "side"),
    "lockstep": ("Lock-step over ROS [steps/s]", ("environment", "side"), "condition"),
    "transport": ("Transport without physics [steps/s]", ("environment",), "side"),
    "step_batch": ("~step_batch by size [steps/s]", ("side",), "num_envs"),
    "free": ("Free-running with the heuristic", ("environment",), "side"),
    "jitter": (
        "Jitter of a free-running walker [us]",
        ("environment", "condition"),
        "side",
    ),
    "memory": ("Resident memory of an environment [kB]", ("environment",), "side"),
    "start": ("From roslaunch to the first answered step [s]", ("environment",), "side"),
    "reset": ("Reset [us of processor time]", ("environment",), "side"),
    "act": ("Action of a policy [us of processor time]", ("environment",), "side"),
    "python": ("Python environments [steps/s]", ("environment",), "side"),
    "training": ("Training until the mean return is 300 [s]", ("environment",), "side"),
    "policies": ("Shipped policies over ROS [mean return]", ("environment",), "side"),
}

BIPEDAL, HARDCORE = "BipedalWalker-v3", "BipedalWalkerHardcore-v3"
WALKER2D, HOPPER = "Walker2d-v4", "Hopper-v5"
TWO_THREADS = {"num_envs": 64, "threads": 2}
LOCKSTEP = "lock-step over ROS on two cores, {}, {}, against Gymnasium in process"
# README's ratios: text, and section, environment, side and attributes of the row.
SUMMARY = (
    ("one core, 64 BipedalWalkers, against EnvPool", "core", BIPEDAL, "pool, 64", {}),
    ("one core, 64 Walker2ds, against EnvPool", "core", WALKER2D, "pool, 64", {}),
    ("one core, 64 Hoppers, against EnvPool", "core", HOPPER, "pool, 64", {}),
    ("one core, a single Walker2d, against Gymnasium", "core", WALKER2D, "single", {}),
    *(
        (f"two threads, 64 {name}s, against EnvPool", "pool", env, "walker_sim", TWO_THREADS)
        for name, env in (("BipedalWalker", BIPEDAL), ("Walker2d", WALKER2D))
    ),
    *(
        (LOCKSTEP.format(name, side), "lockstep", env, side, {"condition": "status line"})
        for name, env in (("BipedalWalker", BIPEDAL), ("Walker2d", WALKER2D))
        for side in ("our client", "gymnasium.make")
    ),
    (
        "gymnasium.make, BipedalWalker, against Gymnasium's own",
        "python",
        BIPEDAL,
        "gymnasium.make",
        {},
    ),
)

NOTE = "median ± half the range; x: median ratio to the peer in the same round"


def number(value):
    """Formats a value with three significant digits."""
    if value == 0:
        return "0"
    digits = 2 - math.floor(math.log10(abs(value)))
    return f"{round(value, digits):,.{max(digits, 0)}f}"


def cell(row):
    """Returns e.g. "20,600 ±2 % x1.75": median, spread, ratio to the peer."""
    if row.error or not row.values:
        return "failed"
    text = number(row.median)
    if len(row.values) > 1 and row.median:
        spread = (max(row.values) - min(row.values)) / 2 / statistics.median(row.values)
        text += f" ±{100 * spread:.0f} %"
    if row.ratio is not None:
        text += f" x{row.ratio:.2f}"
    return text


def grid(section, rows):
    """Returns the lines of a section's cells, header first."""
    _, label_names, column_name = TABLES[section]
    rows = [row for row in rows if row.section == section]
    columns = list(dict.fromkeys(getattr(row, column_name) for row in rows))
    lines = {}
    for row in rows:
        label = tuple(str(getattr(row, name)) for name in label_names)
        lines.setdefault(label, {})[getattr(row, column_name)] = cell(row)
    body = [[*label, *(cells.get(c, "") for c in columns)] for label, cells in lines.items()]
    return [[*label_names, *map(str, columns)], *body]


def grids(rows):
    """Yields title and lines of each measured section."""
    for section, (title, *_) in TABLES.items():
        if any(row.section == section for row in rows):
            yield title, grid(section, rows)


def aligned(lines):
    widths = [max(map(len, column)) for column in zip(*lines)]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip() for line in lines
    )


def markdown(lines):
    head, *body = ["| " + " | ".join(line) + " |" for line in lines]
    return "\n".join([head, "|" + "---|" * len(lines[0]), *body])


def machine_line(machine):
    return "; ".join(f"{name} {value}" for name, value in machine.items())


def as_text(machine, rows):
    tables = [f"{title}\n{aligned(lines)}" for title, lines in grids(rows)]
    return "\n\n".join([f"{machine_line(machine)}\n{NOTE}", *tables])


def as_summary(rows):
    lines = [["steps per second", "times as many"]]
    for text, *names, attributes in SUMMARY:
        row = find(rows, *names, **attributes)
        is_measured = row is not None and row.ratio is not None
        lines.append([text, f"{row.ratio:.2f}" if is_measured else "not measured"])
    return markdown(lines)


def as_markdown(machine, rows):
    tables = [f"### {title}\n\n{markdown(lines)}" for title, lines in grids(rows)]
    picture = "![Steps per second beside EnvPool and Gymnasium](benchmark.png)"
    return "\n\n".join([picture, f"Measured on: {machine_line(machine)}.", *tables])


def as_json(machine, rows, is_quick):
    names = [item.name for item in dataclasses.fields(rows[0]) if item.name != "peer"]
    written = [
        {
            **{name: getattr(row, name) for name in names},
            "median": row.median,
            "peer": row.peer.side if row.peer else None,
            "ratio": row.ratio,
        }
        for row in rows
    ]
    return {"machine": machine, "quick": is_quick, "rows": written}


def update(page, text):
    """Replaces the text between two markers. Raises ValueError unless both occur exactly once."""
    old = page.read_text(encoding="utf-8")
    if old.count(BEGIN) != 1 or old.count(END) != 1:
        raise ValueError(f"{page}: must have {BEGIN} and {END}, once each")
    before, rest = old.split(BEGIN)
    after = rest.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
