"""bench: what is counted and how ratios are computed. No test depends on speed."""

import pytest
from walker_sim.commands import bench


def test_sides_take_turns_in_both_orders():
    calls = []
    sides = {name: lambda name=name: calls.append(name) or 1 for name in "ab"}
    speeds = bench.take_turns(sides, 0.0)
    assert "".join(calls) == "ab" + "abba" * 2 + "ab"
    assert [len(rounds) for rounds in speeds.values()] == [5, 5]


def test_ratios_compare_the_same_round():
    speeds = {bench.GYMNASIUM: [100.0, 200.0, 400.0], "ours": [300.0, 800.0, 800.0]}
    lines = bench.table(speeds)
    assert lines[1].split()[3:6] == ["200", "±75%", "x1.00"]
    assert lines[2].split()[1:7] == ["800", "±31%", "x3.00", "(2.00", "to", "4.00)"]
    assert lines[2].count("█") == 4 * lines[1].count("█") == bench.BAR
    assert "ratio" not in bench.table({"ours": speeds["ours"]})[0]


def test_resets_do_not_count_as_steps():
    step = bench.vector("walker_sim/Walker2d-v5", 3, max_episode_steps=1)
    assert [step() for _ in range(4)] == [3, 0, 3, 0]


@pytest.mark.parametrize("env_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_table_has_every_side(command, env_id):
    out = command("bench", env_id, "--seconds", 0.2, "--num-envs", "1,3").out
    rows = [line for line in out.splitlines() if line.startswith("  ") and "steps/s" not in line]
    names = ["Gymnasium's own, one", "walker_sim, one", "walker_sim, 1 at", "walker_sim, 3 at"]
    assert [row.strip().startswith(name) for row, name in zip(rows, names)] == [True] * 4
    assert all("█" in row for row in rows)


def test_without_gymnasiums_engine(command, monkeypatch):
    def refuse(name, **keywords):
        if name == "BipedalWalker-v3":
            raise ImportError("no Box2D here\nsecond line")
        return made(name, **keywords)

    made = bench.gymnasium.make
    monkeypatch.setattr(bench.gymnasium, "make", refuse)
    out = command("bench", "BipedalWalker-v3", "--seconds", 0.2, "--num-envs", 1).out
    assert out.endswith("Gymnasium's own, one: not measured, ImportError: no Box2D here\n")
    assert "ratio" not in out
