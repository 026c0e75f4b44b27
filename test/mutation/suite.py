"""The tests of a build directory: which are concerned, in which order, and whether one fails."""

import json
import re
import subprocess
import time
from typing import NamedTuple

import process

LEAST = 30  # time that any test is given [s]
UNKNOWN = 600  # the same before it has passed once [s]
TIMES = 6  # as long as without a break

# They read sources rather than run them, want the machine for themselves, make packages of the tree
# or repeat with more numbers what a shorter one does.
LEFT_OUT = re.compile(
    r"^(lint|install|wheel|examples|scripts|bench|soak|rviz|walks|docs|readme|package_xml|launch)_?"
    r"|symbols|exports|pace_test|ten_walkers|ten_pains|_long|race_test|mutation"
)
# What physics does, seen from Python.
PYTHON_ALONE = (
    r"^python_(bits_(?!ros)|environment_(test|render)|keywords|renderer|saved_states_test|step_some"
    r"|time_limit|vector_environment|bad_input|commands_hash|shipped_policies)"
)
CORE = r"base|episode|robots_(agent|registry)"
# First the room's own units; what lives there, all that calls the room.
UNITS = {
    "base": r"^(base|simd)_",
    "episode": r"^episode_",
    "robots": r"^robots_(agent|registry)_|^episode_",
    "robots/bipedal_walker": r"^robots_bipedal_walker_",
    "robots/hopper": r"^robots_(hopper|mujoco)_",
    "robots/mujoco": r"^robots_(mujoco|hopper|walker2d)_",
    "robots/walker2d": r"^robots_(walker2d|mujoco)_",
    "client": r"^client_(?!service_types)|^wire_",
    "agents": r"^(server|description|replay|ros)_",
    "description": r"^description_",
    "nodes": r"^replay_",
    "replay": r"^replay_",
    "ros": r"^(server|replay|ros)_",
    "server": r"^(server|replay|ros|description)_",
    "wire": r"^wire_|^client_(?!service_types)",
}
CALLERS = {
    "base": rf"^(base|episode|robots|client|wire|server)_|{PYTHON_ALONE}",
    "episode": rf"^(base|episode|robots|client|server)_|{PYTHON_ALONE}",
    "robots": rf"^(base|episode|robots|client|server)_|{PYTHON_ALONE}",
    "robots/bipedal_walker": rf"^({CORE}|robots_bipedal_walker|policy)_|{PYTHON_ALONE}"
    r"|^server_(sensors|episode)",
    "robots/hopper": rf"^robots_mujoco_|{PYTHON_ALONE}",
    "robots/mujoco": rf"^({CORE}|robots_mujoco)_|{PYTHON_ALONE}|^server_walker2d|^server_sensors",
    "robots/walker2d": rf"^({CORE}|robots_mujoco)_|{PYTHON_ALONE}|^server_walker2d",
    "client": r"^(client|wire|agents|server|fuzz)_|^python_.*_ros_|^python_answers",
    "agents": r"^(agents|client)_|^programs",
    "description": r"^(server|description|agents)_|^programs",
    "nodes": r"^(server|agents|replay)_|^programs|^python_commands_ros",
    "replay": r"^server_(replay|records|episode)|^programs|^fuzz",
    "ros": r"^(server|agents|replay)_|^programs",
    "server": r"^(server|agents|client|fuzz)_|^python_.*_ros_|^programs",
    "wire": r"^(wire|client|agents|server|fuzz)_|^python_.*_ros_|^python_answers",
}


PHASES = ("units", "callers")


class Test(NamedTuple):
    name: str
    command: list
    environment: dict
    folder: str
    is_unit: bool


class Failure(NamedTuple):
    test: str
    why: str


