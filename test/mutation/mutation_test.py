"""The mutator itself, on sources and tests that need no compiler."""

import pathlib
import subprocess
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import draw
import mutate
import operators
import suite

BODY = """\
// a < b
#include "a < b.h"
int area(int a, int b) {
  if (a < b && !is_flat(a)) return 0;
  store("a < b", a, b);
  return a * b;
}
"""


def news(line, follows_statement=True):
    return {kind: new.strip() for kind, new in operators.variants(line, follows_statement)}


@pytest.mark.parametrize(
    ("line", "kind", "new"),
    [
        ("  x = a < b;", "operator", "x = a <= b;"),
        ("  x = a >= b;", "operator", "x = a > b;"),
        ("  x = a && b;", "operator", "x = a || b;"),
        ("  x += y;", "operator", "x -= y;"),
        ("  return a * b;", "operator", "return a / b;"),
        ("  is_open_ = true;", "word", "is_open_ = false;"),
        ("  x = std::min(a, b);", "word", "x = std::max(a, b);"),
        ("  x = y[2];", "number", "x = y[3];"),
        ("  x = 7U;", "number", "x = 8U;"),
        ("  x = 0.5F;", "number", "x = 0.5005F;"),
        ("  x = 0.0;", "number", "x = 0.001;"),
        ("  return !a;", "no negation", "return a;"),
        ("  if (a) return b;", "negation", "if (!(a)) return b;"),
        ("  x = f(a, b);", "arguments", "x = f(b, a);"),
        ("  x.call(a.b(), c);", "no statement", ";"),
        ("  x = y;", "no statement", ";"),
    ],
)
def test_breaks(line, kind, new):
    assert news(line)[kind] == new


@pytest.mark.parametrize(
    "line",
    [
        "#include <a - b>",
        "  // a < 2",
        "  static_assert(a < 2);",
        '  ROS_WARN_STREAM("a" << 1 + 2);',
        "  throw std::invalid_argument(a + 1);",
        '  "a < 2 && !b"',
        "  kill(process_, SIGKILL);",
        "  std::vector<Vec3> x1;",
        "  std::uint32_t x = 0x1fU;",
    ],
)
def test_leaves_alone(line):
    assert news(line) == {}


def test_part_of_a_statement_is_not_left_out():
    assert "no statement" not in news("    b, c(d));", follows_statement=False)
    assert "no statement" not in news("    f(a), b));")


def test_one_line_changes():
    for each in operators.breaks_of("src/base/area.cpp", BODY):
        new = operators.broken(BODY, each).splitlines()
        differing = [i for i, line in enumerate(BODY.splitlines(), 1) if new[i - 1] != line]
        assert differing == [each.number], each
        assert '"a < b"' in new[4] or each.kind == "no statement", each


def test_another_line_there_is_an_error():
    each = operators.breaks_of("src/base/area.cpp", BODY)[0]
    with pytest.raises(ValueError, match=r"src/base/area\.cpp:4"):
        operators.broken("\n" + BODY, each)


def test_an_id_is_of_the_words():
    before = operators.breaks_of("src/base/area.cpp", BODY)
    after = operators.breaks_of("src/base/area.cpp", "int one = 1;\n" + BODY)
    assert {each.id for each in before} < {each.id for each in after}
    assert len({each.id for each in after}) == len(after)


@pytest.fixture
def tree(tmp_path):
    """A tree of git's with sources of both sides."""
    for room in (*draw.PHYSICS, *draw.ROS):
        file = tmp_path / "src" / room / "area.cpp"
        file.parent.mkdir(parents=True)
        file.write_text(BODY)
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    return tmp_path


def test_draws_the_same_for_a_seed(tree):
    first, again, other = (draw.draw(tree, seed) for seed in (1, 1, 2))
    assert first == again != other
    physics, ros = first
    assert {draw.room_of(each) for each in physics.breaks} == set(draw.PHYSICS)
    assert {draw.room_of(each) for each in ros.breaks} == set(draw.ROS)
    assert [len(side.breaks) for side in first] == [3 * len(draw.PHYSICS), 3 * len(draw.ROS)]


def test_a_new_file_moves_no_other(tree):
    before = draw.draw(tree, 1)[0].breaks
    (tree / "src" / "base" / "volume.cpp").write_text(BODY)
    after = draw.draw(tree, 1)[0].breaks
    assert [each for each in after if not each.path.endswith("volume.cpp")] == before


