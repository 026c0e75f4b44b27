"""evaluate --grid, several worlds and --worst."""

import csv
import re
import shlex

import numpy as np
import pytest
from walker_sim import episode_player, worlds
from walker_sim.commands import evaluate as evaluation
from walker_sim.commands import grid, results
from walker_sim.commands.policies import shipped_policy
from walkers import returns_of

PUSHES = ["--grid", "push_impulse=0:20:10"]
DELAYS = ["--grid", "action_delay=0,0.02"]
SHIPPED = ["BipedalWalker-v3", "--policy", "shipped"]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0:40:10", [0, 10, 20, 30, 40]),
        ("0:0.06:0.02", [0, 0.02, 0.04, 0.06]),
        ("0:0.3:0.1", [0, 0.1, 0.2, 0.3]),  # 0.1 + 0.1 + 0.1 is another number
        ("-12:-8:2", [-12, -10, -8]),
        ("1:1:5", [1]),
        ("5,1.5,1e1", [5, 1.5, 10]),
        ("7", [7]),
    ],
)
def test_values_of_an_axis(text, values):
    assert grid.axis(f"gravity={text}") == ("gravity", tuple(values))


def test_every_cell_plays_the_same_seeds(evaluate):
    """Each cell's returns are those of the world alone, and the plain ones of Gymnasium's world."""
    out, found = evaluate(*SHIPPED, *PUSHES, *DELAYS, "--seeds", "5,0:3")
    interval = [1, 3]
    expected = [(push, delay) for push in (0, 10, 20) for delay in (0, 0.02)]
    assert [tuple(cell["values"].values()) for cell in found["cells"]] == expected
    assert found["grid"] == {"push_impulse": [0, 10, 20], "action_delay": [0, 0.02]}
    ranges = [
        {"push_interval": interval, "push_impulse": 2 * [push], "action_delay": 2 * [delay]}
        for push, delay in expected
    ]
    assert [cell["world"] for cell in found["cells"]] == ranges
    played = episode_player.play_out(
        "BipedalWalker-v3",
        shipped_policy("BipedalWalker-v3"),
        [5, 0, 1, 2],
        worlds=[None, *ranges],
    )
    cells = [found["plain"], *found["cells"]]
    assert np.array_equal([returns_of(cell) for cell in cells], played.returns[0])
    assert returns_of(found["cells"][0]) == returns_of(found["plain"])  # no push, no delay
    assert "push_interval is [1, 3] s, as in pushed" in out
    for cell in found["cells"]:
        differences = np.subtract(returns_of(cell), returns_of(found["plain"]))
        assert cell["difference"] == np.mean(differences)
        assert tuple(cell["difference_interval"]) == results.bootstrap_interval(differences)
        assert cell["mean"] == np.mean(returns_of(cell))
        ends = [outcome["end"] for outcome in cell["outcomes"]]
        assert cell["fell"] == ends.count("fell") / 4


def test_table(evaluate):
    out, found = evaluate(*SHIPPED, *PUSHES, *DELAYS, "--episodes", 3, "--threshold", 300)
    title, _, *lines = out.splitlines()[:10]
    assert title == "BipedalWalker-v3, policy shipped, 3 episodes in each of 7 worlds"
    names, plain, *rows = (re.split("  +", line.strip()) for line in lines)
    assert names[:3] == ["push_impulse [N s]", "action_delay [s]", "mean"]
    assert names[3:] == ["95 % interval", "fell", ">= 300", "difference", "95 % interval"]
    assert len({len(line) for line in lines[2:]}) == 1
    assert plain[0] == "plain"
    pairs = [[push, delay] for push in ("0", "10", "20") for delay in ("0", "0.02")]
    for row, pair, cell in zip(rows, pairs, found["cells"]):
        low, high = cell["interval"]
        shares = [f"{cell[name]:.1%}" for name in ("fell", "passes")]
        numbers = [f"{cell['mean']:.1f}", f"{low:.1f} to {high:.1f}", *shares]
        assert row[:7] == [*pair, *numbers, f"{cell['difference']:+.1f}"]


