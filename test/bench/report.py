"""Formats the benchmark's results as text, Markdown and JSON."""

import dataclasses
import math
import statistics

from targets import targets_of

BEGIN, END = "<!-- bench begin: written by scripts/bench -->", "<!-- bench end -->"


@dataclasses.dataclass
class Table:
    section: str
    title: str
    note: str
    lines: tuple  # row attributes that form a line's label
    column: str = "side"  # row attribute that names a column


TABLES = (
    Table(
        "core",
        "One core, one thread [steps/s]",
        "Of processor time. Pools times EnvPool of as many, the single one times Gymnasium. "
        "Behind a pool's number: the kernel, where WALKER_SIM_KERNEL names it. "
        "mjbatch: physics alone, without observation, reward and resets.",
        ("environment",),
    ),
    Table(
        "pool",
        "Pools, by number of environments [steps/s]",
        "Of wall time; one thread on one core, two threads on two. Async: waits for half of the "
        "environments at a time. Times EnvPool in the same mode.",
        ("environment", "threads", "side"),
        "num_envs",
    ),
    Table(
        "scaling",
        "From one thread to two [steps/s]",
        "Of wall time; one thread on one core, two threads on two; and what two cores can do at "
        "most: two processes, each with a thread and a core of its own. Times one thread.",
        ("environment", "num_envs"),
    ),
    Table(
        "lockstep",
        "One walker in lock-step over ROS [steps/s]",
        "Of wall time; client and server on the same core, and free to use two. Times Gymnasium in "
        "process; without physics times the raw connection.",
        ("environment", "side"),
        "placement",
    ),
    Table(
        "step_batch",
        "BipedalWalkers stepped by one call, by their number [steps/s]",
        "Of wall time, two threads on two cores. Times the pool in process.",
        ("side",),
        "num_envs",
    ),
    Table(
        "free",
        "Free-running under the heuristic",
        "Highest real-time factor at factor 0; jitter at factor 1: how much the interval between "
        "steps deviates from 20 ms (BipedalWalker) and 8 ms (Walker2d), of each 8 s.",
        ("environment",),
    ),
    Table(
        "memory",
        "Resident memory of an environment [kB]",
        "Of 1000 environments (Gymnasium: 100) after 100 steps. Times EnvPool.",
        ("environment",),
    ),
    Table(
        "start",
        "From roslaunch to the first answered step [s]",
        "With a master running.",
        ("environment",),
    ),
    Table(
        "reset",
        "Reset [us]",
        "Of processor time. Times EnvPool, whose reset of 16 at a time is divided by 16.",
        ("environment",),
    ),
    Table(
        "act",
        "A policy's action [us]",
        "Of processor time: the network of 256 and 256, and those that come along.",
        ("environment",),
    ),
    Table(
        "python",
        "From Python [steps/s]",
        "Of wall time. What gymnasium.make gives, on one core, times Gymnasium's own environment; "
        "what gymnasium.make_vec gives of 64, two threads on two cores, times the C++ pool.",
        ("environment",),
    ),
    Table(
        "training",
        "From nothing to a walker [s]",
        "Of wall time without evaluations, on two cores, until the mean return over 100 held-out "
        "seeds is 300. The same settings, library and numbers on both sides. Times walker_sim.",
        ("environment",),
    ),
    Table(
        "policies",
        "The policies that come along, over ROS [mean return]",
        "Over 20 seeds: in lock-step, and free-running in real time, times lock-step.",
        ("environment",),
    ),
)


def number(value):
    """Formats a value with three significant digits."""
    if value == 0:
        return "0"
    digits = 2 - math.floor(math.log10(abs(value)))
    return f"{round(value, digits):,.{max(digits, 0)}f}"


def spread(values):
    """Returns half the range of the values, relative to the median."""
    return (max(values) - min(values)) / 2 / statistics.median(values)


def cell(row):
    """Returns e.g. "20,600 ±2 % x1.75": median, spread, ratio to the peer."""
    if row.error or not row.values:
        return "failed"
    text = number(row.median)
    if len(row.values) > 1 and row.median:
        text += f" ±{100 * spread(row.values):.0f} %"
    if row.ratio is not None:
        text += f" x{row.ratio:.2f}"
    return text


def grid(table, rows):
    """Returns the lines of cells, header first; [] if the section was not measured."""
    rows = [row for row in rows if row.section == table.section]
    if not rows:
        return []
    columns = list(dict.fromkeys(getattr(row, table.column) for row in rows))
    lines = {}
    for row in rows:
        label = tuple(getattr(row, name) for name in table.lines)
        lines.setdefault(label, {})[getattr(row, table.column)] = cell(row)
    return [
        [*table.lines, *map(str, columns)],
        *(
            [*map(str, label), *(cells.get(c, "") for c in columns)]
            for label, cells in lines.items()
        ),
    ]


def target_grid(rows):
    lines = [["target", "limit", "measured", ""]]
    for target in targets_of(rows):
        value, verdict = target.verdict(rows)
        limit = f"at most {target.limit:g}" if target.is_most else f"at least {target.limit:g}"
        measured = "" if value is None else f"{value:.2f}{target.unit}"
        lines.append([target.what, limit + target.unit, measured, verdict])
    return lines


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


NOTE = (
    "Medians of rounds in which the sides took turns, each slice in a fresh process; ± is half of "
    "the way from the least to the most; x is the median over the rounds of the ratio to the peer "
    "in the same round."
)


def as_text(machine, rows):
    parts = [machine_line(machine), NOTE]
    for table in TABLES:
        lines = grid(table, rows)
        if lines:
            parts.append(f"{table.title}\n{table.note}\n\n{aligned(lines)}")
    parts.append(f"Targets\n\n{aligned(target_grid(rows))}")
    return "\n\n".join(parts)


def as_summary(rows):
    lines = [["steps per second", "times as many"]]
    for target in targets_of(rows):
        if target.is_in_readme:
            value, verdict = target.verdict(rows)
            lines.append([target.what, verdict if value is None else f"{value:.2f}"])
    return markdown(lines)


def as_markdown(machine, rows):
    parts = [
        "![Steps per second beside EnvPool and Gymnasium](benchmark.png)",
        f"Measured on: {machine_line(machine)}.",
        markdown(target_grid(rows)),
        f"## All of it\n\n{NOTE}",
    ]
    for table in TABLES:
        lines = grid(table, rows)
        if lines:
            parts.append(f"### {table.title}\n\n{table.note}\n\n{markdown(lines)}")
    return "\n\n".join(parts)


def as_json(machine, rows, is_quick):
    def of_row(row):
        return {
            **{f.name: getattr(row, f.name) for f in dataclasses.fields(row) if f.name != "peer"},
            "median": row.median,
            "peer": row.peer.side if row.peer else None,
            "ratio": row.ratio,
        }

    def of_target(target):
        value, verdict = target.verdict(rows)
        limit = {"most" if target.is_most else "least": target.limit}
        return {"target": target.what, **limit, "measured": value, "verdict": verdict}

    return {
        "machine": machine,
        "quick": is_quick,
        "rows": [of_row(row) for row in rows],
        "targets": [of_target(target) for target in targets_of(rows)],
    }


def update(page, text):
    """Replaces the text between two markers. Raises ValueError unless both occur exactly once."""
    old = page.read_text(encoding="utf-8")
    if old.count(BEGIN) != 1 or old.count(END) != 1:
        raise ValueError(f"{page}: must have {BEGIN} and {END}, once each")
    before, rest = old.split(BEGIN)
    after = rest.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