def test_the_copy_follows_the_tree(tree, tmp_path_factory):
    copy = tmp_path_factory.mktemp("copy")
    file = copy / "src" / "base" / "area.cpp"
    mutate.copy_tree(tree, copy)
    kept = (copy / "src" / "ros" / "area.cpp").stat().st_mtime_ns
    file.write_text("broken")
    (tree / "src" / "robots" / "hopper" / "area.cpp").unlink()
    mutate.copy_tree(tree, copy)
    assert file.read_text() == BODY
    assert (copy / "src" / "ros" / "area.cpp").stat().st_mtime_ns == kept
    assert not (copy / "src" / "robots" / "hopper" / "area.cpp").exists()


def a_test(name, command, is_unit=True):
    return suite.Test(name, ["sh", "-c", command], {}, None, is_unit)


@pytest.fixture
def runner(tmp_path):
    return suite.Runner(tmp_path, 2, {})


def test_finds_what_fails(runner):
    tests = [a_test("base_a", "true"), a_test("base_b", "exit 3"), a_test("base_c", "true")]
    assert runner.first_failure(tests) == ("base_b", "status 3")
    assert runner.first_failure([tests[0], tests[2]]) is None


def test_finds_what_hangs(runner, monkeypatch):
    monkeypatch.setattr(suite, "LEAST", 0.2)
    monkeypatch.setattr(suite, "UNKNOWN", 0.2)
    failure = runner.first_failure([a_test("base_hangs", "sleep 1000 & wait")])
    assert failure.test == "base_hangs"
    assert failure.why.startswith("not within ")


def test_a_failure_has_to_be_one_alone_too(runner, tmp_path):
    once = f"test -e {tmp_path}/once || {{ touch {tmp_path}/once; exit 1; }}"
    also = f"sleep 0.1; touch {tmp_path}/also"
    assert runner.first_failure([a_test("base_once", once), a_test("base_also", also)]) is None
    assert (tmp_path / "also").exists()  # which was put off


@pytest.mark.parametrize(
    ("text", "case"),
    [
        ("[ RUN      ] Area.IsFlat\n[  FAILED  ] Area.IsFlat (0 ms)\n", "Area.IsFlat"),
        ("[ RUN      ] Area.First\n[       OK ] Area.First\n[ RUN      ] Area.Dies\n", "Area.Dies"),
        ("FAILED test/base/area_test.py::test_area - assert 1 == 2\n", "test_area"),
        ("\x1b[31m[walker_sim.rosunit-area_test/test_area][FAILURE]----\x1b[0m\n", "test_area"),
        ("killed\n", ""),
    ],
)
def test_names_the_case(text, case):
    assert suite.first_words(text) == case


def test_likely_ones_come_first():
    names = ["base_slow_test", "base_area_test", "base_quick_test"]
    tests = [a_test(name, "true") for name in names]
    seconds = {"base_slow_test": 9, "base_area_test": 20, "base_quick_test": 1}
    ranked = suite.ranked(tests, "src/base/area.cpp", seconds)
    assert [test.name for test in ranked] == ["base_area_test", "base_quick_test", "base_slow_test"]


def test_every_room_has_tests():
    assert set(suite.UNITS) == set(suite.CALLERS) == {*draw.PHYSICS, *draw.ROS}


def test_what_is_built_is_what_runs():
    command = "python3 run_tests.py x.xml --return-code '/x/lib/walker_sim/base_tests --file=a.cpp'"
    unit = suite.Test("base_a", command.split(), {}, None, True)
    caller = a_test("python_keywords_test", "true", is_unit=False)
    tests = [unit, caller, a_test("server_a", "true")]
    assert suite.targets("units", suite.concerned(tests, "units", "base")) == ["base_tests"]
    assert suite.concerned(tests, "callers", "base") == tests[1:]


@pytest.fixture
def trials(tree, monkeypatch, tmp_path_factory):
    """Of breaks in a room whose test sees the product alone, and one that sees no zero."""
    copy = tmp_path_factory.mktemp("copy")
    monkeypatch.setattr(mutate, "ROOT", tree)
    mutate.copy_tree(tree, copy)
    product = f"grep -q 'a \\* b' {copy}/src/base/area.cpp"
    compiles = f"grep -q 'int area' {copy}/src/base/area.cpp"
    tests = [a_test("base_product", product), a_test("server_area", compiles, is_unit=False)]
    monkeypatch.setattr(suite, "tests_of", lambda build: tests)
    monkeypatch.setattr(mutate.Trials, "build", lambda self, targets: True)
    kept = tmp_path_factory.mktemp("kept") / "mutation.json"
    return lambda: mutate.Trials(copy, 1, kept)