def test_the_worst_of_three_axes(evaluate):
    axes = ("floor_friction=0.1,3", "torso_mass=1,3.7", "gravity=-12,-9.81")
    grid = [word for axis in axes for word in ("--grid", axis)]
    out, found = evaluate("Hopper-v5", "--policy", "shipped", *grid, "--episodes", 3)
    means = [cell["mean"] for cell in found["cells"]]
    assert len(means) == 8
    assert found["mean_of_cells"] == pytest.approx(np.mean(means))
    worst = found["cells"][np.argmin(means)]
    assert found["worst_cell"] == {"mean": worst["mean"], "world": worst["world"]}
    values = ", ".join(f"{name}={value:g}" for name, value in worst["values"].items())
    assert (
        f"worst of the 8 worlds: {min(means):,.1f} in {values}; mean of them: "
        f"{np.mean(means):,.1f}\n" in out
    )


def test_worlds_are_rows(evaluate):
    """The words of the walker may follow --world."""
    words = ["--world", "slippery", "moon", "Hopper-v5", "reset_noise_scale=0.01"]
    out, found = evaluate(*words, "--policy", "shipped", "--episodes", 4, "--grid", "dropout=0,0.3")
    assert out.startswith(
        "Hopper-v5 reset_noise_scale=0.01, policy shipped, 4 episodes in each of 5"
    )
    rows = [line.split()[:2] for line in out.splitlines()[4:8]]
    assert rows == [[world, value] for world in ("slippery", "moon") for value in ("0", "0.3")]
    assert [cell["base"] for cell in found["cells"]] == [row[0] for row in rows]
    for cell in found["cells"]:
        of_base = {name: list(range_) for name, range_ in worlds.read_world(cell["base"]).items()}
        assert cell["world"] == {**of_base, "dropout": 2 * [cell["values"]["dropout"]]}
    assert found["parameters"]["reset_noise_scale"] == "0.01"
    alone, one = evaluate(*words, "--policy", "shipped", "--episodes", 4)
    assert [cell["values"] for cell in one["cells"]] == [{}, {}]
    assert [line.split()[0] for line in alone.splitlines()[2:6]] == [
        *("world", "plain", "slippery", "moon")
    ]


@pytest.mark.parametrize("policy", ["heuristic", "random", "shipped"])
def test_threads_num_envs_and_single_steps_change_nothing(evaluate, monkeypatch, policy):
    words = ["Walker2d-v5", "--policy", policy, *PUSHES, "--episodes", 5, "--worst", 2]
    first = evaluate(*words, "--num-envs", 1, "--num-threads", 1)
    assert evaluate(*words, "--num-envs", 7, "--num-threads", 3) == first
    of_no_push, *_, of_pushes = first[1]["cells"]
    assert returns_of(of_no_push) == returns_of(first[1]["plain"])
    if policy != "random":  # which falls before the first push
        assert returns_of(of_pushes) != returns_of(first[1]["plain"])
    monkeypatch.setattr(evaluation, "find_network", lambda *_: None)
    monkeypatch.setattr(evaluation, "play_jobs", None)
    assert evaluate(*words) == first


def commands_of(out):
    return [shlex.split(line) for line in out.splitlines() if line.startswith("    python3 ")]


@pytest.mark.parametrize(
    "walker",
    [
        [*SHIPPED, *DELAYS],
        ["Walker2d-v5", "healthy_z_range=[0.7, 2]", "--policy", "shipped", *DELAYS],
        ["Hopper-v5", "--policy", "random", *DELAYS, "--world", "noisy"],
        ["BipedalWalker-v3", "--policy", "heuristic", "--world", "hard"],  # without a grid
        ["BipedalWalker-v3", "--policy", "heuristic"],
    ],
)
def test_the_worst_episodes_repeat(command, evaluate, pygame, monkeypatch, walker):
    """`play` and `evaluate` with the printed words play the same episodes, to the bit."""
    from walker_sim.commands import play

    out, found = evaluate(*walker, "--episodes", 6, "--worst", 3)
    cells = [found["plain"], *found["cells"]] if "cells" in found else [found]
    least = sorted(value for cell in cells for value in returns_of(cell))[:3]
    words = commands_of(out)
    assert len(words) == 3

    def run(viewer):
        while not viewer.session.episode.end:
            viewer.session.step()
        played.append(viewer.session.episode.episode_return)

    monkeypatch.setattr(play.Viewer, "run", run)
    played, evaluated = [], []
    for python, dash, package, name, *others in words:
        assert (python, dash, package, name) == ("python3", "-m", "walker_sim", "play")
        command("play", *others)
        evaluated += returns_of(evaluate(*others)[1])
    assert played == evaluated == least


