"""`doctor` in a good set-up, and in bad ones, each of which it names with its remedy."""

import fnmatch
import functools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import threading
import xmlrpc.server
from typing import NamedTuple

import numpy as np
import pytest
import walker_sim
from processes import free_port
from walkers import IDS, ROBOTS

SOURCE = pathlib.Path(__file__).resolve().parents[2] / "src/python/walker_sim"
ELSEWHERE = "192.0.2.1"  # of no machine: reserved for documentation
LOCAL = {"ROS_HOSTNAME": "localhost"}


class Line(NamedTuple):
    level: str
    text: str
    remedy: str


def examine(status=0, patch=None, path=(), **variables):
    """Runs `doctor` in a new process. Returns its lines by subject, and its output.

    `patch` is Python code that runs before it, `path` precedes PYTHONPATH. Of the ROS variables it
    has the given ones only.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    environment.update(variables)
    folders = [*map(str, path), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, folders))
    code = f"{patch}\nfrom walker_sim.commands import main\nraise SystemExit(main(['doctor']))"
    done = subprocess.run(
        [sys.executable, *(["-c", code] if patch else ["-m", "walker_sim"]), "doctor"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stderr) == (status, ""), done.stdout + done.stderr
    lines, subject = {}, ""
    for line in done.stdout.splitlines()[:-1]:
        level, _, rest = line.partition(" ")
        if level:
            subject, text = re.split(r"  +", rest.strip(), maxsplit=1)
            lines[subject] = Line(level, text, "")
        else:
            lines[subject] = lines[subject]._replace(remedy=line.partition("-> ")[2])
    faults = sum(line.level == "FAULT" for line in lines.values())
    assert bool(faults) == status
    last = done.stdout.splitlines()[-1]
    assert last == (f"{faults} fault{'s' * (faults > 1)}" if faults else "nothing is wrong")
    return lines, done.stdout


def expect(level, subject, text, remedy, **keywords):
    """Expects such a line, whose text and remedy match patterns, and no other fault."""
    lines, out = examine(int(level == "FAULT"), **keywords)
    assert lines[subject].level == level, out
    assert fnmatch.fnmatchcase(lines[subject].text, text), out
    assert fnmatch.fnmatchcase(lines[subject].remedy, remedy), out
    assert {name for name, line in lines.items() if line.level == "FAULT"} <= {subject}, out
    return lines


fault, note = functools.partial(expect, "FAULT"), functools.partial(expect, "note")


@pytest.fixture()
def files(tmp_path):
    """A folder with the package's Python files, without an extension module."""
    ignored = shutil.ignore_patterns("*.so", "__pycache__")
    shutil.copytree(SOURCE, tmp_path / "walker_sim", ignore=ignored)
    return tmp_path


def module(folder, name, code):
    """Writes a module. Returns the folder."""
    file = folder / f"{name.replace('.', '/')}.py"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(code)
    return folder


NO_FMA = "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable"


@pytest.mark.parametrize(
    "variables", [{}, {"WALKER_SIM_KERNEL": "off"}, {"GLIBC_TUNABLES": NO_FMA}], ids=str
)
def test_a_good_set_up(variables):
    if "GLIBC_TUNABLES" in variables and os.uname().machine != "x86_64":
        pytest.skip("there is one variant on others")
    lines, _ = examine(**variables)
    for env_id in IDS:
        level, text, _ = lines[env_id]
        assert text.endswith("100 steps have the expected bits")
        if "WALKER_SIM_KERNEL" in variables:
            assert level == "note"
            assert "stepped by the library: WALKER_SIM_KERNEL is off" in text
    assert "libm: no fma" in lines["engine"].text or "GLIBC_TUNABLES" not in variables
    assert lines["walker_sim"].text.startswith(walker_sim.__version__)
    assert lines["numpy"].text.startswith(np.__version__)
    assert lines["ROS"].text.startswith("is not sourced")
    assert re.search(r"compiler (GCC|clang)", lines["extension"].text)
    assert lines["shared memory"].level == "ok"


def test_neither_home_nor_user_is_printed(files):
    home = files.rename(files.parent / "alice")
    lines, out = examine(1, path=[home], HOME=str(home), PYTHONPATH="")
    assert "alice" not in out
    assert "~/walker_sim" in lines["walker_sim"].text


def test_other_hosts_are_not_printed():
    """Their names may be private."""
    variables = {"ROS_HOSTNAME": ELSEWHERE, "ROS_MASTER_URI": f"http://user:word@{ELSEWHERE}:11"}
    _, out = examine(1, **variables)
    assert ELSEWHERE not in out
    assert "word" not in out


