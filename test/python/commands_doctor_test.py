"""`doctor` in a good set-up, and in bad ones, each of which it names with its remedy."""

import hashlib
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import threading
import xmlrpc.server
from typing import NamedTuple

import numpy as np
import pytest
import walker_sim
from ros import free_port
from walker_sim import _core
from walker_sim.commands import doctor
from walkers import IDS, ROBOTS, make_reference

SOURCE = pathlib.Path(__file__).resolve().parents[2] / "src/python/walker_sim"
ELSEWHERE = "192.0.2.1"  # of no machine: reserved for documentation
MODULE = ["-m", "walker_sim"]


class Line(NamedTuple):
    level: str
    text: str
    remedy: str


def examine(status=0, patch=None, path=(), limit=None, **variables):
    """Runs `doctor` in a new process. Returns its lines by subject, and its output.

    `patch` is Python code that runs before it, `path` precedes PYTHONPATH, `limit` is a resource
    and its limit. Of the ROS variables it has the given ones only.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    environment.update(variables)
    folders = [*map(str, path), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, folders))
    code = f"{patch}\nfrom walker_sim.commands import main\nraise SystemExit(main(['doctor']))"
    done = subprocess.run(
        [sys.executable, *(["-c", code] if patch else MODULE), "doctor"],
        env=environment,
        preexec_fn=limit and (lambda: resource.setrlimit(limit[0], (limit[1], limit[1]))),
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


def fault(subject, *arguments, **keywords):
    """Returns text and remedy of the only fault."""
    lines, out = examine(1, *arguments, **keywords)
    assert [name for name, line in lines.items() if line.level == "FAULT"] == [subject], out
    return lines[subject].text, lines[subject].remedy


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


# ---------------------------------------------------------------- a good set-up


def test_a_good_set_up():
    lines, _ = examine()
    for env_id in IDS:
        assert lines[env_id].text.endswith("100 steps have the expected bits")
    assert lines["walker_sim"].text.startswith(walker_sim.__version__)
    assert lines["numpy"].text.startswith(np.__version__)
    assert lines["ROS"].text.startswith("is not sourced")
    assert re.search(r"compiler (GCC|clang)", lines["extension"].text)
    assert lines["shared memory"].level == "ok"


def digest_of_gymnasium(env_id):
    environment = make_reference(env_id)
    agent = _core.Agent("heuristic", env_id, {}, doctor.SEED)
    observation, _ = environment.reset(seed=doctor.SEED)
    bits = hashlib.sha256(observation.tobytes())
    action = np.zeros(environment.action_space.shape)
    ends = False, False
    for _ in range(doctor.STEPS):
        if any(ends):
            break
        agent.act(observation.astype(np.float64), action)
        observation, reward, *ends, _ = environment.step(action.astype(np.float32))
        bits.update(observation.tobytes() + np.float64(reward).tobytes() + bytes(ends))
    return bits.hexdigest()


def expected_bits(env_id):
    libm = _core.Pool("Walker2d-v5", {}).specification["engine_version"]
    variant = "no fma" if "libm: no fma" in libm else "fma"
    return doctor.BITS[variant if env_id in ROBOTS else ""][env_id]


@pytest.mark.parametrize("env_id", sorted({*IDS} - {*ROBOTS}))
def test_the_expected_bits_are_gymnasiums(env_id):
    """Gymnasium's other walkers are on a newer MuJoCo; `test_kernels` compares with the library."""
    expected = expected_bits(env_id)
    assert len(expected) == 16
    assert digest_of_gymnasium(env_id).startswith(expected)


@pytest.mark.skipif(os.uname().machine != "x86_64", reason="there is one variant on others")
def test_the_expected_bits_without_fma():
    hidden = "-FMA,-AVX2,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable"
    lines, _ = examine(GLIBC_TUNABLES=f"glibc.cpu.hwcaps={hidden}")
    assert all(lines[env_id].text.endswith("the expected bits") for env_id in IDS)
    assert "libm: no fma" in lines["engine"].text


def test_neither_home_nor_user_is_printed(files):
    home = files.rename(files.parent / "alice")
    lines, out = examine(1, path=[home], HOME=str(home), PYTHONPATH="")
    assert "alice" not in out
    assert "~/walker_sim" in lines["walker_sim"].text


def test_a_home_without_a_name():
    """As that of a container's user who is in no password file."""
    variables = {"ROS_HOSTNAME": "localhost", "ROS_MASTER_URI": "localhost:11311"}
    text, _ = fault("ROS_MASTER_URI", HOME="/", **variables)
    assert text == "is not http://HOST:PORT"


