"""Evaluation of the benchmark's values: medians, ratios, verdicts, tables, README."""

import json
import os

import pytest
import report
from measure import Failure, Job, Plan, Row, against, compare, run_slice
from targets import TARGETS, Target, find

ANY_CORE = sorted(os.sched_getaffinity(0))[:1]


def row(side, values=(), error="", section="core", environment="BipedalWalker-v3", **attributes):
    made = Row(section, environment, side, "steps/s", error=error, **attributes)
    made.values = list(values)
    return made


def pair(ours, theirs, **attributes):
    first, second = row("pool, 64", ours, **attributes), row("EnvPool, 64", theirs, **attributes)
    first.peer = second
    return first, second


def test_processes_apart_are_added(tmp_path):
    plan = Plan("scaling", "steps/s", lambda line: line["rate"], tmp_path)
    script = (
        """echo "{\\"num_envs\\": 64, \\"rate\\": $((10 + $(taskset -cp $$ | sed 's/.* //')))}" """
    )
    cores = sorted(os.sched_getaffinity(0))[:2]
    (made,) = plan.add("apart", "", ["sh", "-c", script], cores, (64,), apart=True).values()
    plan.run(2)
    assert made.error == ""
    assert made.values == [sum(10 + core for core in cores)] * 2


def test_a_ratio_is_of_the_same_round():
    # The machine was half as fast in rounds 2 and 3: the ratio of the medians would be 1.6.
    ours, theirs = pair([30, 16, 15], [20, 10, 10])
    assert compare(ours, theirs) == 1.5
    assert ours.ratio == 1.5
    assert ours.median == 16


def test_what_has_failed_has_no_ratio():
    ours, theirs = pair([30, 31], [20, 20])
    theirs.error = "not installed"
    assert ours.ratio is None
    assert compare(ours, None) is None
    assert row("alone", [1]).ratio is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (20634.2, "20,600"),
        (1234567, "1,230,000"),
        (999.6, "1,000"),
        (151.4, "151"),
        (5.234, "5.23"),
        (0.01234, "0.0123"),
        (0, "0"),
    ],
)
def test_numbers_have_three_significant_digits(value, text):
    assert report.number(value) == text


def test_a_cell_says_median_spread_and_ratio():
    ours, theirs = pair([30000, 33000, 36000], [20000, 20000, 20000])
    assert report.cell(ours) == "33,000 ±9 % x1.65"
    assert report.cell(theirs) == "20,000 ±0 %"
    assert report.cell(row("once", [7.5])) == "7.50"
    assert report.cell(row("broken", [7.5], error="status 1")) == "failed"
    assert report.cell(row("never")) == "failed"


def test_a_table_has_a_line_for_each_environment_and_a_column_for_each_side():
    rows = [*pair([3, 3], [2, 2]), row("pool, 64", [5], environment="Walker2d-v4")]
    table = report.TABLES[0]
    assert report.grid(table, rows) == [
        ["environment", "pool, 64", "EnvPool, 64"],
        ["BipedalWalker-v3", "3.00 ±0 % x1.50", "2.00 ±0 %"],
        ["Walker2d-v4", "5.00", ""],
    ]
    assert report.grid(report.TABLES[1], rows) == []


def value_of(value):
    return lambda _rows: value


def test_a_target_is_reached_at_its_limit_and_not_before():
    assert Target("", 1.45, value_of(1.45)).verdict([]) == (1.45, "reached")
    assert Target("", 1.45, value_of(1.449)).verdict([]) == (1.449, "NOT REACHED")
    assert Target("", 0.6, value_of(0.6), is_most=True).verdict([]) == (0.6, "reached")
    assert Target("", 0.6, value_of(0.601), is_most=True).verdict([]) == (0.601, "NOT REACHED")
    assert Target("", 0.6, value_of(None), is_most=True).verdict([]) == (None, "not measured")


def test_targets_find_their_rows():
    ours, theirs = pair([80, 80], [20, 20])
    target = TARGETS[0]
    assert target.verdict([ours, theirs]) == (4, "reached")
    assert target.verdict([theirs]) == (None, "not measured")
    ours.error = "status 1"
    assert target.verdict([ours, theirs]) == (None, "not measured")


