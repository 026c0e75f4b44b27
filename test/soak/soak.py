"""Long reliability tests; `scripts/soak --help` describes them."""

import argparse
import multiprocessing
import os
import pathlib
import random
import signal
import sys
import time
import traceback

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST / name) for name in ("", "server", "python", "bench")]

import full_disk  # noqa: E402
import fuzz  # noqa: E402
import graph  # noqa: E402
import hashes  # noqa: E402
import kills  # noqa: E402
import lossy_network  # noqa: E402
import many  # noqa: E402
import tally as tallies  # noqa: E402
import walker_sim  # noqa: E402
from measure import PACKAGES, describe_machine  # noqa: E402
from processes import children_of  # noqa: E402

# Parts that run one after another, and their shares of the time.
SHARES = {
    hashes.hashes: 8,
    kills.kill_server: 10,
    kills.kill_client: 4,
    kills.kill_master: 9,
    kills.kill_rviz: 8,
    lossy_network.lossy_network: 5,
    full_disk.full_disk: 3,
    many.many_subscribers: 4,
    many.many_servers: 5,
    many.many_resets: 9,
    many.many_clients: 6,
}
# Parts that run beside the others from beginning to end, also as load.
BESIDE = (many.many_environments, fuzz.fuzz)
PARTS = {part.__name__: part for part in (*SHARES, *BESIDE)}
NICE = 10  # gives these a tenth of a contended processor


class Soak:
    def __init__(self, name, seconds, options, tally):
        self.name, self.seconds, self.programs = name, seconds, options.programs
        self.random = random.Random(f"{options.seed}/{name}")
        self.check, self.figure, self.leave_out = tally.check, tally.figure, tally.leave_out
        self.tally = tally
        self.begin()

    def begin(self, seconds=None):
        """Starts the part's time, also again after its set-up."""
        self._end = time.monotonic() + (self.seconds if seconds is None else seconds)

    def goes_on(self):
        return time.monotonic() < self._end

    def repeats(self):
        """Yields numbers from 0 until the part's time is over, at least one."""
        number = 0
        while number == 0 or self.goes_on():
            yield number
            number += 1

    def rounds(self):
        """Yields as `repeats` does, and reports how many there were."""
        for number in self.repeats():
            yield number
        self.figure("rounds", number + 1)

    def graph(self, host="localhost"):
        """Returns a context with its own master; `host` is the host name of its nodes."""
        return graph.Graph(self.programs, host)


def say(text):
    print(text, file=sys.stderr, flush=True)


def parse():
    parser = argparse.ArgumentParser(prog="soak", allow_abbrev=False)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=[*PARTS], metavar="NAME")
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--programs", type=pathlib.Path, required=True)
    options = parser.parse_args()
    if not 0 < options.hours < 1000:
        parser.error(f"--hours {options.hours}: must be above 0 and below 1000")
    if options.seed is None:
        options.seed = int.from_bytes(os.urandom(4), "little")
    return options


def run_part(name, seconds, options, tally):
    """Runs one part. An exception is a failure, and so is a process that the part leaves behind."""
    tally.part = name
    begin = time.monotonic()
    try:
        PARTS[name](Soak(name, seconds, options, tally))
    except Exception:
        tally.check("ends without an exception", False, traceback.format_exc())
    else:
        tally.check("ends without an exception", True)
    beside = {process.pid for process in multiprocessing.active_children()}
    children = children_of(os.getpid())
    left = {pid for pid, state in children.items() if state != "Z"} - beside
    tally.check(
        "leaves no process behind", not left, "; ".join(" ".join(graph.command_of(p)) for p in left)
    )
    say(f"{name}: {time.monotonic() - begin:.0f} s; so far {tally.summary()}")


class Beside:
    def __init__(self, name, seconds, options):
        self._name = name
        self._tally, theirs = multiprocessing.Pipe(duplex=False)
        self._process = multiprocessing.Process(
            target=self._run, args=(name, seconds, options, theirs), daemon=True
        )
        self._process.start()
        theirs.close()

    @staticmethod
    def _run(name, seconds, options, pipe):
        os.nice(NICE)
        graph.adopt_orphans()
        tally = tallies.Tally(say)
        run_part(name, seconds, options, tally)
        pipe.send(tally.found())

    def end(self, tally):
        tally.part = self._name
        try:
            tally.add(self._tally.recv())
        except EOFError:
            tally.check("ends with a report", False, "it ended without one")
        self._process.join()

    def stop(self):
        self._process.terminate()
        self._process.join()


def interrupt(*_):
    raise KeyboardInterrupt


def main():
    options = parse()
    for number in (signal.SIGINT, signal.SIGTERM):  # ends the processes that were started
        signal.signal(number, interrupt)
    for name in ("ROS_IP", "ROS_LOG_DIR", "ROS_NAMESPACE"):
        os.environ.pop(name, None)
    graph.adopt_orphans()
    tally = tallies.Tally(say)
    say(f"seed {options.seed}: {options.hours} h, {len(options.only)} parts")
    machine = describe_machine(graph.ROOT, leave_out=PACKAGES)
    seconds, begin = options.hours * 3600, time.monotonic()
    others = [name for name in options.only if PARTS[name] in SHARES]
    shares = sum(SHARES[PARTS[name]] for name in others)
    beside = []
    try:
        if "fuzz" in options.only:
            fuzz.prepare(seconds)
        load = [name for name in options.only if name not in others]
        beside = [Beside(name, seconds, options) for name in load]
        for name in others:
            run_part(name, seconds * SHARES[PARTS[name]] / shares, options, tally)
        for part in beside:
            part.end(tally)
    except KeyboardInterrupt:  # the report has the results so far
        tally.part = "soak"
        tally.check("runs to its end", False, "interrupted")
        for part in beside:
            part.stop()
    head = {
        **{name: text for name, text in machine.items() if text},
        "took": f"{(time.monotonic() - begin) / 60:.1f} min (--hours {options.hours:g})",
        "seed": options.seed,
        "walker_sim": walker_sim.__version__,
        "Python": sys.version.split()[0],
    }
    options.output.write_text(tallies.markdown(tally, head), encoding="utf-8")
    say(f"report: {options.output}")
    print(tally.summary())
    return 1 if tally.failed or not tally.counts else 0


if __name__ == "__main__":
    sys.exit(main())