def test_other_hosts_are_not_printed():
    """Their names may be private."""
    variables = {"ROS_HOSTNAME": ELSEWHERE, "ROS_MASTER_URI": f"http://user:word@{ELSEWHERE}:11"}
    _, out = examine(1, **variables)
    assert ELSEWHERE not in out
    assert "word" not in out


def test_an_argument_is_refused(command):
    assert "unrecognized arguments: all" in command("doctor", "all", status=2).err


# ---------------------------------------------------------------- the package and Python


def test_two_versions_on_the_path(files):
    init = files / "walker_sim/__init__.py"
    init.write_text(init.read_text().replace(f'"{walker_sim.__version__}"', '"0.0.7"'))
    text, remedy = fault("walker_sim", path=[files, SOURCE.parent])
    assert f"0.0.7 in {files}/walker_sim; {walker_sim.__version__} in {SOURCE}" in text
    assert "take it off the path" in remedy
    text, remedy = fault("extension", path=[files])
    assert text.startswith(f"walker_sim 0.0.7 ({files}/walker_sim/")
    assert text.endswith("or take it off the path")
    assert remedy == ""


def test_no_extension_module_for_this_python(files):
    text, _ = fault("extension", path=[files], PYTHONPATH="")
    assert "has no extension module for this Python" in text
    assert "pip install FOLDER" in text


def test_an_extension_module_of_a_newer_system(files):
    message = "libc.so.6: version `GLIBC_2.99' not found"
    module(files, "walker_sim._core", f"raise ImportError({message!r})")
    text, remedy = fault("extension", path=[files])
    assert text == message
    assert "compiled for a newer system" in remedy


@pytest.mark.parametrize("name", ["argparse", "gymnasium", "numpy", "random", "socket", "uuid"])
def test_a_file_that_hides_a_module(tmp_path, name):
    module(tmp_path, name, "raise RuntimeError('imported')")
    text, remedy = fault(f"{name}.py", path=[tmp_path])
    assert text == f"{tmp_path / name}.py hides the module {name}: imports get this file instead"
    assert remedy.startswith("Rename it")


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


def test_a_numpy_that_cannot_be_imported(tmp_path):
    message = "numpy.core.multiarray failed to import"
    folder = module(tmp_path / "site-packages", "numpy.__init__", f"raise ImportError({message!r})")
    text, remedy = fault("numpy", path=[folder])
    assert text == f"cannot be imported: {message}"
    assert "pip install --upgrade 'numpy>=1.21'" in remedy


def test_a_module_compiled_for_another_numpy(tmp_path):
    message = "numpy.core.multiarray failed to import"
    folder = module(tmp_path / "dist-packages", "cv_bridge.__init__", "")
    module(folder, "cv_bridge.boost.cv_bridge_boost", f"raise ImportError({message!r})")
    lines, _ = examine(path=[folder])
    assert lines["cv_bridge"].level == "note"
    assert "/usr/bin/python3 node.py" in lines["cv_bridge"].remedy


def test_old_or_missing_gymnasium():
    patch = "import gymnasium; gymnasium.__version__ = '0.26.3'"
    assert fault("gymnasium", patch=patch) == ("0.26.3 is too old", "pip install 'gymnasium>=0.29'")
    lines, _ = examine(patch="import sys; sys.modules['gymnasium'] = None")
    assert lines["gymnasium"].level == "note"
    assert lines["Hopper-v5"].level == "ok"


def test_missing_libraries_of_pictures():
    patch = "from walker_sim.commands import doctor_machine as m; m.can_load = lambda name: False"
    lines, out = examine(patch=patch)
    assert lines["pictures"].level == "note"
    assert "apt-get install libcairo2" in out
    assert "libosmesa6" in out


# ---------------------------------------------------------------- engines and kernels


def test_without_avx():
    patch = """
from walker_sim import _core
make = _core.Pool
def refuse(env_id, parameters):
    if "Bipedal" in env_id:
        return make(env_id, parameters)
    raise RuntimeError("MuJoCo's library needs a processor with AVX; this one does not have it.")
_core.Pool = refuse
"""
    text, remedy = fault(", ".join(ROBOTS), patch=patch)
    assert text.startswith("MuJoCo's library needs a processor with AVX")
    assert "-cpu host" in remedy


def test_kernels():
    lines, _ = examine(WALKER_SIM_KERNEL="off")
    for env_id in IDS:
        assert lines[env_id].level == "note"
        assert "stepped by the library: WALKER_SIM_KERNEL is off" in lines[env_id].text
        assert lines[env_id].text.endswith("the expected bits")
    text, remedy = fault(", ".join(IDS), WALKER_SIM_KERNEL="avx9")
    assert text.startswith("WALKER_SIM_KERNEL = avx9: must be one of off, ")
    assert remedy == "unset WALKER_SIM_KERNEL"


