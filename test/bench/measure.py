"""Rows of the benchmark, and its machine. In each round, every side of a comparison runs one slice
in turn."""

import dataclasses
import datetime
import importlib.metadata
import json
import os
import pathlib
import platform
import re
import statistics
import subprocess
from concurrent.futures import ThreadPoolExecutor
from typing import Callable, Dict, List, Optional

from processes import Failure

PATIENCE = 120  # timeout of a slice, which takes a few seconds [s]
PACKAGES = {"envpool": ("envpool",), "gymnasium": ("gymnasium", "box2d", "mujoco", "numpy")}


@dataclasses.dataclass
class Row:
    """One side of a comparison, with one value per round."""

    section: str
    environment: str
    side: str
    unit: str
    num_envs: int = 1
    threads: int = 1
    condition: str = ""  # what runs beside the measured processes
    peer: Optional["Row"] = None  # the other side of the comparison
    values: List[float] = dataclasses.field(default_factory=list)
    slices: List[dict] = dataclasses.field(default_factory=list)
    error: str = ""

    @property
    def median(self):
        return statistics.median(self.values) if self.values else None

    @property
    def ratio(self):
        """Median of the rounds' ratios to the peer, or None if either row failed.

        A ratio of medians would depend on changes of the machine's speed between rounds.
        """
        if self.peer is None or self.error or self.peer.error:
            return None
        pairs = list(zip(self.values, self.peer.values))
        return statistics.median(ours / theirs for ours, theirs in pairs) if pairs else None


def find(rows, section, environment, side, **attributes):
    """Returns the first row with these attributes; None if there is none."""
    wanted = {"section": section, "environment": environment, "side": side, **attributes}
    for row in rows:
        if all(getattr(row, name) == value for name, value in wanted.items()):
            return row
    return None


def against(rows, peers):
    for size, row in rows.items():
        row.peer = peers.get(size)


# Conversions from a slice's line of output to a row's value.


def steps_per_processor_second(line):
    return line["steps"] / line["processor_seconds"]


def steps_per_second(line):
    return line["steps"] / line["seconds"]


def microseconds_of_processor_time(line):
    return 1e6 * line["processor_seconds"] / line["steps"]


def kilobytes(line):
    return line["bytes_per_environment"] / 1000


@dataclasses.dataclass
class Job:
    """A command that runs one slice and prints one line per row."""

    command: List[str]
    read: Callable[[dict], float]
    rows: Dict[int, Row]  # by number of environments
    cores: List[int]
    apart: bool = False  # one process per core concurrently, instead of one on all cores

    def run(self, cwd):
        core_sets = [[core] for core in self.cores] if self.apart else [self.cores]
        try:
            with ThreadPoolExecutor(len(core_sets)) as executor:
                processes = list(
                    executor.map(lambda cores: run_slice(self.command, cores, cwd), core_sets)
                )
            for lines in processes:
                if [line.get("num_envs", 1) for line in lines] != list(self.rows):
                    raise Failure(f"{self.command[0]} printed {lines}")
            for lines, row in zip(zip(*processes), self.rows.values()):
                row.values.append(sum(map(self.read, lines)))
                row.slices.extend(lines)
        except Failure as failure:
            for row in self.rows.values():
                row.error = str(failure)

    @property
    def has_failed(self):
        return any(row.error for row in self.rows.values())


def run_slice(command, cores, cwd, patience=PATIENCE):
    """Runs a command on these cores for at most `patience` seconds; returns its JSON lines."""
    pinned = ["taskset", "--cpu-list", ",".join(map(str, cores)), *map(str, command)]
    try:
        done = subprocess.run(
            pinned,
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=patience,
        )
    except subprocess.TimeoutExpired:
        raise Failure(f"took longer than {patience} s: {' '.join(pinned)}") from None
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise Failure(f"status {done.returncode}: {lines[-1]}")
    try:
        return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    except ValueError as error:
        raise Failure(f"{' '.join(pinned)} printed no JSON: {error}") from None


@dataclasses.dataclass
class Plan:
    """The jobs of a section. A round runs each job once."""

    section: str
    unit: str
    read: Callable[[dict], float]
    folder: str  # working directory of the commands
    jobs: List[Job] = dataclasses.field(default_factory=list)

    def add(self, side, environment, command, cores, sizes=(1,), apart=False, **attributes):
        """Adds a job, unless the command is None. Returns its rows by number of environments."""
        if command is None:
            return {}
        rows = {
            size: Row(self.section, environment, side, self.unit, num_envs=size, **attributes)
            for size in sizes
        }
        self.jobs.append(Job(command, self.read, rows, cores, apart))
        return rows

    @property
    def rows(self):
        return [row for job in self.jobs for row in job.rows.values()]

    def run(self, rounds):
        """Runs the rounds and returns all rows. Skips a job after its first failure."""
        for _ in range(rounds):
            for job in self.jobs:
                if not job.has_failed:
                    job.run(self.folder)
        return self.rows


def describe_machine(root, leave_out=()):
    cpuinfo = pathlib.Path("/proc/cpuinfo").read_text()
    model = re.search(r"^model name\s*: (.*)$", cpuinfo, re.MULTILINE)
    kind = "virtual machine" if " hypervisor " in cpuinfo else "machine"
    names = [name for peer, names in PACKAGES.items() if peer not in leave_out for name in names]
    versions = [f"{name} {importlib.metadata.version(name)}" for name in names]
    return {
        "date": datetime.date.today().isoformat(),
        "CPU": model.group(1) if model else platform.machine(),
        "cores": f"{os.cpu_count()} ({kind})",
        "kernel": platform.release(),
        "system": first_line("sh", "-c", '. /etc/os-release && echo "$PRETTY_NAME"'),
        "compiler": first_line("c++", "--version"),
        "walker_sim": first_line("git", "-C", root, "describe", "--always", "--dirty"),
        "peers": ", ".join(versions),
        "load average before": f"{os.getloadavg()[0]:.2f}",
    }


def first_line(*command):
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8", check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.splitlines()[0]
