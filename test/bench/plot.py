"""Plots the benchmark for docs/benchmark.md."""

from matplotlib.figure import Figure
from targets import BIPEDAL, WALKER2D, find

OURS, OURS_2, OURS_3 = "#1f6fb4", "#5e9fd3", "#a3c8e6"
ENVPOOL, ENVPOOL_2, GYMNASIUM = "#c9a27c", "#e2cbb3", "#9aa5ad"


def rate(row):
    return row.median / 1000 if row is not None and row.values and not row.error else 0


def bars(axes, labels, sides):
    """Draws grouped bars. Each side is a name, a colour and one row per label."""
    width = 0.84 / len(sides)
    for number, (name, colour, rows) in enumerate(sides):
        places = [i - 0.42 + width * (number + 0.5) for i in range(len(labels))]
        heights = [rate(row) for row in rows]
        drawn = axes.bar(places, heights, width * 0.94, color=colour, label=name)
        texts = [f"{height:.3g}" if height else "" for height in heights]
        for i, row in enumerate(rows):
            if row is not None and row.ratio is not None:
                texts[i] += f"\nx{row.ratio:.2f}"
        axes.bar_label(drawn, texts, fontsize=7.5, padding=1.5, color="#333333")
    axes.set_xticks(range(len(labels)), labels)
    axes.set_ylabel("1000 steps/s")
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(y=0.3)
    axes.legend(frameon=False, fontsize=8, loc="upper right", ncols=len(sides))


def draw_core(axes, rows):
    ids = (BIPEDAL, "BipedalWalkerHardcore-v3", WALKER2D)
    sides = [("walker_sim", OURS, "pool, 64"), ("EnvPool", ENVPOOL, "EnvPool, 64")]
    sides.append(("Gymnasium, one walker", GYMNASIUM, "Gymnasium"))
    axes.set_title("One core, one thread, 64 walkers", loc="left")
    bars(
        axes,
        [name.replace("Hardcore", "\nHardcore") for name in ids],
        [
            (name, colour, [find(rows, "core", e, side) for e in ids])
            for name, colour, side in sides
        ],
    )


def draw_pool(axes, rows, environment):
    sizes = (16, 64, 256, 1024)
    sides = [("walker_sim", OURS), ("EnvPool", ENVPOOL), ("EnvPool, async", ENVPOOL_2)]
    axes.set_title(f"Two threads, by number of {environment.split('-')[0]}s", loc="left")
    bars(
        axes,
        [str(size) for size in sizes],
        [
            (
                side,
                colour,
                [find(rows, "pool", environment, side, num_envs=n, threads=2) for n in sizes],
            )
            for side, colour in sides
        ],
    )


def draw_lockstep(axes, rows):
    placements = ("1 core", "2 cores")
    sides = [("our client", OURS), ("roscpp", OURS_2), ("rospy", OURS_3)]
    sides.append(("Gymnasium in process", GYMNASIUM))
    axes.set_title("One BipedalWalker, lock-step over ROS", loc="left")
    bars(
        axes,
        ["client and server\non one core", "free to use two cores"],
        [
            (
                side,
                colour,
                [
                    find(rows, "lockstep", BIPEDAL, side, placement=placement)
                    for placement in placements
                ],
            )
            for side, colour in sides
        ],
    )


def draw(rows, machine, path):
    figure = Figure(figsize=(11, 7.4), dpi=110, layout="constrained")
    axes = figure.subplots(2, 2)
    draw_core(axes[0][0], rows)
    draw_lockstep(axes[0][1], rows)
    draw_pool(axes[1][0], rows, BIPEDAL)
    draw_pool(axes[1][1], rows, WALKER2D)
    figure.suptitle(
        f"walker_sim beside its peers, more is better; x: times EnvPool or Gymnasium\n"
        f"{machine['CPU']}; cores {machine['cores']}; {machine['date']}",
        fontsize=10,
    )
    figure.savefig(path)