def test_csv(command, tmp_path):
    file = tmp_path / "grid.csv"
    words = [*SHIPPED, "--grid", "push_impulse=10,20", "--seeds", "3,1"]
    command("evaluate", *words, "--csv", file)
    with file.open(newline="") as text:
        rows = list(csv.DictReader(text))
    assert [row["world"] for row in rows[::2]] == [
        "gymnasium",
        "{push_impulse: 10.0, push_interval: [1.0, 3.0]}",
        "{push_impulse: 20.0, push_interval: [1.0, 3.0]}",
    ]
    assert [row["seed"] for row in rows] == 3 * ["3", "1"]
    assert [row["push_impulse"] for row in rows] == ["", "", "10.0", "10.0", "20.0", "20.0"]


@pytest.mark.parametrize(
    ("words", "names", "labels"),
    [
        ([*PUSHES, *DELAYS, "--world", "pushed"], ["0", "10", "20"], ["0", "0.02"]),
        ([*PUSHES, *DELAYS, "--world", "pushed", "slippery"], ["0", "10", "20"], ["0", "0.02"]),
        ([*PUSHES, "--world", "pushed", "slippery"], ["pushed", "slippery"], ["0", "10", "20"]),
    ],
)
def test_heat_map(evaluate, tmp_path, figures, words, names, labels):
    file = tmp_path / "grid.png"
    _, found = evaluate(*SHIPPED, *words, "--episodes", 2, "--plot", file)
    assert file.read_bytes().startswith(b"\x89PNG")
    count = len(found["cells"]) // (len(names) * len(labels))
    maps = figures[-1].axes[:count]
    drawn = np.concatenate([axes.images[0].get_array().data.ravel() for axes in maps])
    assert drawn.tolist() == [cell["mean"] for cell in found["cells"]]
    assert [text.get_text() for text in maps[0].get_xticklabels()] == labels
    assert [text.get_text() for text in maps[0].get_yticklabels()] == names
    texts = [text.get_text() for axes in maps for text in axes.texts]
    assert texts == [f"{cell['mean']:.0f}\n{cell['fell']:.0%}" for cell in found["cells"]]


@pytest.mark.parametrize(
    "words", [["--grid", "gravity=-8,-12,-10"], ["--world", "slippery", "moon", "pushed"]]
)
def test_one_axis_is_a_line(evaluate, tmp_path, figures, words):
    _, found = evaluate(*SHIPPED, *words, "--episodes", 2, "--plot", tmp_path / "grid.pdf")
    line = figures[-1].axes[0].lines[1]
    means = [cell["mean"] for cell in found["cells"]]
    if "--grid" in words:
        assert line.get_xdata().tolist() == [-12, -10, -8]
        means = [means[index] for index in (1, 2, 0)]
    assert line.get_ydata().tolist() == means


def test_one_seed_has_no_intervals(evaluate):
    out, found = evaluate(*SHIPPED, "--grid", "gravity=-9", "--episodes", 1)
    assert found["cells"][0]["difference_interval"] is None
    assert out.splitlines()[4].split()[2] == "-"


def test_pushes_are_added_only_where_they_are_missing():
    axes = [grid.axis("push_impulse=5")]

    def intervals(*rows):
        made = grid.make_grid("Hopper-v5", rows, axes, 1)
        return [cell.world["push_interval"] for cell in made.cells], made.note

    assert intervals("moon", "{push_interval: 2}") == (
        [(1, 3), (2, 2)],
        "push_interval is [1, 3] s, as in pushed (moon)",
    )
    assert intervals("pushed") == ([(1, 3)], "")
    axes.append(grid.axis("push_interval=4"))
    assert intervals() == ([(4, 4)], "")
