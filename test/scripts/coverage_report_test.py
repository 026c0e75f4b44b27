"""Reports that scripts/coverage_report makes from gcovr's data."""

import json
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOMS = sorted(path for path in (ROOT / "src").iterdir() if path.is_dir())


def file_of(name, counts, **marks):
    lines = [{"line_number": number, "count": count, **marks} for number, count in counts]
    return {"file": name, "lines": lines}


def run(folder, *files):
    source, report = folder / "coverage.json", folder / "coverage.txt"
    source.write_text(json.dumps({"files": files}), encoding="utf-8")
    done = subprocess.run(
        [str(ROOT / "scripts" / "coverage_report"), str(source), str(report)],
        capture_output=True,
        text=True,
        check=False,
    )
    return done, report.read_text(encoding="utf-8") if report.exists() else ""


def row(text, name):
    (line,) = (line for line in text.splitlines() if line.split()[:1] == [name])
    return line.split(None, 1)[1]


def test_rooms_are_counted_apart_and_together(tmp_path):
    done, report = run(
        tmp_path,
        file_of("src/episode/pool.cpp", [(1, 5), (2, 0)]),
        file_of("include/walker_sim/pool.h", [(n, 1) for n in range(38)]),
        file_of(
            "src/server/server.cpp", [(n, 1) for n in range(94)] + [(94 + n, 0) for n in range(6)]
        ),
    )
    assert done.returncode == 0, done.stderr
    assert row(done.stdout, "src/episode") == "1 of      2 lines  50.00 %"
    assert row(done.stdout, "core") == "39 of     40 lines  97.50 %"
    assert row(done.stdout, "server") == "94 of    100 lines  94.00 %  below 95 %"
    assert report.startswith(done.stdout.rstrip())


def test_95_percent_are_enough_and_less_is_not_rounded_up(tmp_path):
    enough = [(n, int(n >= 5)) for n in range(100)]
    done, _ = run(tmp_path, file_of("src/episode/pool.cpp", enough), file_of("src/ros/a.h", enough))
    assert row(done.stdout, "core") == row(done.stdout, "server") == "95 of    100 lines  95.00 %"
    less = [(n, int(n >= 501)) for n in range(10001)]
    done, _ = run(tmp_path, file_of("src/server/server.cpp", less))
    assert row(done.stdout, "server") == "9500 of  10001 lines  94.99 %  below 95 %"


def test_what_nothing_is_known_of_is_not_covered(tmp_path):
    done, _ = run(tmp_path)
    assert row(done.stdout, "core").endswith("0.00 %  below 95 %")


def test_a_line_is_run_where_an_instance_of_its_template_is(tmp_path):
    done, _ = run(tmp_path, file_of("src/simd/vector.h", [(7, 0), (7, 3), (7, 0)]))
    assert row(done.stdout, "src/simd") == "1 of      1 lines 100.00 %"


@pytest.mark.parametrize("mark", ["gcovr/noncode", "gcovr/excluded"])
def test_what_is_left_out_is_in_neither_number(tmp_path, mark):
    done, _ = run(tmp_path, file_of("src/episode/pool.cpp", [(1, 0)], **{mark: True}))
    assert row(done.stdout, "src/episode") == "0 of      0 lines   0.00 %"


def test_the_report_names_the_lines(tmp_path):
    counts = [(1, 1), (3, 0), (4, 0), (8, 0), (9, 2), (12, 0)]
    _, report = run(
        tmp_path, file_of("src/episode/pool.cpp", counts), file_of("src/base/pacer.cpp", [(1, 1)])
    )
    assert "src/episode/pool.cpp: 33.3 %\n    3-8, 12\n" in report
    assert "pacer" not in report


@pytest.mark.parametrize("room", ROOMS, ids=lambda path: path.name)
def test_it_knows_every_room(tmp_path, room):
    name = f"src/{room.name}"
    done, _ = run(tmp_path, file_of(f"{name}/some.cpp", [(1, 1)]))
    assert done.returncode == 0
    assert row(done.stdout, name).startswith("1 of")


def test_a_room_that_it_does_not_know_is_an_error(tmp_path):
    done, _ = run(tmp_path, file_of("src/elsewhere/some.cpp", [(1, 1)]))
    assert done.returncode != 0
    assert "src/elsewhere/some.cpp" in done.stderr