def test_other_bits():
    patch = "from walker_sim.commands import doctor; doctor.BITS['']['BipedalWalker-v3'] = '0'"
    text, remedy = fault("BipedalWalker-v3", patch=patch)
    assert text.endswith(f"{expected_bits('BipedalWalker-v3')}, must be 0")
    assert "report it" in remedy


@pytest.mark.skipif(os.uname().machine != "x86_64", reason="others are not known")
def test_another_library():
    patch = "from walker_sim.commands import doctor; doctor.LIBRARIES['x86_64'] = '0'"
    assert fault("engine", patch=patch)[0].endswith("is not the released library's")


# ---------------------------------------------------------------- ROS


@pytest.mark.parametrize(
    ("variables", "subject", "text"),
    [
        ({"ROS_HOSTNAME": ELSEWHERE}, "ROS_HOSTNAME", "is another machine's"),
        ({"ROS_HOSTNAME": "a" * 70}, "ROS_HOSTNAME", "does not resolve"),
        ({"ROS_IP": ELSEWHERE}, "ROS_IP", "is another machine's"),
        ({"ROS_IP": "localhost"}, "ROS_IP", "is not an IP address"),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_MASTER_URI": f"http://{ELSEWHERE}:11311"},
            "ROS_HOSTNAME",
            "is for this machine alone, but the master is on another",
        ),
        ({"ROS_MASTER_URI": "localhost:11311"}, "ROS_MASTER_URI", "is not http://HOST:PORT"),
        ({"ROS_MASTER_URI": "http://[:1"}, "ROS_MASTER_URI", "is not http://HOST:PORT"),
        ({"ROS_VERSION": "2", "ROS_DISTRO": "jazzy"}, "ROS", "ROS 2 is sourced"),
    ],
)
def test_wrong_variables(variables, subject, text):
    found, remedy = fault(subject, **{"ROS_HOSTNAME": "", **variables})
    assert found.startswith(text)
    assert "localhost" in remedy or subject == "ROS"


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
    lines, _ = examine(ROS_HOSTNAME="localhost", ROS_MASTER_URI=uri)
    assert lines["ROS_HOSTNAME"].level == "ok"
    assert lines["master"].level == "note"
    assert "roscore" in lines["master"].remedy
    with xmlrpc.server.SimpleXMLRPCServer(("localhost", 0), logRequests=False) as server:
        server.register_function(lambda caller: [1, "", 7], "getPid")
        uri = f"http://localhost:{server.server_address[1]}"
        text, _ = fault("master", ROS_HOSTNAME="localhost", ROS_MASTER_URI=uri)  # not yet served
        assert text == "what listens at ROS_MASTER_URI does not answer as a ROS master"
        threading.Thread(target=server.serve_forever).start()
        lines, _ = examine(ROS_HOSTNAME="localhost", ROS_MASTER_URI=uri)
        assert lines["master"] == ("ok", "answers at ROS_MASTER_URI", "")
        server.shutdown()


def test_a_workspace_that_is_not_sourced():
    patch = "import sys, walker_sim; sys.modules['walker_sim.msg'] = sys.modules['rospy'] = None"
    variables = {"ROS_DISTRO": "noetic", "ROS_HOSTNAME": "localhost", "ROS_PACKAGE_PATH": "/ws/src"}
    lines, _ = examine(1, patch=patch, **variables)
    assert "source devel/setup.bash" in lines["messages"].remedy
    assert (lines["rospy"].level, lines["messages"].level) == ("note", "FAULT")
    if pathlib.Path("/usr/share/std_msgs/msg").is_dir():
        assert "rosnodejs" in lines["ROS_PACKAGE_PATH"].text


# ---------------------------------------------------------------- limits


def test_limits():
    text, remedy = fault("limits", limit=(resource.RLIMIT_NOFILE, 64))
    assert text == "64 open files: a server accepts 32 connections"
    assert remedy == "ulimit -n 1024"
    patch = """
import os
def fail(name):
    raise OSError(38, "Function not implemented")
os.memfd_create = fail
"""
    lines, _ = examine(patch=patch)
    assert lines["shared memory"].level == "note"
    assert "Function not implemented" in lines["shared memory"].text


def test_an_examination_that_fails_is_a_fault():
    patch = "import platform; platform.libc_ver = lambda: 1 / 0"
    assert fault("system", patch=patch)[0] == "ZeroDivisionError: division by zero"
