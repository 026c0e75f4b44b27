"""evaluate: equality with Gymnasium's episodes, and options that must not change a result."""

import csv
import re

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics
from walker_sim.commands.episodes import play as episodes_of
from walker_sim.in_process import InProcessWalkers
from walkers import OVERFLOW, overflowing, play, returns_of


def outcome_of(found):
    return tuple(found[name] for name in ("return", "length", "terminated", "truncated"))


def test_heuristic_equals_gymnasiums(evaluate):
    """40 episodes equal those of new Gymnasium environments in all digits."""
    out, found = evaluate("BipedalWalker-v3", "--seeds", "0:40", "--threshold", 200)
    assert [one["seed"] for one in found["outcomes"]] == list(range(40))
    for one in found["outcomes"]:
        environment = gymnasium.make("BipedalWalker-v3")
        theirs, _ = play(environment, one["seed"], BipedalWalkerHeuristics().step_heuristic)
        assert outcome_of(one) == theirs, one["seed"]
    assert re.search(r"mean return +59\.0$", out, re.MULTILINE)
    assert re.search(r"return >= 200 +15\.0% of the episodes$", out, re.MULTILINE)


def test_csv_has_the_outcomes_and_the_info_of_the_last_step(evaluate, tmp_path):
    words = ["walker_sim/Walker2d-v5", "--policy", "zero", "reset_noise_scale=0.1"]
    _, found = evaluate(*words, "--seeds", "3,1", "--csv", tmp_path / "returns.csv")
    with (tmp_path / "returns.csv").open(newline="") as text:
        rows = list(csv.DictReader(text))
    environment = gymnasium.make("walker_sim/Walker2d-v5", reset_noise_scale=0.1)
    assert [row["seed"] for row in rows] == ["3", "1"]
    for row, one in zip(rows, found["outcomes"]):
        outcome, info = play(environment, one["seed"], lambda _: np.zeros(6))
        assert outcome_of(one) == outcome
        assert outcome_of(row) == tuple(map(str, outcome))
        assert {name: float(row[name]) for name in info} == info
        assert row["error"] == ""


@pytest.mark.parametrize(
    ("env_id", "policy", "count"),
    [("BipedalWalker-v3", "heuristic", 9), ("Walker2d-v5", "random", 40)],
)
def test_result_does_not_depend_on_num_envs_or_threads(evaluate, env_id, policy, count):
    words = [env_id, "--policy", policy, "--episodes", count]
    found = [
        evaluate(*words, "--num-envs", environments, "--num-threads", threads)
        for environments, threads in ((1, 1), (4, 3), (7, 2), (64, 1))
    ]
    assert found.count(found[0]) == 4
    assert len({*returns_of(found[0][1])}) == count


def test_failures_are_episodes_whatever_the_num_envs(evaluate, tmp_path):
    words = ["Walker2d-v5", f"xml_file={overflowing(tmp_path)['xml_file']}", "max_episode_steps=12"]
    words += ["terminate_when_unhealthy=false", "reset_noise_scale=3.0"]
    words += ["--policy", "random", "--episodes", 40]
    found = [evaluate(*words, "--num-envs", num_envs) for num_envs in (1, 2, 5, 64)]
    assert found.count(found[0]) == 4
    outcomes = found[0][1]["outcomes"]
    assert [outcome["seed"] for outcome in outcomes] == [*range(40)]
    kinds = {(one["end"], one["error"][: len(OVERFLOW)], one["length"] > 0) for one in outcomes}
    assert kinds == {
        *(("failed", OVERFLOW, has_steps) for has_steps in (False, True)),
        ("time limit", "", True),
    }


def test_idle_environments_get_zero_actions():
    class Recording(InProcessWalkers):
        def step(self, actions):
            given.append(actions.any(axis=1).tolist())
            return super().step(actions)

    given, walkers = [], Recording("Walker2d-v5", {}, 3, 1, "next_step")
    episodes = sorted(episodes_of(walkers, [3, 8], lambda seed: lambda _: np.full(6, seed / 10)))
    lengths = [episode.length for episode in episodes]
    assert len(given) == max(lengths) > min(lengths)
    for environment, length in enumerate([*lengths, 0]):
        acts = [step[environment] for step in given]
        assert acts == [True] * length + [False] * (len(given) - length)


def test_ends(evaluate):
    out, found = evaluate("BipedalWalker-v3", "--seeds", "6,0:2")
    assert [one["end"] for one in found["outcomes"]] == ["arrived", "time limit", "fell"]
    assert "arrived 33.3%, time limit 33.3%, fell 33.3%" in out
    out, _ = evaluate("Walker2d-v4", "--policy", "random", "--episodes", 1)
    assert "terminated 100.0%" in out
    assert "none of one episode" in out
    out, _ = evaluate("BipedalWalker-v3", "max_episode_steps=10", "--episodes", 3)
    assert "mean 10.0, median 10, 10 to 10" in out
    assert "BipedalWalker-v3 max_episode_steps=10, policy heuristic, 3 episodes" in out


def test_reused_world_equals_gymnasiums(evaluate):
    """One Gymnasium environment keeps its world between episodes."""
    _, found = evaluate("BipedalWalker-v3", "reuse_world=true", "--seeds", "1:5")
    environment = gymnasium.make("BipedalWalker-v3")
    for one in found["outcomes"]:
        theirs, _ = play(environment, one["seed"], BipedalWalkerHeuristics().step_heuristic)
        assert outcome_of(one) == theirs, one["seed"]


def test_json_has_all_digits(evaluate):
    options = ["--policy", "random", "--episodes", 5, "--threshold", -1000]
    out, summary = evaluate("BipedalWalkerHardcore-v3", *options)
    returns = returns_of(summary)
    assert summary["id"] == "BipedalWalkerHardcore-v3"
    assert summary["mean"] == np.mean(returns)
    assert summary["median"] == sorted(returns)[2]
    assert summary["passes"] == 1
    assert re.search(rf"mean return +{summary['mean']:.1f}$", out, re.MULTILINE)


def test_plot_shows_every_episode(evaluate, tmp_path, figures):
    file = tmp_path / "returns.png"
    _, found = evaluate("BipedalWalker-v3", "--seeds", "6,0:3", "--plot", file)
    assert file.read_bytes().startswith(b"\x89PNG")
    by_seed, spread = figures[-1].axes
    drawn = np.concatenate([marks.get_offsets() for marks in by_seed.collections])
    assert sorted(map(tuple, drawn.tolist())) == list(enumerate(returns_of(found)))
    assert [by_seed.xaxis.get_major_formatter()(i, None) for i in range(5)] == [*"6012", ""]
    assert sum(bar.get_width() for bars in spread.containers for bar in bars) == 4
    assert figures[-1].get_suptitle() == "BipedalWalker-v3, policy heuristic, 4 episodes"
