"""Rows of the benchmark, and how they are filled: slices of all sides in turn, in rounds."""

import dataclasses
import json
import statistics
import subprocess
from concurrent.futures import ThreadPoolExecutor
from typing import Callable, Dict, List, Optional

PATIENCE = 120  # of a slice, which itself takes a few seconds [s]


class Failure(Exception):
    """Something could not be measured; the text says why."""


@dataclasses.dataclass
class Row:
    """One side of one comparison, with a value for each round."""

    section: str
    environment: str
    side: str
    unit: str
    num_envs: int = 1
    threads: int = 1
    placement: str = ""
    peer: Optional["Row"] = None  # what this one is compared with
    values: List[float] = dataclasses.field(default_factory=list)
    slices: List[dict] = dataclasses.field(default_factory=list)  # all that was printed
    error: str = ""

    @property
    def key(self):
        """What tells a row from all others."""
        return (
            self.section,
            self.environment,
            self.side,
            self.num_envs,
            self.threads,
            self.placement,
        )

    @property
    def median(self):
        return statistics.median(self.values) if self.values else None

    @property
    def ratio(self):
        """To the peer; see `compare`."""
        return compare(self, self.peer)


def compare(row, peer) -> Optional[float]:
    """How many times the peer's value, as the median over the rounds: the two sides of a round met
    the same machine, which may be slower in the next one. None where either has failed."""
    if row is None or peer is None or row.error or peer.error:
        return None
    pairs = list(zip(row.values, peer.values))
    return statistics.median(ours / theirs for ours, theirs in pairs) if pairs else None


def against(rows, peers):
    """Each row, by number of environments, is compared with the peer of the same number."""
    for size, row in rows.items():
        row.peer = peers.get(size)


# What a slice's line says, as a row's value.


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
    """A command that measures once and prints a line for each of its rows."""

    command: List[str]
    read: Callable[[dict], float]
    rows: Dict[int, Row]  # by number of environments
    cores: List[int]
    apart: bool = False  # a process on each of the cores at the same time, in place of one on all

    def run(self, cwd):
        """Adds a value to each row, or says in all of them why there is none."""
        try:
            processes = self.measure(cwd)
            for lines in processes:
                if [line.get("num_envs", 1) for line in lines] != list(self.rows):
                    raise Failure(f"{self.command[0]} printed {lines}")
            for lines, row in zip(zip(*processes), self.rows.values()):
                row.values.append(sum(map(self.read, lines)))
                row.slices.extend(lines)
        except Failure as failure:
            for row in self.rows.values():
                row.error = str(failure)

    def measure(self, cwd):
        """For each process the lines that it printed."""
        places = [[core] for core in self.cores] if self.apart else [self.cores]
        with ThreadPoolExecutor(len(places)) as executor:
            return list(executor.map(lambda cores: run_slice(self.command, cores, cwd), places))

    @property
    def has_failed(self):
        return any(row.error for row in self.rows.values())


def run_slice(command, cores, cwd, patience=PATIENCE):
    """The lines of JSON that a command on these cores prints within the patience [s]."""
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
        words = done.stderr.strip().splitlines() or ["it said nothing"]
        raise Failure(f"status {done.returncode}: {words[-1]}")
    try:
        return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    except ValueError as error:
        raise Failure(f"{' '.join(pinned)} printed no JSON: {error}") from None


@dataclasses.dataclass
class Plan:
    """The jobs of a section. Their sides take turns: a round runs each once."""

    section: str
    unit: str
    read: Callable[[dict], float]
    folder: str  # where the commands run, and leave what they like to leave
    jobs: List[Job] = dataclasses.field(default_factory=list)

    def add(self, side, environment, command, cores, sizes=(1,), apart=False, **attributes):
        """Rows by number of environments; none without a command. Where processes run apart, a row
        is their sum."""
        if command is None:
            return {}
        rows = {
            size: Row(
                self.section,
                environment,
                side,
                self.unit,
                num_envs=size,
                **attributes,
            )
            for size in sizes
        }
        self.jobs.append(Job(command, self.read, rows, cores, apart))
        return rows

    def run(self, rounds):
        """All rows. A job that has failed is left out from then on."""
        for _ in range(rounds):
            for job in self.jobs:
                if not job.has_failed:
                    job.run(self.folder)
        return [row for job in self.jobs for row in job.rows.values()]
