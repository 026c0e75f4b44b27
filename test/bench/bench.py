"""Measures walker_sim beside its peers; ./scripts/bench sets up what this needs, and calls it."""

import argparse
import dataclasses
import importlib.resources
import json
import os
import pathlib
import shutil
import signal
import sys
import tempfile
import time
from typing import FrozenSet, List, Optional

HERE = pathlib.Path(__file__).parent
sys.path.append(str(HERE.parent))
import in_process  # noqa: E402
import learning  # noqa: E402
import over_ros  # noqa: E402
import report  # noqa: E402
from measure import Failure, Row, describe_machine  # noqa: E402

ROOT = HERE.parents[1]
SECTIONS = {
    "core": in_process.core,
    "pool": in_process.pool,
    "scaling": in_process.scaling,
    "worlds": in_process.worlds,
    "lockstep": over_ros.lockstep,
    "transport": over_ros.transport,
    "step_batch": over_ros.step_batch,
    "free": over_ros.free,
    "jitter": over_ros.jitter,
    "memory": in_process.memory,
    "start": over_ros.start,
    "reset": in_process.reset,
    "act": in_process.act,
    "python": in_process.python,
}
LONG_SECTIONS = {"training": learning.training, "policies": learning.policies}
ALL_SECTIONS = {**SECTIONS, **LONG_SECTIONS}
MODELS = {  # in Gymnasium
    "Walker2d-v4": "walker2d.xml",
    "Walker2d-v5": "walker2d_v5.xml",
    "Hopper-v5": "hopper.xml",
}
QUICK_SECONDS = 0.1
QUICK_SHARE = 10  # divides the number of environments


@dataclasses.dataclass
class Settings:
    programs: pathlib.Path  # folder of this package's programs
    folder: pathlib.Path  # for files that the processes write
    one_core: List[int]
    two_cores: List[int]
    is_quick: bool
    without: FrozenSet[str]  # peers to skip
    learner: Optional[pathlib.Path] = None  # Python interpreter with Stable-Baselines3
    python_of_mjbatch: Optional[pathlib.Path] = None

    def seconds(self, usual):
        return min(usual, QUICK_SECONDS) if self.is_quick else usual

    def rounds(self, usual):
        return 1 if self.is_quick else usual

    def count(self, usual):
        return usual // QUICK_SHARE if self.is_quick else usual

    def ours(self, kind, env, *options):
        return [self.programs / "walker_sim_benchmark", kind, "--env", env, *options]

    def python(self, kind, env, *options):
        env = f"walker_sim/{env}"
        return [sys.executable, HERE / "peers.py", kind, "--env", env, *options]

    def peer(self, kind, env, *options):
        """Returns the peer's command, or None if the peer is skipped."""
        if kind.split("-")[0] in self.without:
            return None
        return [sys.executable, HERE / "peers.py", kind, "--env", env, *options]

    def mjbatch(self, env, *options):
        """Returns the command for Gymnasium's model; None without a model or mjbatch."""
        model = MODELS.get(env)
        if self.python_of_mjbatch is None or model is None:
            return None
        folder = importlib.resources.files("gymnasium.envs.mujoco") / "assets"
        return [
            *(self.python_of_mjbatch, HERE / "mjbatch_peer.py"),
            *("--model", folder / model, *options),
        ]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=pathlib.Path, required=True, metavar="FOLDER")
    parser.add_argument("--output", type=pathlib.Path, required=True, metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="slices of 0.1 s")
    parser.add_argument("--update-readme", action="store_true")
    parser.add_argument("--only", default=",".join(SECTIONS), metavar="SECTION[,SECTION...]")
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        choices=("envpool", "gymnasium", "plot"),
        help="skip what is not installed",
    )
    parser.add_argument("--learner", type=pathlib.Path, help="a Python with Stable-Baselines3")
    parser.add_argument("--mjbatch", type=pathlib.Path, help="a Python with mjbatch")
    arguments = parser.parse_args()
    arguments.only = arguments.only.split(",")
    for name in arguments.only:
        if name not in ALL_SECTIONS:
            parser.error(f"--only {name}: must be among {', '.join(ALL_SECTIONS)}")
    if arguments.update_readme and (arguments.quick or set(arguments.only) != set(SECTIONS)):
        parser.error("--update-readme: not allowed with --quick or --only")
    return arguments


def choose_cores():
    """Returns the last core and the last two cores, because the first serves most interrupts."""
    cores = sorted(os.sched_getaffinity(0))
    if len(cores) < 2:
        raise Failure(f"this process may use {len(cores)} core; must be 2 or more")
    return cores[-1:], cores[-2:]


def run_sections(names, settings):
    rows = []
    for number, name in enumerate(names, 1):
        begin = time.monotonic()
        print(f"[{number}/{len(names)}] {name}", end=" ", file=sys.stderr, flush=True)
        try:
            rows += ALL_SECTIONS[name](settings)
        except (Failure, OSError) as failure:
            rows.append(Row(name, "", "all of it", "", error=str(failure)))
        print(f"{time.monotonic() - begin:.0f} s", file=sys.stderr)
    return rows


def write(arguments, machine, rows):
    """Writes bench.json, the plot, README and the benchmark page; prints the tables."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    with open(arguments.output / "bench.json", "w", encoding="utf-8") as file:
        json.dump(report.as_json(machine, rows, is_quick=arguments.quick), file, indent=1)
    print(report.as_text(machine, rows))
    picture = arguments.output / "benchmark.png"
    if "plot" not in arguments.without and set(arguments.only) == set(SECTIONS):
        import plot

        plot.draw(rows, machine, picture)
    if arguments.update_readme:
        report.update(ROOT / "README.md", report.as_summary(rows))
        report.update(ROOT / "docs/benchmark.md", report.as_markdown(machine, rows))
        shutil.copyfile(picture, ROOT / "docs/benchmark.png")


def main():
    arguments = parse_arguments()
    # Like Ctrl-C: unwinds the stack, which stops the child processes.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by SIGTERM"))
    one_core, two_cores = choose_cores()
    machine = describe_machine(ROOT, leave_out=arguments.without)
    with tempfile.TemporaryDirectory(prefix="walker_sim_bench_") as folder:
        settings = Settings(
            programs=arguments.programs.resolve(),
            folder=pathlib.Path(folder),
            one_core=one_core,
            two_cores=two_cores,
            is_quick=arguments.quick,
            without=frozenset(arguments.without),
            learner=arguments.learner,
            python_of_mjbatch=arguments.mjbatch,
        )
        rows = run_sections(arguments.only, settings)
    write(arguments, machine, rows)
    failed = [row for row in rows if row.error]
    for row in failed:
        names = " ".join(filter(None, (row.environment, row.side, row.condition)))
        print(f"FAILED {row.section}, {names}: {row.error}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failure as failure:
        sys.exit(f"bench: {failure}")
    except KeyboardInterrupt:
        sys.exit(130)
