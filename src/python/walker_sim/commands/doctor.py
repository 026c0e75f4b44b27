"""``doctor``: examines the installation and names what is wrong, with the remedy.

Imports only the standard library, so that it can report why the others cannot be imported.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, Callable, Sequence

import walker_sim
from walker_sim import shadowing
from walker_sim.commands import Parser
from walker_sim.commands import doctor_machine as machine
from walker_sim.commands.doctor_machine import FAULT, NOTE, OK, Finding, Findings

SEED, STEPS = 0, 100  # of the trial episodes
# The first digits of the SHA-256 of the trial episodes, by the variant of the C library that the
# engine's bits depend on.
BITS = {
    "": {
        "BipedalWalker-v3": "5847208931a9ecd6",
        "BipedalWalkerHardcore-v3": "07904d0dcb291915",
    },
    "fma": {
        "Walker2d-v4": "90225d0d28fec8eb",
        "Walker2d-v5": "83ecbc33aa6dd80f",
        "Hopper-v4": "66eb1e7441525566",
        "Hopper-v5": "66eb1e7441525566",
    },
    "no fma": {
        "Walker2d-v4": "2603d144b63b6376",
        "Walker2d-v5": "17013cdbbc709723",
        "Hopper-v4": "d4e2c8c9b56b2335",
        "Hopper-v5": "d4e2c8c9b56b2335",
    },
}
# SHA-256 of MuJoCo's released library, by machine.
LIBRARIES = {"x86_64": "63bb16223b4ef9b86485aea53a9c83d61506ed3131dfd4b62c001f24809d4d61"}
REQUIRED = {"numpy": (1, 21), "gymnasium": (0, 29)}  # as in pyproject.toml
PATIENCE = 1.5  # for name servers and the master [s]
AGAIN = "Install walker_sim again: pip install FOLDER, the folder of its sources"

DESCRIPTION = """\
Examines versions, engines and kernels, plays a short episode of each environment whose bits are
known, and checks the ROS variables, the master and the system's limits. Prints one line each: "ok";
"note" if something optional is missing; "FAULT" and the remedy. Prints neither user names, home
folders nor names of other machines, so the output can go into a public report.
"""

EPILOG = """\
Exit status: 0 there is no FAULT, 1 there is one.

examples:
  python3 -m walker_sim doctor
  rosrun walker_sim doctor              # for the Python of the ROS nodes
