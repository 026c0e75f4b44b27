"""ROS tools find each built program exactly once, and programs search only valid library paths."""

import os
import pathlib
import re
import subprocess

import pytest
from elf import missing_protection, search_paths, strange_paths

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEVEL = pathlib.Path(os.environ["CMAKE_PREFIX_PATH"].split(":")[0])
PROGRAMS = DEVEL / "lib" / "walker_sim"
NODES = sorted(path.stem for path in (ROOT / "src" / "nodes").glob("*.cpp"))
NAMES = [*NODES, "view.py"]


def told(*command):
    return subprocess.run(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False
    ).stdout.splitlines()


def test_there_are_nodes():
    assert {"describe", "replay", "server"} <= set(NODES)


@pytest.mark.parametrize("name", NAMES)
def test_rosrun_finds_it_once(name):
    assert told("rosrun", "--prefix", "echo", "walker_sim", name) == [str(PROGRAMS / name)]


@pytest.mark.parametrize("name", NAMES)
def test_roslaunch_finds_it_once(name):
    code = f"import roslib.packages as r; print(*r.find_node('walker_sim', '{name}'), sep='\\n')"
    assert told("/usr/bin/python3", "-c", code) == [str(PROGRAMS / name)]


@pytest.mark.parametrize("name", NAMES)
def test_catkin_finds_it_once(name):
    assert told("catkin_find", "walker_sim", name) == [str(PROGRAMS / name)]


def test_rospack_finds_the_package_once():
    assert told("rospack", "find", "walker_sim") == [str(ROOT)]
    packages = [line.split() for line in told("rospack", "list")]
    assert [path for name, path in packages if name == "walker_sim"] == [str(ROOT)]


def test_a_program_runs_by_rosrun():
    lines = told("rosrun", "walker_sim", "describe", "Walker2d-v5")
    assert any('<robot name="walker2d">' in line for line in lines)


def test_describe_tells_what_makes_the_steps():
    for options in ([], ["frame_skip=2"]):
        command = ("rosrun", "walker_sim", "describe", "Walker2d-v5", *options, "--engine")
        engine, path = told(*command)
        libm = "libm: (fma|no fma|[0-9a-f]{16})"
        assert re.fullmatch(
            rf"MuJoCo 2\.2\.2 \(.+\), {libm}, stepped by the (kernel|library).*", engine
        )
        assert pathlib.Path(path).is_file()
    engine, _ = told("rosrun", "walker_sim", "describe", "BipedalWalker-v3", "--engine")
    assert re.fullmatch(
        r"Box2D 2\.3\.0 \(.+\), stepped by the library(, in groups by the kernel|: ).*", engine
    )
    engine, _ = told("rosrun", "walker_sim", "describe", "Hopper-v5", "--engine")
    assert engine.endswith(", stepped by the library")


def test_nothing_loads_libraries_from_the_current_directory():
    files = [path for path in DEVEL.rglob("*") if path.is_file()]
    assert search_paths(PROGRAMS / "server") == ["$ORIGIN/.."]
    assert not strange_paths(files)


@pytest.mark.parametrize("name", [*NODES, "libwalker_sim_core.so", "_core"])
def test_what_is_built_is_hardened(name):
    file = PROGRAMS / name
    if name == "libwalker_sim_core.so":
        file = DEVEL / "lib" / name
    elif name == "_core":
        (file,) = DEVEL.glob("lib/python3*/*-packages/walker_sim/_core*.so")
    assert missing_protection(file) == []
