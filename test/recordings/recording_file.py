"""Format of the recordings: words separated by white space; comment lines begin with #."""

from __future__ import annotations

import json
import pathlib
from importlib.metadata import version

import numpy as np
from gymnasium_reference import Plan, Session, hashes

FOLDER = pathlib.Path(__file__).parent
LARGE_SEEDS = (
    *(2**31, 2**32 - 1, 2**32, 2**32 + 1, 2**63 - 1, 2**63, 2**64 - 1),
    *(0x123456789ABCDEF0, 0xFEDCBA9876543210, 0xDEADBEEF00000000, 0x00000001FFFFFFFF),
)


def write(name, description, lines, script, packages):
    versions = ", ".join(f"{package} {version(package)}" for package in packages)
    with open(FOLDER / name, "w", encoding="ascii") as file:
        file.write(f"# {description}\n# Made by {script} with {versions}.\n")
        file.writelines(line + "\n" for line in lines)


def double_bits(value):
    return f"{np.float64(value).view(np.uint64):016x}"


def float_bits(value):
    assert np.float32(value) == value
    return f"{np.float32(value).view(np.uint32):08x}"


def headline(plan, episode):
    seed = "-" if plan.seed is None else plan.seed
    return f"episode {plan.kind} {seed} {plan.action_seed} {len(episode.actions)}"


def hash_lines(rows, per_line=11):
    """Yields lines with the low 32 bits of each row's hash."""
    words = [f"{value & 0xFFFFFFFF:08x}" for value in map(int, hashes(rows))]
    for i in range(0, len(words), per_line):
        yield " ".join(words[i : i + per_line])


def read_sessions(name):
    """Reads a recording of hashes. Returns each Session with, per plan, the low 32 bits of its
    rows' hashes, shape (steps + 1,)."""
    sessions = []
    lines = (FOLDER / name).read_text(encoding="ascii").splitlines()
    words = (word for line in lines if not line.startswith("#") for word in line.split())
    for word in words:
        if word == "session":
            environment_id = next(words)
            assignments = [next(words).split("=", 1) for _ in range(int(next(words)))]
            parameters = {parameter: json.loads(value) for parameter, value in assignments}
            sessions.append((Session(environment_id, parameters, []), []))
        else:
            kind, seed, action_seed, steps = (next(words) for _ in range(4))
            session, recorded = sessions[-1]
            session.plans.append(Plan(kind, None if seed == "-" else int(seed), int(action_seed)))
            recorded.append(np.array([int(next(words), 16) for _ in range(int(steps) + 1)]))
    return sessions
