"""bench: what is counted and how ratios are computed. No test depends on speed."""

import numpy as np
import pytest
from walker_sim.commands import bench, main


def test_sides_take_turns_both_ways():
    calls = []

    def side(name):
        return lambda seconds: calls.append(name) or float(len(calls))

    speeds = bench.measure({"a": side("a"), "b": side("b")}, 1.0)
    assert "".join(calls) == "ab" + "abba" * 2 + "ab"
    assert [*speeds.items()] == [("a", [3, 6, 7, 10, 11]), ("b", [4, 5, 8, 9, 12])]


def test_ratios_are_of_the_same_round():
    speeds = {
        bench.GYMNASIUM: [100.0, 200.0, 400.0],
        "ours": [300.0, 800.0, 800.0],
    }
    lines = bench.table(speeds)
    assert lines[1].split()[3:6] == ["200", "±75%", "x1.00"]
    assert lines[2].split()[1:7] == ["800", "±31%", "x3.00", "(2.00", "to", "4.00)"]
    assert lines[2].count("█") == 4 * lines[1].count("█") == bench.BAR
    assert "ratio" not in bench.table({"ours": speeds["ours"]})[0]


class Clock:
    def __init__(self):
        self.now = 0

    def __call__(self):
        self.now += 1
        return self.now


class EndsEverySecondStep:
    """Two environments in next_step mode. The second one's episodes have two steps."""

    single_action_space = type("Space", (), {"low": -np.ones(1), "high": np.ones(1), "shape": (1,)})
    calls = 0

    @property
    def unwrapped(self):
        return self

    def reset(self, seed):
        pass

    def step(self, actions):
        assert actions.shape == (2, 1)
        self.calls += 1
        ended = np.array([False, self.calls % 3 == 2])
        return None, None, ended, np.zeros(2, bool), {}


def test_resets_are_no_steps(monkeypatch):
    monkeypatch.setattr(bench.gymnasium, "make_vec", lambda name, num_envs: EndsEverySecondStep())
    monkeypatch.setattr(bench.time, "perf_counter", Clock())
    play = bench._vector("some walker", 2, {})
    # Reads the clock at 1 s, then at 2, 3, ... before each call: 9 calls; every third resets one.
    assert play(10.0) == pytest.approx((9 * 2 - 3) / 11)


@pytest.mark.parametrize("env_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_table_has_every_side(capsys, env_id):
    assert main(["bench", env_id, "--seconds", "0.2", "--num-envs", "1,3"]) == 0
    out = capsys.readouterr().out
    rows = [line for line in out.splitlines() if line.startswith("  ") and "steps/s" not in line]
    names = ["Gymnasium's own, one", "walker_sim, one", "walker_sim, 1 at", "walker_sim, 3 at"]
    assert [row.strip().startswith(name) for row, name in zip(rows, names)] == [True] * 4
    assert all("█" in row for row in rows)


def test_without_gymnasiums_engine(capsys, monkeypatch):
    def refuse(name, **keywords):
        if name == "BipedalWalker-v3":
            raise ImportError("no Box2D here\nsecond line")
        return made(name, **keywords)

    made = bench.gymnasium.make
    monkeypatch.setattr(bench.gymnasium, "make", refuse)
    assert main(["bench", "BipedalWalker-v3", "--seconds", "0.2", "--num-envs", "1"]) == 0
    out = capsys.readouterr().out
    assert out.endswith("Gymnasium's own, one: not measured, ImportError: no Box2D here\n")
    assert "ratio" not in out
