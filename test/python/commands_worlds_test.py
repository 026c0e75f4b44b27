"""--world of the commands, and the command worlds."""

import csv
import pathlib
import re

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from walker_sim import _core
from walker_sim.worlds import read_world
from walkers import IDS, make_ours, play

WORLD = (
    "{gravity: [-12, -8], change_interval: 1, friction_scale: {log: [0.5, 2]}, "
    "push_interval: [1, 2], action_delay: 0.02}"
)


def test_the_presets_are_listed(command):
    lines = command("worlds").out.splitlines()
    assert [line.split()[0] for line in lines] == _core.world_presets()
    for line in lines:
        name, text = line.split(maxsplit=1)
        assert _core.load_world(text) == _core.load_world(name)


@pytest.mark.parametrize("environment_id", IDS)
def test_the_parameters_are_listed(command, environment_id):
    lines = command("worlds", f"walker_sim/{environment_id}").out.splitlines()
    assert lines[0].split() == ["parameter", "unit", "Gymnasium's", "from", "to"]
    assert [line.split()[0] for line in lines[1:]] == [
        parameter["name"] for parameter in _core.world_parameters(environment_id)
    ]
    row = next(line for line in lines if line.startswith("push_interval"))
    assert re.match(r"push_interval +s +- +0.001 +1000 +Time from one push", row)


@pytest.mark.parametrize("words", ["worlds BipedalWalker-v3", "evaluate .* --grid .*"])
def test_the_docs_show_the_output(command, words):
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs" / "cli.md").read_text("utf-8")
    pattern = rf"^\$ .* walker_sim ({words})\n((?:.*\n)*?)```"
    line, shown = re.search(pattern, page, re.MULTILINE).groups()
    output = re.escape(shown).replace(re.escape("...\n"), "(.*\n)*")
    assert re.fullmatch(output, command(*line.split()).out)


def test_evaluate_writes_what_was_drawn(evaluate, tmp_path):
    """Each episode is that of gymnasium.make with what was drawn."""
    table = tmp_path / "a.csv"
    words = ["BipedalWalker-v3", "--world", WORLD, "--episodes", 6]
    out, whole = evaluate(*words, "--csv", table, "--num-envs", 4)
    assert out.startswith(f"BipedalWalker-v3, world {WORLD}, policy heuristic, 6 episodes\n")
    assert evaluate(*words, "--num-envs", 1) == (out, whole)
    assert whole["world"] == {
        "gravity": [-12, -8],
        "change_interval": [1, 1],
        "friction_scale": {"log": [0.5, 2]},
        "push_interval": [1, 2],
        "action_delay": [0.02, 0.02],
    }
    with table.open(newline="") as text:
        rows = list(csv.DictReader(text))
    for row, outcome in zip(rows, whole["outcomes"]):
        drawn = outcome["world"]
        cells = ", ".join(f"{name}: {row[name]}" for name in drawn)
        assert _core.load_world(f"{{{cells}}}") == read_world(drawn)
        env = make_ours("BipedalWalker-v3")
        assert read_world(env.reset(options={"world": drawn})[1]["world"]) == read_world(drawn)
        heuristic = BipedalWalkerHeuristics().step_heuristic
        (episode_return, *_), _ = play(env, outcome["seed"], heuristic, world=drawn)
        assert episode_return == outcome["return"]


def test_without_a_world_the_files_have_none(evaluate, tmp_path):
    table = tmp_path / "a.csv"
    words = ["Hopper-v5", "--episodes", 2, "--csv", table]
    plain, fields = evaluate(*words)
    assert "gravity" not in table.read_text() and "world" not in plain
    assert "'world'" not in str(fields)
    out, again = evaluate(*words, "--world", "gymnasium")
    assert out == plain.replace("Hopper-v5,", "Hopper-v5, world gymnasium,", 1)
    assert again["outcomes"] == fields["outcomes"]


def test_a_record_without_worlds(record, command):
    """Gymnasium's world, and a file that was written before there were worlds."""
    recorded, file = record("Hopper-v5", "--episodes", 2)
    assert recorded["worlds"].tolist() == ["", ""]
    del recorded["worlds"]
    np.savez(file, **recorded)
    assert "2 of 2 episodes equal to the bit" in command("record", "--check", file).out


def test_another_world_differs(record, command):
    recorded, file = record("Hopper-v5", "--episodes", 2, "--world", "moon")
    recorded["worlds"][1] = ""
    np.savez(file, **recorded)
    out = command("record", "--check", file, status=1).out
    assert "1 of 2 episodes equal" in out and "differs at step 1: " in out


def test_play_prints_what_was_drawn(command, pygame, monkeypatch):
    from walker_sim.commands.play import Viewer

    def run(viewer):
        while not viewer.session.episode.end:
            viewer._step()

    monkeypatch.setattr(Viewer, "run", run)
    given = ["--world", "{gravity: [-12, -8]}", "--seeds", 3, "max_episode_steps=20"]
    out = command("play", "Hopper-v5", *given).out
    found = re.fullmatch(
        r"episode 1, seed 3: return [-.\d]+, 20 steps, time limit, world ({gravity: .*})\n", out
    )
    env = gymnasium.make("walker_sim/Hopper-v5", world="{gravity: [-12, -8]}")
    drawn = env.reset(seed=3)[1]["world"]["gravity"]
    assert _core.load_world(found[1]) == {"gravity": (drawn, drawn)}