def test_each_kernel_has_its_target():
    _, envpool = pair([], [20, 20])
    default, avx2, sse2 = (
        row(f"pool, 64{kernel}", [rate, rate], peer=envpool)
        for kernel, rate in (("", 90), (", avx2", 70), (", sse2", 60))
    )
    verdicts = {t.what: t.verdict([default, avx2, sse2, envpool]) for t in TARGETS}
    many = "one core, 64 BipedalWalkers"
    assert verdicts[f"{many}, against EnvPool"] == (4.5, "reached")
    assert verdicts[f"{many} with AVX2, against EnvPool"] == (3.5, "NOT REACHED")
    assert verdicts[f"{many} with SSE2, against EnvPool"] == (3, "reached")


def test_scaling_compares_two_threads_with_one():
    one = row("one thread", [10, 20], section="scaling", num_envs=64)
    two = row("two threads", [19, 38], section="scaling", num_envs=64)
    apart = row("two processes", [20, 40], num_envs=64)
    two.peer = apart.peer = one
    rows = [one, two, apart]
    (target,) = [t for t in TARGETS if t.what == "two threads against one, 64 BipedalWalkers"]
    assert target.verdict(rows) == (1.9, "reached")
    assert find(rows, "scaling", "BipedalWalker-v3", "two threads") is two


def test_all_that_is_written_says_what_was_not_reached():
    rows = pair([10, 10], [20, 20])
    machine = {"CPU": "made up", "cores": "2", "date": "2026-01-01"}
    for text in (report.as_text(machine, rows), report.as_markdown(machine, rows)):
        assert "NOT REACHED" in text
        assert "not measured" in text
        assert "made up" in text
    head, _, first, second, *others = report.as_summary(rows).splitlines()
    assert head == "| steps per second | times as many |"
    assert first == "| one core, 64 BipedalWalkers, against EnvPool | 0.50 |"
    assert second == "| one core, 64 BipedalWalkerHardcores, against EnvPool | not measured |"
    assert {line.split(" | ")[1] for line in others} == {"not measured |"}
    written = json.loads(json.dumps(report.as_json(machine, rows, is_quick=True)))
    assert written["rows"][0]["ratio"] == 0.5
    assert written["rows"][0]["peer"] == "EnvPool, 64"
    assert written["targets"][0]["verdict"] == "NOT REACHED"
    assert written["quick"] is True


def test_readme_is_changed_between_the_two_comments_only(tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n")
    report.update(readme, "new")
    report.update(readme, "newer")
    assert readme.read_text() == f"before\n{report.BEGIN}\nnewer\n{report.END}\nafter\n"
    readme.write_text(f"before\n{report.BEGIN}\n")
    with pytest.raises(ValueError, match="once each"):
        report.update(readme, "new")


def test_a_slice_that_fails_says_why(tmp_path):
    with pytest.raises(Failure, match="status 3: no such thing"):
        run_slice(["sh", "-c", "echo no such thing >&2; exit 3"], ANY_CORE, tmp_path)
    with pytest.raises(Failure, match="printed no JSON"):
        run_slice(["echo", "{half"], ANY_CORE, tmp_path)


def echo(line):
    return ["sh", "-c", f"echo '{line}' | tee -a ran"]


def test_sides_take_turns_and_a_failed_one_drops_out(tmp_path):
    plan = Plan("core", "steps/s", lambda line: line["rate"], tmp_path)
    good = plan.add("good", "env", echo('{"num_envs": 4, "rate": 8}'), ANY_CORE, (4,))
    other = plan.add("other", "env", echo('{"num_envs": 4, "rate": 2}'), ANY_CORE, (4,))
    broken = plan.add("broken", "env", echo('{"num_envs": 5, "rate": 1}'), ANY_CORE, (4,))
    assert plan.add("left out", "env", None, ANY_CORE) == {}
    against(good, other)
    rows = plan.run(rounds=3)
    assert [r.side for r in rows] == ["good", "other", "broken"]
    assert good[4].values == [8, 8, 8]
    assert good[4].ratio == 4
    assert "num_envs" in broken[4].error
    ran = [json.loads(line)["rate"] for line in (tmp_path / "ran").read_text().splitlines()]
    assert ran == [8, 2, 1, 8, 2, 8, 2]
    assert Job([], float, broken, ANY_CORE).has_failed
