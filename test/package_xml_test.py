"""package.xml lists exactly the dependencies that CMake finds and exports and the code includes."""

import pathlib
import re
from xml.etree import ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
PACKAGE = ElementTree.parse(ROOT / "package.xml").getroot()
CMAKE = {
    path: re.sub(r"#.*", "", path.read_text(encoding="utf-8"))
    for path in [ROOT / "CMakeLists.txt", *ROOT.glob("*/*.cmake")]
}
TEXT = "\n".join(CMAKE.values())

# CMake or C++ names and their rosdep keys, if different; None is part of the compiler.
KEYS = {
    "GTest": "gtest",
    "gtest": "gtest",
    "Eigen": "eigen",
    "Eigen3": "eigen",
    "pybind11": "pybind11-dev",
    "Threads": None,
    "tinyxml2": "tinyxml2",
    "cairo": "libcairo2-dev",
    "EGL": "opengl",
    "OSMESA": "libosmesa6-dev",
    "Qt5": "qtbase5-dev",
}
# Python modules and their rosdep keys, if different.
MODULES = {module: f"python3-{module}" for module in ("numpy", "rospkg", "yaml")}
IN_OTHER_PACKAGES = {"ros", "rosbag"}


def named(*kinds):
    names = [element.text for kind in kinds for element in PACKAGE.findall(kind)]
    assert len(names) == len(set(names)), f"{kinds}: duplicate: {sorted(names)}"
    return set(names)


def built_with():
    return named("depend", "build_depend", "buildtool_depend")


def arguments(command):
    return [call.split() for call in re.findall(rf"\b{command}\(([^)]*)\)", TEXT)]


def components():
    (words,) = [call for call in arguments("find_package") if call[0] == "catkin"]
    return set(words[words.index("COMPONENTS") + 1 :])


def test_catkins_components_are_build_dependencies():
    assert components()
    assert components() <= built_with()


def test_packages_and_libraries_of_cmake_are_listed():
    names = {call[0] for call in arguments("find_package")} - {"catkin"}
    names |= {call[1] for call in arguments("find_library") if call[1] != "NAMES"} - {"mujoco"}
    assert {"pybind11", "rosbag_storage", "tinyxml2"} <= names
    for name in names:
        key = KEYS.get(name, name)
        assert key is None or key in built_with() | named("test_depend"), name


def test_headers_of_cmake_are_listed():
    names = {call[0].split("_INCLUDE_DIR")[0] for call in arguments("find_path")}
    names = {"cairo" if name == "CAIRO" else name for name in names}
    names = {name for name in names if not name.startswith(("BOX2D", "MUJOCO"))}
    assert names == {"cairo", "EGL", "OSMESA"}
    assert {KEYS[name] for name in names} <= built_with()


def is_ros_package(name):
    shares = pathlib.Path("/usr/share"), pathlib.Path("/opt/ros/noetic/share")
    return any((share / name / "package.xml").exists() for share in shares)


def included(*folders):
    """Returns the packages of included headers: `foo` of <foo/bar.h>."""
    names = set()
    for folder in folders:
        for path in [*(ROOT / folder).rglob("*.h"), *(ROOT / folder).rglob("*.cpp")]:
            text = path.read_text(encoding="utf-8")
            names |= set(re.findall(r"#include [<\"]([a-z0-9_]+)/", text))
    return set(filter(is_ros_package, names)) - IN_OTHER_PACKAGES


def test_included_packages_are_build_dependencies():
    names = included("src", "include")
    assert {"nav_msgs", "sensor_msgs", "xmlrpcpp"} <= names
    assert names <= built_with()
    assert included("test") <= built_with() | named("test_depend")


def imported(*folders):
    """Returns the rosdep keys of the modules that Python files import."""
    names = set()
    for folder in folders:
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            names |= set(re.findall(r"^ *(?:from|import) ([a-z]\w*)", text, re.MULTILINE))
    return {MODULES.get(name, name) for name in names} - {"walker_sim"}


def test_imported_packages_are_listed():
    names = imported("src", "scripts")
    ours = {n for n in names if is_ros_package(n) or n.startswith("python3-")}
    assert {"python3-numpy", "python3-yaml"} <= ours
    assert ours <= named("exec_depend") | named("depend")
    tests = set(filter(is_ros_package, imported("test")))
    assert {"diagnostic_msgs", "rospy"} <= tests
    assert tests <= named("exec_depend") | named("test_depend") | built_with()


def test_listed_ros_packages_are_used():
    ros = {"roscpp", "message_generation", "rosbag_storage", "roslib"}  # otherwise found or spelt
    names = {name for name in built_with() if "_" in name}
    assert names - ros <= included("src", "include")


def test_packages_of_fetch_engines_are_listed():
    text = (ROOT / "scripts" / "fetch_engines").read_text(encoding="utf-8")
    (listed,) = re.findall(r"^PIP_MODULES = \((.*?)\)", text, re.MULTILINE)
    modules = set(re.findall(r"\w+", listed))
    assert {"pip", "setuptools", "wheel"} <= modules
    assert {f"python3-{module}" for module in modules} <= built_with()


def test_exported_packages_match_catkin_package():
    (words,) = arguments("catkin_package")
    exported = set(words[words.index("CATKIN_DEPENDS") + 1 :])
    assert exported == named("depend", "build_export_depend")
    # Packages of the message fields, and the one that message headers include.
    fields = "".join(path.read_text(encoding="utf-8") for path in ROOT.glob("[ms][sr][gv]/*"))
    used = set(re.findall(r"^(\w+)/\w+ ", fields, re.MULTILINE))
    assert exported == used | {"message_runtime"}


def test_urls_have_all_kinds():
    kinds = [element.get("type") for element in PACKAGE.findall("url")]
    assert sorted(kinds) == ["bugtracker", "repository", "website"]
