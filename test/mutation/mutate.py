"""Small breaks of our code, each of which a test shall catch; see `scripts/dev/mutate --help`."""

import argparse
import contextlib
import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys

import draw
import operators
import process
import suite

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs" / "testing.md"
BUILD_SECONDS = 1800  # which no build takes; a compiler may hang over a break
CAUGHT, LIVES, NO_BREAK = "caught", "lives", "does not compile"


def say(text):
    print(text, flush=True)


def sources(root):
    """Of git's, also those that it does not know yet, but for what it is told to ignore."""
    told = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"],
        cwd=root,
        check=True,
        stdout=subprocess.PIPE,
    ).stdout
    return [path for path in told.decode().split("\0") if path and (root / path).is_file()]


def copy_tree(root, copy):
    """Makes the copy's files equal to the sources; what is equal keeps its time."""
    wanted = set(sources(root))
    for path in wanted:
        target, content = copy / path, (root / path).read_bytes()
        if not target.is_file() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            target.chmod((root / path).stat().st_mode)
    manifest = copy / "build" / "sources.json"
    manifest.parent.mkdir(exist_ok=True)
    before = json.loads(manifest.read_text()) if manifest.exists() else []
    for path in set(before) - wanted:
        (copy / path).unlink()
    manifest.write_text(json.dumps(sorted(wanted)))