def tests_of(build):
    """All of ctest's, by short names."""
    told = subprocess.run(
        ["ctest", "--show-only=json-v1"], cwd=build, check=True, stdout=subprocess.PIPE
    ).stdout
    tests = []
    for each in json.loads(told)["tests"]:
        properties = {entry["name"]: entry["value"] for entry in each["properties"]}
        name = re.sub(r"^_ctest_walker_sim_(gtest|pytest|rostest_test)_|\.test$", "", each["name"])
        if LEFT_OUT.search(name):
            continue
        environment = dict(line.split("=", 1) for line in properties.get("ENVIRONMENT", []))
        folder = properties.get("WORKING_DIRECTORY", str(build))
        is_unit = "unit" in properties["LABELS"]
        tests.append(Test(name, each["command"], environment, folder, is_unit))
    return tests


def concerned(tests, phase, room):
    """Those of a phase. What is a unit of the room has had its turn before its callers."""
    units = [test for test in tests if test.is_unit and re.search(UNITS[room], test.name)]
    if phase == "units":
        return units
    return [test for test in tests if re.search(CALLERS[room], test.name) and test not in units]


def targets(phase, tests):
    """What ninja builds for them."""
    if phase != "units":
        return ["all", "tests"]
    programs = re.findall(r"/(\w+_tests) ", " ".join(" ".join(test.command) for test in tests))
    return sorted(set(programs))


def ranked(tests, path, seconds):
    """Those first whose names have most words of the source's path, then the quickest.

    Parameters
    ----------
    seconds
        Of each test by its name, without a break.
    """
    words = set(re.split(r"[/_.]", path.partition("/")[2].rpartition(".")[0]))

    def rank(test):
        return -len(words & set(test.name.split("_"))), seconds.get(test.name, 0)

    return sorted(tests, key=rank)


def first_words(text):
    """What a test's output says of its failure: the case, where it has a name."""
    for pattern in (
        r"\[  FAILED  \] (\S+\.\S+)",
        r"^FAILED \S+?::(\S+)",
        r"/(\w+)\]\[(?:FAILURE|ERROR)\]",
        r"\[ RUN      \] (\S+)(?![\s\S]*\[ RUN)",
    ):
        match = re.search(pattern, text, re.MULTILINE)
        if match:
            return match[1]
    return ""


class Runner:
    """Runs tests, several at a time.

    Parameters
    ----------
    seconds
        Of each test by its name; those of the tests that pass for the first time are put in.
    """

    def __init__(self, logs, jobs, seconds):
        self._logs, self._jobs, self._seconds = logs, jobs, seconds

    def first_failure(self, tests):
        """The first that fails, and again alone; None if none does."""
        waiting, running = list(tests), []
        try:
            while waiting or running:
                while waiting and len(running) < self._jobs:
                    test = waiting.pop(0)
                    running.append((test, self._start(test)))
                time.sleep(0.02)
                verdicts = [self._verdict(*each) for each in running]
                suspects = [test for (test, _), why in zip(running, verdicts) if why]
                if not suspects:
                    running = [each for each, why in zip(running, verdicts) if why is None]
                    continue
                # Others may have been in its way, and it in theirs.
                waiting[:0] = [test for (test, _), why in zip(running, verdicts) if why is None]
                self._end(running)
                for test in suspects:
                    why = self._alone(test)
                    if why:
                        return Failure(test.name, why)
        finally:
            self._end(running)
        return None

    def _start(self, test):
        log = self._logs / f"{test.name}.log"
        return process.Process(test.command, log, test.environment, test.folder)

    def _alone(self, test):
        running = [(test, self._start(test))]
        try:
            while True:
                why = self._verdict(*running[0])
                if why is not None:
                    return why
                time.sleep(0.02)
        finally:
            self._end(running)

    def _verdict(self, test, started):
        """Why it has failed; no words where it has passed, None while it runs."""
        status = started.status()
        limit = max(LEAST, TIMES * self._seconds.get(test.name, UNKNOWN / TIMES))
        if status is None:
            return None if started.seconds < limit else f"not within {limit:.0f} s"
        if status == 0:
            self._seconds.setdefault(test.name, round(started.seconds, 2))
            return ""
        return first_words(started.text()) or f"status {status}"

    @staticmethod
    def _end(running):
        for _, started in running:
            started.end()
        running.clear()
        process.end_orphans()