"""


def examine_path() -> Findings:
    for name, file in shadowing.files.items():
        text = f"{file} hides the module {name}: imports get this file instead"
        remedy = "Rename it, or take its folder off the path (working directory, PYTHONPATH)"
        yield Finding(FAULT, os.path.basename(file), text, remedy)


def examine_package() -> Findings:
    found = {}
    for folder in walker_sim.__path__:
        text = Path(folder, "__init__.py").read_text(encoding="utf-8")
        version = re.search(r'^__version__ = "(.+)"', text, re.MULTILINE)
        if version:  # a workspace's devel space has a relay without one
            found[folder] = version[1]
    if len(set(found.values())) > 1:
        listed = "; ".join(f"{version} in {folder}" for folder, version in found.items())
        remedy = "Update one of them, or take it off the path (PYTHONPATH, setup.bash)"
        yield Finding(FAULT, "walker_sim", f"two versions are on the path: {listed}", remedy)
        return
    yield Finding(OK, "walker_sim", f"{walker_sim.__version__} in {', '.join(walker_sim.__path__)}")
    try:
        from walker_sim import _core
    except ImportError as error:
        text = str(error)
        has_remedy = "pip install" in text or "Install or build" in text
        newer = ". The present one was compiled for a newer system" if "GLIBC" in text else ""
        yield Finding(FAULT, "extension", text, "" if has_remedy else AGAIN + newer)
        return
    file = Path(str(_core.__file__))
    content = file.read_bytes()
    compilers = {*re.findall(rb"GCC: \([^)]*\) [\d.]+|clang version [\d.]+", content)}
    by = ", ".join(sorted(name.decode().replace(":", "") for name in compilers)) or "unknown"
    digest = hashlib.sha256(content).hexdigest()[:16]
    yield Finding(OK, "extension", f"{file.name}, SHA-256 {digest}..., compiler {by}")


def examine_python() -> Findings:
    yield Finding(OK, "Python", f"{platform.python_version()} ({sys.executable})")
    for name, least in REQUIRED.items():
        finding = examine_module(name, least)
        yield finding
        if finding.level == FAULT:
            return  # the next one may need this one
    if importlib.util.find_spec("cv_bridge"):
        command = (sys.executable, "-c", "import cv_bridge.boost.cv_bridge_boost")
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True, timeout=5, check=False)
        if "numpy" in done.stderr:
            text = "is compiled for another NumPy: CvBridge() raises an ImportError"
            remedy = "Run such a node with the distribution's Python: /usr/bin/python3 node.py"
            yield Finding(NOTE, "cv_bridge", text, remedy)


def examine_module(name: str, least: tuple[int, int]) -> Finding:
    needed = f"'{name}>={'.'.join(map(str, least))}'"
    try:
        version: str = importlib.import_module(name).__version__
    except Exception as error:  # a broken one may raise anything
        if isinstance(error, ModuleNotFoundError) and error.name == name == "gymnasium":
            text = "is not installed: ROS nodes need none, walkers in Python do"
            return Finding(NOTE, name, text, f"pip install {needed}")
        text = f"cannot be imported: {(str(error).strip() or repr(error)).splitlines()[-1]}"
        return Finding(FAULT, name, text, f"{sys.executable} -m pip install --upgrade {needed}")
    if tuple(map(int, version.split(".")[:2])) < least:
        return Finding(FAULT, name, f"{version} is too old", f"pip install {needed}")
    if name == "numpy" and version.startswith("1."):
        text = "under NumPy 1 the rewards of Gymnasium's own walkers differ in their last digits"
        return Finding(NOTE, name, f"{version}; {text}")
    return Finding(OK, name, version)


def examine_walkers() -> Findings:
    """Plays the trial episodes."""
    try:
        importlib.import_module("numpy")
        from walker_sim import _core
    except Exception:
        return  # reported by the others
    allowed = os.environ.get("WALKER_SIM_KERNEL", "")
    reason = (
        "is not set: the widest that gives the engine's bits" if not allowed else f"= {allowed}"
    )
    yield Finding(OK, "kernels", f"WALKER_SIM_KERNEL {reason}")
    failures: dict[str, list[str]] = {}
    engines: dict[str, Any] = {}
    for env_id in _core.ids():
        try:
            specification, digest = play(env_id)
        except Exception as error:
            failures.setdefault(str(error), []).append(env_id)
            continue
        release, _, kernel = specification["engine_version"].partition(", stepped by the ")
        engines[f"{specification['engine']} {release}"] = specification["engine_path"]
        libm = release.partition(", libm: ")[2].partition(", ")[0]
        text = f"stepped by the {kernel}; {STEPS} steps have "
        expected = BITS.get(libm, {}).get(env_id)
        if expected is None:
            yield Finding(NOTE, env_id, f"{text}unknown bits {digest}: the C library is unknown")
        elif digest != expected:
            remedy = f"{AGAIN}. If that does not help, please report it with this output"
            yield Finding(FAULT, env_id, f"{text}the bits {digest}, must be {expected}", remedy)
        else:
            level = OK if kernel.startswith("kernel") else NOTE  # slower, with the same bits
            yield Finding(level, env_id, f"{text}the expected bits")
    for error_text, ids in failures.items():
        remedy = AGAIN
        if "AVX" in error_text:
            remedy = "Use a processor with AVX; QEMU's -cpu host passes the machine's to a guest"
        elif "WALKER_SIM_KERNEL" in error_text:
            remedy = "unset WALKER_SIM_KERNEL"
        yield Finding(FAULT, ", ".join(ids), error_text, remedy)
    for engine, file in engines.items():
        yield from examine_engine(engine, file)


def examine_engine(engine: str, file: str) -> Findings:
    if not engine.startswith("MuJoCo"):
        yield Finding(OK, "engine", f"{engine}, in the extension")
        return
    digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    expected = LIBRARIES.get(platform.machine())
    text = f"{engine}, {os.path.normpath(file)}, SHA-256 {digest[:16]}..."
    if expected in (digest, None):
        yield Finding(OK, "engine", text)
    else:
        yield Finding(FAULT, "engine", f"{text} is not the released library's", AGAIN)


def play(env_id: str) -> tuple[dict[str, Any], str]:
    """Plays the first steps of a seed's episode by the heuristic. Returns the specification and
    the first digits of the SHA-256 of all bits."""
    import numpy as np

    from walker_sim import _core

    walker = _core.Pool(env_id, {})
    agent = _core.Agent("heuristic", env_id, {}, SEED)
    specification = walker.specification
    dtype = specification["observation_dtype"]
    observation = np.zeros(len(specification["observation_low"]), dtype)
    info = np.zeros(len(specification["info_names"]))
    action = np.zeros(len(specification["action_low"]))
    start: Any = np.random.PCG64(SEED).state["state"]
    generator = *divmod(start["state"], 1 << 64), *divmod(start["inc"], 1 << 64), 0, 0
    _, error = walker.reset_single(generator, observation, info)
    if error:
        raise RuntimeError(error)
    bits = hashlib.sha256(observation.tobytes())
    for _ in range(STEPS):
        agent.act(observation.astype(np.float64), action)
        reward, *ends, error = walker.step_single(action, observation, info)
        if error:
            raise RuntimeError(error)
        bits.update(observation.tobytes() + np.float64(reward).tobytes() + bytes(ends))
        if any(ends):
            break
    return specification, bits.hexdigest()[:16]


def without_names(text: str) -> str:
    """Replaces home folders, and the user's name in paths."""
    home = os.path.expanduser("~")
    for folder in {home, os.path.realpath(home)} - {"/"}:
        text = re.sub(re.escape(folder) + r"(?![\w.-])", "~", text)
    text = re.sub(r"/home/[^/\s]+", "/home/USER", text)
    user = Path(home).name  # empty: the home is /, as that of a container's user without a name
    return re.sub(rf"/{re.escape(user)}(?![\w.-])", "/USER", text) if user else text


