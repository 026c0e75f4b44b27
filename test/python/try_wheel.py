"""Tests the installed wheel with Python and the wheel's requirements alone.

usage: try_wheel.py [--bare] drawn|missing|any

A recorded episode of each environment must have Gymnasium's bits. Pictures must be drawn, or the
error must name the missing library, or either. With --bare, a compiler or ROS is an error. Lines
that begin with = are the results; the status is 0 if all tests have passed.
"""

import hashlib
import importlib.metadata
import importlib.util
import os
import pathlib
import platform
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import time

import gymnasium
import numpy as np
import walker_sim
from walker_sim import _core

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))  # -I omits it
import recorded_episodes

LICENCES = ("LICENSE", "NOTICE", "mujoco/LICENSE", "mujoco/LICENSES_THIRD_PARTY.md")
# The rendering library and the picture's shape of an environment of each engine.
PICTURES = {
    "BipedalWalker-v3": ("libcairo2", (400, 600, 3)),
    "Walker2d-v5": ("libosmesa6", (480, 480, 3)),
}
STARTS = 10


class Failure(Exception):
    """A defect of the wheel."""


def check(is_well, text):
    if not is_well:
        raise Failure(text)


def check_bare():
    for program in ("c++", "cc", "clang", "g++", "gcc", "roscore"):
        check(shutil.which(program) is None, f"{program} is here")
    for module in ("catkin_pkg", "genpy", "rospy"):
        check(importlib.util.find_spec(module) is None, f"{module} is here")
    check(not [name for name in os.environ if name.startswith("ROS")], "ROS is in the environment")


def check_files():
    names = {str(name) for name in importlib.metadata.files("walker_sim")}
    for licence in LICENCES:
        check(
            any(name.endswith(f".dist-info/licenses/{licence}") for name in names),
            f"{licence} is not in the wheel",
        )
    libraries = sorted(name for name in names if ".so" in name)
    check(
        libraries[1:] == ["walker_sim/libmujoco.so.2.2.2"] and "/_core." in libraries[0],
        f"the wheel has the libraries {libraries}",
    )


def check_models():
    """The program that compiles a user's model answers."""
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write("no model")
        file.flush()
        try:
            gymnasium.make("walker_sim/Walker2d-v5", xml_file=file.name)
            text = "it is no error"
        except ValueError as error:
            text = str(error)
    check("XML parse error" in text, f"a file that is no model: {text}")


def play(episode, **options):
    """Replays an episode. Returns the bytes of all numbers, computed and recorded."""
    environment = gymnasium.make(f"walker_sim/{episode.id}", **episode.parameters, **options)
    # The recording of BipedalWalker is in single precision.
    form = "f" if episode.id.startswith("Bipedal") else "d"
    ours, theirs = b"", b""
    for number, step in enumerate(episode.steps):
        if number == 0:
            observation, reward, flags = environment.reset(seed=episode.seed)[0], 0.0, [False] * 2
        else:
            observation, reward, *flags, _ = environment.step(np.array(step.action, np.float32))
        numbers = [*observation.tolist(), reward if number else step.reward, *flags]
        ours += struct.pack(f"<{len(numbers)}{form}", *numbers)
        numbers = [*step.observation, step.reward, step.terminated, step.truncated]
        theirs += struct.pack(f"<{len(numbers)}{form}", *numbers)
    environment.close()
    return ours, theirs


def check_episodes():
    episodes = recorded_episodes.read_all()
    for env_id in _core.ids():
        episode = max((e for e in episodes if e.id == env_id), key=lambda e: len(e.steps))
        ours, theirs = (hashlib.sha256(numbers).hexdigest()[:16] for numbers in play(episode))
        text = f"{env_id}, seed {episode.seed}, {len(episode.steps) - 1} steps: sha256 {ours}"
        check(ours == theirs, f"{text}; must be {theirs}")
        print(f"= {text}, as recorded")


def check_pictures(wish):
    for env_id, (package, shape) in PICTURES.items():
        environment = gymnasium.make(f"walker_sim/{env_id}", render_mode="rgb_array")
        environment.reset(seed=1)
        try:
            picture = environment.render()
        except Exception as error:  # any exception, because its message is checked
            check(wish != "drawn", f"{env_id} is not drawn: {error}")
            check(package in str(error), f"{env_id}: {error}; must name {package}")
            print(f"= {env_id} is not drawn, and says: {error}")
        else:
            check(wish != "missing", f"{env_id} is drawn; by what?")
            form = (picture.shape, picture.dtype)
            check(form == (shape, np.uint8), f"{env_id}: {form}; must be {shape} of uint8")
            colors = len(np.unique(picture.reshape(-1, 3), axis=0))
            check(colors > 5, f"{env_id}: {colors} colours")
            environment.step(np.ones(environment.action_space.shape, np.float32))
            changes = not np.array_equal(environment.render(), picture)
            check(changes, f"{env_id}: the picture is the same after a step")
            print(f"= {env_id} is drawn: {picture.shape}, {colors} colours")
        environment.close()


def start(program):
    """Returns wall and CPU time of Python with this program [s]: the minimum of several runs, as
    other processes may be busy."""
    taken, worked = [], []
    for _ in range(STARTS):
        begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-I", "-c", program], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(time.perf_counter() - begin)
        worked.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return f"{min(taken):.3f} s, the processor {min(worked):.3f} s"


def main():
    arguments = sys.argv[1:]
    if arguments[:1] == ["--bare"]:
        check_bare()
        arguments.pop(0)
    if len(arguments) != 1 or arguments[0] not in ("drawn", "missing", "any"):
        sys.exit(__doc__)
    site = pathlib.Path(walker_sim.__file__).parents[1]
    check(site.name == "site-packages", f"walker_sim is in {site}, not installed")
    check_files()
    print(
        f"= glibc {platform.libc_ver()[1]}, NumPy {np.__version__}, "
        f"Gymnasium {gymnasium.__version__}, walker_sim {walker_sim.__version__}"
    )
    check_models()
    check_episodes()
    check_pictures(arguments[0])
    for program in ("pass", "import gymnasium", "import walker_sim"):
        print(f"= {program}: {start(program)}")


if __name__ == "__main__":
    try:
        main()
    except Failure as failure:
        sys.exit(f"try_wheel: {failure}")
