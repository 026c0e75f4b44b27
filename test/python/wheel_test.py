"""The wheel in a clean virtual environment: contents, and episodes in process, over ROS and beside
a workspace. stage.sh runs this; WALKER_SIM_DEVEL is the devel space."""

import contextlib
import importlib.metadata
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys
import sysconfig
import time
import xml.etree.ElementTree as ElementTree

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import _core
from walker_sim.commands import main

TEST = pathlib.Path(__file__).parents[1]
sys.path[:0] = [str(TEST), str(TEST / "bench"), str(TEST / "server")]

import recorded_episodes  # noqa: E402
import try_wheel  # noqa: E402
from elf import search_paths, strange_paths  # noqa: E402
from processes import free_port  # noqa: E402
from walkers import run_python  # noqa: E402

SITE = pathlib.Path(sysconfig.get_path("platlib"))
DEVEL = pathlib.Path(os.environ["WALKER_SIM_DEVEL"])
WORKSPACE = DEVEL / "lib/python3/dist-packages"
DISTRIBUTION = "/usr/lib/python3/dist-packages"
GYMNASIUM = tuple(map(int, gymnasium.__version__.split(".")[:2]))
PATIENCE = 60.0  # timeout that only a failing test reaches [s]
EPISODE = recorded_episodes.read_all()[0]


def test_nothing_loads_libraries_from_the_current_directory():
    files = [path for path in (SITE / "walker_sim").rglob("*") if path.is_file()]
    assert search_paths(_core.__file__) == ["$ORIGIN"]
    assert not strange_paths(files)


def test_the_environment_has_no_ros():
    assert SITE in pathlib.Path(walker_sim.__file__).parents
    assert SITE in pathlib.Path(_core.__file__).parents
    for name in ("rospy", "roslib", "genpy", "catkin_pkg"):
        assert importlib.util.find_spec(name) is None, name


def test_files():
    names = {str(file) for file in importlib.metadata.files("walker_sim")}
    names = {name for name in names if not name.endswith(".pyc")}
    try_wheel.check_files()
    assert {"walker_sim/py.typed", "walker_sim/_core.pyi"} <= names
    source = TEST.parent / "src/python"
    ours = {str(file.relative_to(source)) for file in source.rglob("*.py")}
    assert {name for name in names if name.endswith(".py")} == ours
    assert not [name for name in names if name.endswith((".h", ".cpp", ".txt"))]


def test_policies_and_settings():
    ids, robust = _core.ids(), ("BipedalWalker-v3", "Walker2d-v5", "Hopper-v5")
    share = SITE / "walker_sim/share"
    policies = {*ids, *(f"{env_id}-robust" for env_id in robust)}
    assert {path.stem for path in (share / "assets/policies").iterdir()} == policies
    settings = {path.stem for path in (share / "config/training").iterdir()}
    assert settings == {*policies, "BipedalWalker-v3-quick"}
    kinds = [(env_id, "shipped") for env_id in ids] + [(env_id, "robust") for env_id in robust]
    for env_id, kind in kinds:
        command = ["evaluate", env_id, "--policy", kind, "--seeds", "1000000:1000002"]
        assert main([*command, "max_episode_steps=50"]) == 0


def test_train_names_its_requirements(capsys):
    assert main(["train", "BipedalWalker-v3"]) == 2
    assert "pip install 'walker_sim[train]'" in capsys.readouterr().err


def test_versions_agree():
    version = ElementTree.parse(TEST.parent / "package.xml").findtext("version")
    assert importlib.metadata.version("walker_sim") == version
    assert walker_sim.__version__ == version
    assert _core.__version__ == version


def test_the_wheels_engine_is_loaded():
    """Even if other libraries of that name are on LD_LIBRARY_PATH."""
    program = """
import gymnasium, walker_sim
gymnasium.make("walker_sim/Walker2d-v5").reset(seed=1)
print({line.split()[-1] for line in open("/proc/self/maps") if "mujoco" in line})
"""
    elsewhere = "/usr/lib/x86_64-linux-gnu:/usr/lib/aarch64-linux-gnu"
    assert run(program, LD_LIBRARY_PATH=elsewhere) == str(
        {str(pathlib.Path(_core.__file__).with_name("libmujoco.so.2.2.2"))}
    )


def test_episodes_and_pictures_in_process():
    try_wheel.check_models()
    try_wheel.check_episodes()
    try_wheel.check_pictures("drawn")


def test_a_vector_environment():
    if GYMNASIUM < (1, 1):
        with pytest.raises(ImportError, match=r"needs Gymnasium 1\.1 or later"):
            _ = walker_sim.WalkerVectorEnv
        return
    environments = gymnasium.make_vec(f"walker_sim/{EPISODE.id}", num_envs=3, num_threads=2)
    observations, _ = environments.reset(seed=[EPISODE.seed] * 3)
    assert observations[2].tolist() == EPISODE.steps[0].observation
    action = np.array([EPISODE.steps[1].action] * 3, np.float32)
    observations, rewards, *_ = environments.step(action)
    assert observations[2].tolist() == EPISODE.steps[1].observation
    assert np.float32(rewards[2]) == EPISODE.steps[1].reward
    environments.close()


@contextlib.contextmanager
def walker_server(*arguments):
    """Starts the devel space's master and server in its environment. Yields the master's URI."""
    port = str(free_port())
    launch = 'source "$0" && exec roslaunch --port "$1" walker_sim walker.launch "${@:2}"'
    command = ["setpriv", "--pdeathsig", "INT", "bash", "-c", launch, DEVEL / "setup.bash", port]
    command += ["mode:=lockstep", "headless:=true", "status:=false", *arguments]
    clean = {name: os.environ[name] for name in ("HOME", "PATH", "ROS_HOME") if name in os.environ}
    process = subprocess.Popen(
        command,
        env={**clean, "ROS_HOSTNAME": "localhost"},
        stdin=subprocess.DEVNULL,
    )
    try:
        yield f"http://localhost:{port}"
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()


def test_an_episode_over_ros():
    end = time.monotonic() + PATIENCE
    with walker_server(f"env:={EPISODE.id}") as master:
        while True:
            try:
                played, recorded = try_wheel.play(EPISODE, transport="ros", master_uri=master)
                break
            except walker_sim.ConnectionError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)
    assert played == recorded


def run(program, *folders, **variables):
    path = os.pathsep.join(map(str, folders))
    return run_python(program, PYTHONPATH=path, **variables)[0].strip()


@pytest.mark.parametrize(
    "folders", [(WORKSPACE, SITE), (SITE, WORKSPACE)], ids=["workspace first", "wheel first"]
)
def test_beside_a_workspace(folders):
    """Messages come from the workspace; the extension module matches this Python."""
    program = f"""
import gymnasium, walker_sim
environment = gymnasium.make("walker_sim/BipedalWalker-v3")
environment.reset(seed={EPISODE.seed})
observation, *_ = environment.step({EPISODE.steps[1].action})
assert observation.tolist() == {EPISODE.steps[1].observation}
import walker_sim.msg, walker_sim.srv
assert walker_sim.msg.__file__.startswith("{WORKSPACE}")
print(walker_sim.msg.Transition._type, walker_sim.srv.Step._type)
"""
    if sys.version_info[:2] == distributions_version():
        program += "import rospy\n"
    assert run(program, *folders, DISTRIBUTION) == "walker_sim/Transition walker_sim/Step"


def distributions_version():
    command = ["/usr/bin/python3", "-c", "import sys; print(*sys.version_info[:2])"]
    return tuple(map(int, subprocess.check_output(command, text=True).split()))