# ---------------------------------------------------------------- the package and Python


def test_two_versions_on_the_path(files):
    init = files / "walker_sim/__init__.py"
    init.write_text(init.read_text().replace(f'"{walker_sim.__version__}"', '"0.0.7"'))
    both = f"* 0.0.7 in {files}/walker_sim; {walker_sim.__version__} in {SOURCE}"
    fault("walker_sim", both, "*take it off the path*", path=[files, SOURCE.parent])
    old = f"walker_sim 0.0.7 ({files}/walker_sim/*or take it off the path"
    fault("extension", old, "", path=[files])


def test_no_extension_module_for_this_python_or_system(files):
    text = "*has no extension module for this Python*pip install FOLDER*"
    fault("extension", text, "*", path=[files], PYTHONPATH="")
    message = "libc.so.6: version `GLIBC_2.99' not found"
    module(files, "walker_sim._core", f"raise ImportError({message!r})")
    fault("extension", message, "*compiled for a newer system*", path=[files])


@pytest.mark.parametrize("name", ["argparse", "gymnasium", "numpy", "random", "socket", "uuid"])
def test_a_file_that_hides_a_module(tmp_path, name):
    module(tmp_path, name, "raise RuntimeError('imported')")
    text = f"{tmp_path / name}.py hides the module {name}: imports get this file instead"
    fault(f"{name}.py", text, "Rename it*", path=[tmp_path])


def test_a_folder_on_the_path_that_is_not_readable(tmp_path):
    """Simulated, because root may read all."""
    patch = f"""
import os
def listdir(folder, listdir=os.listdir):
    if folder == {str(tmp_path)!r}:
        raise PermissionError(13, "Permission denied", folder)
    return listdir(folder)
os.listdir = listdir"""
    examine(patch=patch, path=[tmp_path])


def test_modules_of_another_numpy(tmp_path):
    message = "numpy.core.multiarray failed to import"
    failing = f"raise ImportError({message!r})"
    folder = module(tmp_path / "site-packages", "numpy.__init__", failing)
    remedy = "*pip install --upgrade 'numpy>=1.21'*"
    fault("numpy", f"cannot be imported: {message}", remedy, path=[folder])
    folder = module(tmp_path / "dist-packages", "cv_bridge.__init__", "")
    module(folder, "cv_bridge.boost.cv_bridge_boost", failing)
    note("cv_bridge", "*", "*/usr/bin/python3 node.py*", path=[folder])


def test_old_or_missing_gymnasium():
    patch = "import gymnasium; gymnasium.__version__ = '0.26.3'"
    fault("gymnasium", "0.26.3 is too old", "pip install 'gymnasium>=0.29'", patch=patch)
    lines = note("gymnasium", "*", "*", patch="import sys; sys.modules['gymnasium'] = None")
    assert lines["Hopper-v5"].level == "ok"


def test_missing_libraries_of_pictures():
    patch = "from walker_sim.commands import doctor_machine as m; m.can_load = lambda name: False"
    lines, out = examine(patch=patch)
    assert lines["pictures"].level == "note"
    assert "apt-get install libcairo2" in out
    assert "libosmesa6" in out


# ---------------------------------------------------------------- engines and kernels


def test_without_avx():
    text = "MuJoCo's library needs a processor with AVX; this one does not have it."
    patch = f"""
from walker_sim import _core
make = _core.Pool
def refuse(env_id, parameters):
    if "Bipedal" in env_id:
        return make(env_id, parameters)
    raise RuntimeError({text!r})
_core.Pool = refuse
"""
    fault(", ".join(ROBOTS), text, "*-cpu host*", patch=patch)


def test_an_unknown_kernel():
    text, remedy = "WALKER_SIM_KERNEL = avx9: must be one of off, *", "unset WALKER_SIM_KERNEL"
    fault(", ".join(IDS), text, remedy, WALKER_SIM_KERNEL="avx9")


def test_other_bits_and_another_library():
    patch = "from walker_sim.commands import doctor; doctor.BITS['']['BipedalWalker-v3'] = '0'"
    text = f"* have the bits {'[0-9a-f]' * 16}, must be 0"
    fault("BipedalWalker-v3", text, "*report it*", patch=patch)
    if os.uname().machine == "x86_64":  # others are not known
        patch = "from walker_sim.commands import doctor; doctor.LIBRARIES['x86_64'] = '0'"
        fault("engine", "* is not the released library's", "*", patch=patch)


# ---------------------------------------------------------------- ROS


