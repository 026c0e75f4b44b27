"""Devel and install space: messages, Python files and extension module form one package."""

import ast
import os
import pathlib
import subprocess
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

from elf import search_paths, strange_paths


def printed(python, program):
    done = subprocess.run([python, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_one_python_imports_everything():
    program = "import walker_sim, gymnasium, rospy, walker_sim.msg, walker_sim.srv; print({})"
    made = "gymnasium.make('walker_sim/Walker2d-v5').reset(seed=1)[0].shape"
    assert printed(sys.executable, program.format(made)) == "(17,)"


def test_the_workspaces_engine_is_loaded():
    program = """
from walker_sim import _core
_core.Pool("Walker2d-v5", {})
print({line.split()[-1] for line in open("/proc/self/maps") if "libmujoco" in line})
"""
    (library,) = ast.literal_eval(printed(sys.executable, program))
    assert not library.startswith("/usr/lib")


def test_nothing_loads_libraries_from_the_current_directory():
    space = pathlib.Path(os.environ["CMAKE_PREFIX_PATH"].split(":")[0])
    files = [path for path in space.rglob("*") if path.is_file()]
    assert search_paths(space / "lib" / "walker_sim" / "server") == ["$ORIGIN/.."]
    assert not strange_paths(files)


@pytest.mark.parametrize("python", ["/usr/bin/python3", sys.executable])
def test_the_messages_need_no_numpy_and_no_extension_module(python):
    program = """
import sys
sys.modules["numpy"] = sys.modules["gymnasium"] = sys.modules["walker_sim._core"] = None
import walker_sim.msg, walker_sim.srv
print(walker_sim.msg.Transition._type, walker_sim.srv.Step._type)
"""
    assert printed(python, program) == "walker_sim/Transition walker_sim/Step"