def find(tree, new):
    breaks = draw.draw(tree, 1, ["base"])[0].every
    return next(each for each in breaks if each.new.strip() == new)


def test_a_sure_kill_is_caught(tree, trials):
    known = trials()
    assert known.attempt("units", find(tree, "return a / b;")) == "caught"
    (verdict,) = known.verdicts.values()
    assert "base_product" in verdict["by"]


def test_a_sure_survivor_lives(tree, trials, capsys):
    known, each = trials(), find(tree, "if (a <= b && !is_flat(a)) return 0;")
    for phase in suite.PHASES:
        assert known.attempt(phase, each) == "lives"
    capsys.readouterr()
    assert mutate.tell(known, [each], set()) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "0 passed, 1 failed"
    killed = find(tree, "return a / b;")
    known.attempt("units", killed)
    assert mutate.tell(known, [each, killed], {each.id}) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "1 passed, 0 failed, 1 equivalent"
    assert mutate.tell(known, [each, killed], {each.id, killed.id}) == 1


def test_what_does_not_compile_is_no_break(tree, trials, monkeypatch):
    known, each = trials(), find(tree, "return a / b;")
    known.check_baseline("units", "base")
    monkeypatch.setattr(mutate.Trials, "build", lambda self, targets: False)
    assert known.attempt("units", each) == "does not compile"
    assert not known.is_open("callers", each)


def test_without_a_break_all_must_pass(tree, trials, monkeypatch):
    fails = [a_test("base_fails", "exit 1")]
    monkeypatch.setattr(suite, "tests_of", lambda build: fails)
    with pytest.raises(SystemExit, match="without a break, base_fails fails"):
        trials().attempt("units", find(tree, "return a / b;"))


def test_goes_on_where_it_was(tree, trials):
    killed, living = find(tree, "return a / b;"), find(tree, "if (a < b && is_flat(a)) return 0;")
    first = trials()
    for phase in suite.PHASES:
        first.attempt(phase, living)
    first.attempt("units", killed)
    again = trials()
    assert again.verdicts == first.verdicts
    assert not any(
        again.is_open(phase, each) for phase in suite.PHASES for each in (killed, living)
    )
    (tree / "test").mkdir()
    (tree / "test" / "area_test.cpp").write_text("new")
    changed = trials()
    assert changed.is_open("units", living)
    assert not changed.is_open("units", killed)


def test_each_side_has_its_share():
    assert mutate.shares(["physics", "ROS"], 51) == [("physics", 26), ("ROS", 25)]
    assert mutate.shares(["physics", "ROS"], 50) == [("physics", 25), ("ROS", 25)]
    assert mutate.shares(["chosen"], 3) == [("chosen", 3)]


def test_a_run_has_the_wanted_number_of_each_side(tree, trials, capsys):
    sides = draw.draw(tree, 1, ["base"])
    assert len(mutate.run(trials(), [sides[0]], 3, set())) == 3
    assert "physics: only" not in capsys.readouterr().out
    living = find(tree, "if (a < b && is_flat(a)) return 0;")
    chosen = draw.Side("chosen", [living], [living])
    known = trials()
    mutate.run(known, [chosen], 1, {living.id})
    assert known.verdicts[living.id]["phase"] == "units"
    mutate.run(known, [chosen], 1, set())
    assert known.verdicts[living.id]["phase"] == "callers"


def test_an_interrupted_break_is_mended(tree):
    each = find(tree, "return a / b;")
    with pytest.raises(KeyboardInterrupt), mutate.broken_file(tree, each):
        assert "a / b" in (tree / each.path).read_text()
        raise KeyboardInterrupt
    assert (tree / each.path).read_text() == BODY


def test_reads_the_documentation():
    text = "| `0123abcd` | why |\n| `word` | not one |\n"
    assert mutate.equivalents(text) == {"0123abcd"}


@pytest.mark.parametrize(
    "options", [["--count", "0"], ["--only", "cor"], ["--seed", "x"], ["--all"]]
)
def test_bad_options_are_refused(options, capsys):
    with pytest.raises(SystemExit) as refused:
        mutate.parse(["--copy", "x", *options])
    assert refused.value.code == 2
    assert options[0] in capsys.readouterr().err
