"""ROS tools find each built program exactly once, and programs search only valid library paths."""

import os
import pathlib
import re
import subprocess

import pytest
from elf import missing_protection

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEVEL = pathlib.Path(os.environ["CMAKE_PREFIX_PATH"].split(":")[0])
PROGRAMS = DEVEL / "lib" / "walker_sim"
NODES = sorted(path.stem for path in (ROOT / "src" / "nodes").glob("*.cpp"))
NAMES = [*NODES, "doctor", "page", "view.py"]


def output_of(*command):
    return subprocess.run(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False
    ).stdout.splitlines()


def test_there_are_nodes():
    assert {"describe", "replay", "server"} <= set(NODES)


def test_roslaunch_finds_each_once():
    code = "import sys; from roslib.packages import find_node\n"
    code += "for name in sys.argv[1:]: print(*find_node('walker_sim', name))"
    lines = output_of("/usr/bin/python3", "-c", code, *NAMES)
    assert lines == [str(PROGRAMS / name) for name in NAMES]


@pytest.mark.parametrize("name", ["server", "view.py"])  # readme_test runs rosrun for the others
def test_rosrun_and_catkin_find_it_once(name):
    path = str(PROGRAMS / name)
    assert output_of("rosrun", "--prefix", "echo", "walker_sim", name) == [path]
    assert output_of("catkin_find", "walker_sim", name) == [path]


def test_rospack_finds_the_package_once():
    assert output_of("rospack", "find", "walker_sim") == [str(ROOT)]
    packages = [line.split() for line in output_of("rospack", "list")]
    assert [path for name, path in packages if name == "walker_sim"] == [str(ROOT)]


def test_describe_names_the_engine():
    for walker in (["Walker2d-v5"], ["Walker2d-v5", "frame_skip=2"], ["Hopper-v5"]):
        command = ("rosrun", "walker_sim", "describe", *walker, "--engine")
        engine, path = output_of(*command)
        variants = "libm: (fma|no fma|[0-9a-f]{16}), levels: lines"
        assert re.fullmatch(
            rf"MuJoCo 2\.2\.2 \(.+\), {variants}, stepped by the (kernel|library).*", engine
        )
        assert pathlib.Path(path).is_file()
    engine, _ = output_of("rosrun", "walker_sim", "describe", "BipedalWalker-v3", "--engine")
    assert re.fullmatch(r"Box2D 2\.3\.0 \(.+\), stepped by the (kernel for|library:) .*", engine)


@pytest.mark.parametrize("name", [*NODES, "compile_model", "libwalker_sim_core.so", "_core"])
def test_binaries_are_hardened(name):
    file = PROGRAMS / name
    if name == "libwalker_sim_core.so":
        file = DEVEL / "lib" / name
    elif name == "_core":
        (file,) = DEVEL.glob("lib/python3*/*-packages/walker_sim/_core*.so")
    assert missing_protection(file) == []