def digest_of(root):
    """Of what tests and what is tested."""
    digest = hashlib.sha256()
    for path in sorted(sources(root)):
        if not path.startswith(("docs/", "README", "CHANGELOG", "test/mutation/", "scripts/")):
            digest.update(path.encode() + b"\0" + (root / path).read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def equivalents(text):
    """The ids in the documentation's table of breaks that change nothing."""
    return set(re.findall(r"^\| `([0-9a-f]{8})` \|", text, re.MULTILINE))


@contextlib.contextmanager
def broken_file(copy, a_break):
    file = copy / a_break.path
    text = file.read_text(encoding="utf-8")
    file.write_text(operators.broken(text, a_break), encoding="utf-8")
    try:
        yield
    finally:
        file.write_text(text, encoding="utf-8")


class Trials:
    """The copy that is broken, and what is known of each break so far, kept in a file."""

    def __init__(self, copy, jobs, kept):
        self._copy, self._jobs, self._kept = copy, jobs, kept
        self._build = copy / "build" / ".ros"
        self._logs = copy / "build" / "log"
        self._logs.mkdir(parents=True, exist_ok=True)
        known = json.loads(kept.read_text()) if kept.exists() else {}
        self.verdicts = known.get("verdicts", {})  # by id
        self._baselines = known.get("baselines", {})  # by phase and room: the tree's digest
        self._seconds = known.get("seconds", {})  # of each test by its name
        self._tree = digest_of(ROOT)
        self._runner = suite.Runner(self._logs, 2 * jobs, self._seconds)
        self._tests = None

    def save(self):
        new = self._kept.with_suffix(".new")
        known = {"verdicts": self.verdicts, "baselines": self._baselines, "seconds": self._seconds}
        new.write_text(json.dumps(known, indent=1, sort_keys=True))
        new.replace(self._kept)

    def build(self, targets):
        """Whether it could be; the output is in the copy's build/log/build.log."""
        command = ["ninja", "-C", str(self._build), "-j", str(self._jobs), *targets]
        started = process.Process(command, self._logs / "build.log")
        try:
            return started.wait(BUILD_SECONDS) == 0
        except subprocess.TimeoutExpired:
            return False
        finally:
            started.end()

    def check_baseline(self, phase, room):
        """That all is well without a break; SystemExit otherwise."""
        key = f"{phase} {room}"
        if self._baselines.get(key) == self._tree:
            return
        tests = self._concerned(phase, room)
        if not tests:
            sys.exit(f"no test is among the {phase} of {room}")
        if not self.build(suite.targets(phase, tests)):
            sys.exit(
                f"without a break, the {phase} of {room} cannot be built: {self._logs}/build.log"
            )
        failure = self._runner.first_failure(tests)
        if failure:
            sys.exit(f"without a break, {failure.test} fails: {failure.why}; see {self._logs}")
        say(f"without a break: {len(tests)} tests pass, the {phase} of {room}")
        self._baselines[key] = self._tree
        self.save()

    def _concerned(self, phase, room):
        if self._tests is None:
            self._tests = suite.tests_of(self._build)
        return suite.concerned(self._tests, phase, room)

    def is_open(self, phase, a_break):
        """Whether this phase has something to say of it that is not known."""
        known = self.verdicts.get(a_break.id)
        if known is None or (known["verdict"] == LIVES and known["tree"] != self._tree):
            return phase == suite.PHASES[0]
        order = suite.PHASES.index
        return known["verdict"] == LIVES and order(phase) > order(known["phase"])

    def attempt(self, phase, a_break):
        """Its verdict after this phase; known ones are not tried again."""
        room = draw.room_of(a_break)
        if self.is_open(phase, a_break):
            self.check_baseline(phase, room)
            with broken_file(self._copy, a_break):
                found = self._try(phase, room, a_break)
            self.verdicts[a_break.id] = {
                **found,
                "phase": phase,
                "tree": self._tree,
                "break": str(a_break),
            }
            self.save()
            say(f"{a_break.id} {found['verdict']}{found.get('by', '')}: {a_break}")
        return self.verdicts[a_break.id]["verdict"]

    def _try(self, phase, room, a_break):
        tests = suite.ranked(self._concerned(phase, room), a_break.path, self._seconds)
        if not self.build(suite.targets(phase, tests)):
            return {"verdict": NO_BREAK}
        failure = self._runner.first_failure(tests)
        if failure:
            return {"verdict": CAUGHT, "by": f" by {failure.test} ({failure.why})"}
        return {"verdict": LIVES}


def shares(sides, count):
    """How many of each side: as many, the first one more where they are uneven."""
    return [(side, (count + i) // len(sides)) for i, side in enumerate(reversed(sides))][::-1]


def run(trials, sides, count, known):
    """The breaks that are some, after every phase; the known ones after the first alone."""
    made = []
    for side, wanted in shares(sides, count):
        waiting, found = iter(side.breaks), []
        while len(found) < wanted:
            each = next(waiting, None)
            if each is None:
                say(f"{side.name}: only {len(found)} breaks, not {wanted}")
                break
            if trials.attempt(suite.PHASES[0], each) != NO_BREAK:
                found.append(each)
        made += found
    for phase in suite.PHASES[1:]:
        for each in made:
            if each.id not in known:
                trials.attempt(phase, each)
    return made


def tell(trials, made, known):
    """The summary; the status."""
    lines = {CAUGHT: [], LIVES: []}
    for each in made:
        lines[trials.verdicts[each.id]["verdict"]].append(each)
    living = [each for each in lines[LIVES] if each.id not in known]
    wrongly_listed = [each for each in lines[CAUGHT] if each.id in known]
    for each in living:
        say(f"lives: {each.id} {each}")
    for each in wrongly_listed:
        say(f"is caught, though {DOCS.name} says that nothing can tell: {each.id} {each}")
    failed = len(living) + len(wrongly_listed)
    equivalent = len(lines[LIVES]) - len(living)
    passed = len(lines[CAUGHT]) - len(wrongly_listed)
    print(
        f"{passed} passed, {failed} failed" + (f", {equivalent} equivalent" if equivalent else "")
    )
    return 1 if failed or not passed else 0


def parse(arguments=None):
    parser = argparse.ArgumentParser(prog="mutate", allow_abbrev=False)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--copy", type=pathlib.Path, required=True)
    parser.add_argument("--make-copy", action="store_true")
    options = parser.parse_args(arguments)
    if not 0 < options.count < 10000:
        parser.error(f"--count {options.count}: must be above 0 and below 10000")
    known = (*draw.PHYSICS, *draw.ROS)
    for name in options.only:
        if name not in known and not re.fullmatch(r"[0-9a-f]{8}", name):
            parser.error(f"--only {name}: must be the id of a break or one of {', '.join(known)}")
    return options


def select(options):
    """The sides that are asked for, and how many breaks of them."""
    ids = [name for name in options.only if re.fullmatch(r"[0-9a-f]{8}", name)]
    rooms = [name for name in options.only if name not in ids]
    sides = draw.draw(ROOT, options.seed, rooms)
    if not ids:
        # A room alone is one side.
        full = [side for side in sides if side.breaks]
        return full, options.count
    found = [each for side in sides for each in side.every if each.id in ids]
    missing = set(ids) - {each.id for each in found}
    if missing:
        sys.exit(f"--only {' '.join(sorted(missing))}: no such break in these sources")
    return [draw.Side("chosen", found, found)], len(found)


def interrupt(*_):
    raise KeyboardInterrupt


def main():
    options = parse()
    if options.make_copy:
        copy_tree(ROOT, options.copy)
        return 0
    sides, count = select(options)
    if options.list:
        for side, wanted in shares(sides, count):
            for each in side.breaks[:wanted]:
                say(f"{each.id} {each}")
        return 0
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
    process.adopt_orphans()
    trials = Trials(options.copy, len(os.sched_getaffinity(0)), ROOT / "build" / "mutation.json")
    known = equivalents(DOCS.read_text(encoding="utf-8"))
    try:
        made = run(trials, sides, count, known)
    except KeyboardInterrupt:
        say("interrupted; the next run goes on from here")
        return 130
    return tell(trials, made, known)


if __name__ == "__main__":
    sys.exit(main())
