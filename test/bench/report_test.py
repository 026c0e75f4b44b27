"""Evaluation of the benchmark's values: slices, medians, ratios, tables, README."""

import json
import os

import pytest
import report
from measure import Failure, Plan, Row, against, run_slice

CORES = sorted(os.sched_getaffinity(0))
MACHINE = {"CPU": "made up", "cores": "2", "date": "2026-01-01"}


def pair(ours, theirs):
    peer = Row("core", "BipedalWalker-v3", "EnvPool, 64", "steps/s", values=theirs)
    return Row("core", "BipedalWalker-v3", "pool, 64", "steps/s", peer=peer, values=ours), peer


def test_apart_adds_up_one_process_per_core(tmp_path):
    plan = Plan("scaling", "steps/s", lambda line: line["rate"], tmp_path)
    script = (
        """echo "{\\"num_envs\\": 64, \\"rate\\": $((10 + $(taskset -cp $$ | sed 's/.* //')))}" """
    )
    (row,) = plan.add("apart", "", ["sh", "-c", script], CORES[:2], (64,), apart=True).values()
    plan.run(2)
    assert row.error == ""
    assert row.values == [sum(10 + core for core in CORES[:2])] * 2


def test_ratio_compares_the_same_round():
    # The machine was half as fast in rounds 2 and 3: the ratio of the medians would be 1.6.
    ours, theirs = pair([30, 16, 15], [20, 10, 10])
    assert (ours.ratio, ours.median) == (1.5, 16)
    theirs.error = "not installed"
    assert ours.ratio is theirs.ratio is None


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


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ([30000, 33000, 36000], "", "33,000 ±9 % x1.65"),
        ([7.5], "", "7.50 x0.00"),
        ([7.5], "status 1", "failed"),
        ([], "", "failed"),
    ],
)
def test_cell_has_median_spread_and_ratio(values, error, text):
    row, _ = pair(values, [20000] * 3)
    row.error = error
    assert report.cell(row) == text


def test_report_has_a_line_per_environment_and_a_column_per_side():
    rows = [*pair([10, 10], [20, 20]), Row("core", "Walker2d-v4", "pool, 64", "", values=[5])]
    assert report.grid("core", rows) == [
        ["environment", "pool, 64", "EnvPool, 64"],
        ["BipedalWalker-v3", "10.0 ±0 % x0.50", "20.0 ±0 %"],
        ["Walker2d-v4", "5.00", ""],
    ]
    assert [title for title, _ in report.grids(rows)] == [report.TABLES["core"][0]]
    for text in (report.as_text(MACHINE, rows), report.as_markdown(MACHINE, rows)):
        assert "made up" in text
        assert "10.0 ±0 % x0.50" in text
    head, _, first, *others = report.as_summary(rows).splitlines()
    assert head == "| steps per second | times as many |"
    assert first == "| one core, 64 BipedalWalkers, against EnvPool | 0.50 |"
    assert {line.split(" | ")[1] for line in others} == {"not measured |"}
    written = json.loads(json.dumps(report.as_json(MACHINE, rows, is_quick=True)))
    assert (written["rows"][0]["ratio"], written["rows"][0]["peer"]) == (0.5, "EnvPool, 64")
    assert written["quick"] is True


def test_update_changes_only_the_text_between_the_markers(tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n")
    report.update(readme, "new")
    report.update(readme, "newer")
    assert readme.read_text() == f"before\n{report.BEGIN}\nnewer\n{report.END}\nafter\n"
    readme.write_text(f"before\n{report.BEGIN}\n")
    with pytest.raises(ValueError, match="once each"):
        report.update(readme, "new")


def test_error_names_failed_slice(tmp_path):
    with pytest.raises(Failure, match="status 3: no such thing"):
        run_slice(["sh", "-c", "echo no such thing >&2; exit 3"], CORES[:1], tmp_path)
    with pytest.raises(Failure, match="printed no JSON"):
        run_slice(["echo", "{half"], CORES[:1], tmp_path)


def test_sides_take_turns_and_a_failed_one_drops_out(tmp_path):
    plan = Plan("core", "steps/s", lambda line: line["rate"], tmp_path)

    def add(side, num_envs, rate):
        line = json.dumps({"num_envs": num_envs, "rate": rate})
        command = ["sh", "-c", f"echo '{line}' | tee -a ran"]
        return plan.add(side, "env", command, CORES[:1], (4,))

    good, other, broken = add("good", 4, 8), add("other", 4, 2), add("broken", 5, 1)
    assert plan.add("skipped", "env", None, CORES[:1]) == {}
    against(good, other)
    rows = plan.run(rounds=3)
    assert [row.side for row in rows] == ["good", "other", "broken"]
    assert (good[4].values, good[4].ratio) == ([8, 8, 8], 4)
    assert "num_envs" in broken[4].error
    ran = [json.loads(line)["rate"] for line in (tmp_path / "ran").read_text().splitlines()]
    assert ran == [8, 2, 1, 8, 2, 8, 2]
