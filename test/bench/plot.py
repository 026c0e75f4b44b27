"""Plots the benchmark for docs/benchmark.md."""

from matplotlib.figure import Figure
from measure import find
from report import BIPEDAL, HARDCORE, WALKER2D

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


def draw(rows, machine, path):
    figure = Figure(figsize=(11, 7.4), dpi=110, layout="constrained")
    axes = figure.subplots(2, 2)

    ids = (BIPEDAL, HARDCORE, WALKER2D)
    sides = (("pool, 64", "walker_sim", OURS), ("EnvPool, 64", "EnvPool", ENVPOOL))
    sides += (("Gymnasium", "Gymnasium, one walker", GYMNASIUM),)
    axes[0][0].set_title("One core, one thread, 64 walkers", loc="left")
    bars(
        axes[0][0],
        [name.replace("Hardcore", "\nHardcore") for name in ids],
        [(name, color, [find(rows, "core", e, side) for e in ids]) for side, name, color in sides],
    )

    conditions = ("alone", "rviz", "one busy process")
    sides = (("our client", OURS), ("roscpp", OURS_2), ("rospy", OURS_3))
    sides += (("Gymnasium in process", GYMNASIUM),)
    axes[0][1].set_title("One BipedalWalker, lock-step over ROS", loc="left")
    bars(
        axes[0][1],
        ["alone", "with rviz", "beside one\nbusy process"],
        [
            (side, color, [find(rows, "lockstep", BIPEDAL, side, condition=c) for c in conditions])
            for side, color in sides
        ],
    )

    sizes = (16, 64, 256, 1024)
    sides = (("walker_sim", OURS), ("EnvPool", ENVPOOL), ("EnvPool, async", ENVPOOL_2))
    two = [row for row in rows if row.threads == 2]
    for place, env in zip(axes[1], (BIPEDAL, WALKER2D)):
        place.set_title(f"Two threads, by number of {env.split('-')[0]}s", loc="left")
        bars(
            place,
            [str(size) for size in sizes],
            [
                (side, color, [find(two, "pool", env, side, num_envs=size) for size in sizes])
                for side, color in sides
            ],
        )

    figure.suptitle(
        f"walker_sim beside its peers, more is better; x: times EnvPool or Gymnasium\n"
        f"{machine['CPU']}; cores {machine['cores']}; {machine['date']}",
        fontsize=10,
    )
    figure.savefig(path)