@pytest.mark.parametrize(
    ("variables", "subject", "text"),
    [
        ({"ROS_HOSTNAME": ELSEWHERE}, "ROS_HOSTNAME", "is another machine's*"),
        ({"ROS_HOSTNAME": "a" * 70}, "ROS_HOSTNAME", "does not resolve*"),
        ({"ROS_IP": ELSEWHERE}, "ROS_IP", "is another machine's*"),
        ({"ROS_IP": "localhost"}, "ROS_IP", "is not an IP address*"),
        (
            {**LOCAL, "ROS_MASTER_URI": f"http://{ELSEWHERE}:11311"},
            "ROS_HOSTNAME",
            "is for this machine alone, but the master is on another*",
        ),
        ({"ROS_MASTER_URI": "http://[:1"}, "ROS_MASTER_URI", "is not http://HOST:PORT"),
        # The home is that of a container's user who is in no password file.
        (
            {**LOCAL, "ROS_MASTER_URI": "localhost:11311", "HOME": "/"},
            "ROS_MASTER_URI",
            "is not http://HOST:PORT",
        ),
        ({"ROS_VERSION": "2", "ROS_DISTRO": "jazzy"}, "ROS", "ROS 2 is sourced*"),
    ],
)
def test_wrong_variables(variables, subject, text):
    remedy = "*" if subject == "ROS" else "*localhost*"
    fault(subject, text, remedy, **{"ROS_HOSTNAME": "", **variables})


def test_a_name_that_does_not_resolve():
    patch = """
import socket
def fail(*arguments, **keywords):
    raise socket.gaierror(-2, "Name or service not known")
socket.getaddrinfo = fail
"""
    variables = {"ROS_HOSTNAME": "robot", "ROS_MASTER_URI": "http://robot:11311"}
    lines, _ = examine(1, patch=patch, **variables)
    assert lines["ROS_HOSTNAME"].text.startswith("does not resolve")
    assert lines["ROS_MASTER_URI"].text == "has a host that does not resolve"


def test_a_name_server_that_does_not_answer():
    patch = """
import socket, time
socket.getaddrinfo = lambda *arguments, **keywords: time.sleep(3600)
"""
    lines, _ = examine(1, patch=patch, ROS_HOSTNAME="robot", ROS_MASTER_URI="http://robot:11311")
    assert lines["host name"].text == "no name server answers"
    assert lines["ROS_MASTER_URI"].text == "neither a name server nor a master answers"


def test_masters():
    uri = f"http://localhost:{free_port()}"
    lines = note("master", "*", "*roscore*", **LOCAL, ROS_MASTER_URI=uri)
    assert lines["ROS_HOSTNAME"].level == "ok"
    with xmlrpc.server.SimpleXMLRPCServer(("localhost", 0), logRequests=False) as server:
        server.register_function(lambda caller: [1, "", 7], "getPid")
        uri = f"http://localhost:{server.server_address[1]}"
        text = "what listens at ROS_MASTER_URI does not answer as a ROS master"
        fault("master", text, "*", **LOCAL, ROS_MASTER_URI=uri)  # not yet served
        threading.Thread(target=server.serve_forever).start()
        lines, _ = examine(**LOCAL, ROS_MASTER_URI=uri)
        assert lines["master"] == ("ok", "answers at ROS_MASTER_URI", "")
        server.shutdown()


def test_a_workspace_that_is_not_sourced():
    patch = "import sys, walker_sim; sys.modules['walker_sim.msg'] = sys.modules['rospy'] = None"
    variables = {"ROS_DISTRO": "noetic", **LOCAL, "ROS_PACKAGE_PATH": "/ws/src"}
    lines, _ = examine(1, patch=patch, **variables)
    assert "source devel/setup.bash" in lines["messages"].remedy
    assert (lines["rospy"].level, lines["messages"].level) == ("note", "FAULT")
    if pathlib.Path("/usr/share/std_msgs/msg").is_dir():
        assert "rosnodejs" in lines["ROS_PACKAGE_PATH"].text


# ---------------------------------------------------------------- limits


def test_limits():
    text = "64 open files: a server accepts 32 connections"
    patch = "import resource; resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))"
    fault("limits", text, "ulimit -n 1024", patch=patch)
    patch = """
import os
def fail(name):
    raise OSError(38, "Function not implemented")
os.memfd_create = fail
"""
    note("shared memory", "*Function not implemented*", "*", patch=patch)


def test_an_examination_that_fails_is_a_fault():
    patch = "import platform; platform.libc_ver = lambda: 1 / 0"
    fault("system", "ZeroDivisionError: division by zero", "*", patch=patch)