def all_of(examine: Callable[[], Findings]) -> list[Finding]:
    """Returns the findings. A failure of an examination is one of them."""
    findings = []
    try:
        for finding in examine():
            findings.append(finding)
    except Exception as error:
        subject = examine.__name__.partition("_")[2]
        findings.append(Finding(FAULT, subject, f"{type(error).__name__}: {error}"))
    return findings


class Background:
    """Runs an examination in a thread, because a name server may not answer for long."""

    def __init__(self, examine: Callable[[], Findings]) -> None:
        self._findings = [Finding(FAULT, *machine.SLOW[examine])]
        self._thread = threading.Thread(target=self._run, args=(examine,), daemon=True)
        self._end = time.monotonic() + PATIENCE
        self._thread.start()

    def findings(self) -> list[Finding]:
        self._thread.join(max(0.0, self._end - time.monotonic()))
        return self._findings

    def _run(self, examine: Callable[[], Findings]) -> None:
        self._findings = all_of(examine)


def run(arguments: Sequence[str]) -> int:
    """Prints the findings. Returns the exit status."""
    Parser("doctor", DESCRIPTION, EPILOG).parse_args(arguments)
    slow = [Background(examine) for examine in machine.SLOW]
    quick = (examine_path, examine_package, examine_python, examine_walkers, *machine.QUICK)
    findings = [finding for examine in quick for finding in all_of(examine)]
    findings += [finding for one in slow for finding in one.findings()]
    width = max(len(finding.subject) for finding in findings)
    for level, subject, text, remedy in findings:
        print(without_names(f"{level:<6} {subject:<{width}}  {text}"))
        if remedy:
            print(without_names(f"{'':<6} {'':<{width}}  -> {remedy}"))
    count = sum(finding.level == FAULT for finding in findings)
    print(f"{count} fault{'s' * (count > 1)}" if count else "nothing is wrong")
    return int(count > 0)
