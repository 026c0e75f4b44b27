"""Runs the commands of README and docs/ unchanged and compares their output with the pages.

Three dots in the shown output stand for omitted lines or a part of a line. Each test has its own
ROS master and folder.
"""

import contextlib
import inspect
import os
import pathlib
import re
import shlex
import signal
import subprocess
import threading
import time
import types
import xmlrpc.client

import pytest
import rospy.core
from processes import CALLER, TIMEOUT, LoggedProcess, free_port, wait_for

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEVEL = pathlib.Path(os.environ["CMAKE_PREFIX_PATH"].split(":")[0])
PAGES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")))
}
BLOCKS = [
    (page, language, text)
    for page, words in PAGES.items()
    for language, text in re.findall(r"^```(\w*)\n(.*?)^```$", words, re.MULTILINE | re.DOTALL)
]

# Page and some words of each block that a test runs.
README, GUIDE, CLI = "README.md", "docs/ros_guide.md", "docs/cli.md"
AT_FIRST = (README, "/walker_sim/step")
BY_HAND = (GUIDE, "/walker_sim/reset '{has_seed: true, seed: 42}'")
GYMNASIUM = (GUIDE, "./scripts/env python -c '")
USUAL_TOOLS = (GUIDE, "/walker_sim/unpause")
BATCH = (GUIDE, "/walker_sim/step_batch")
SNAPSHOT = (GUIDE, "/walker_sim/snapshot")
REPLAY = (GUIDE, "rosrun walker_sim replay walk.bag")
CAMERA = ("docs/ros_interface.md", "/walker_sim/render")
TYPED = [AT_FIRST, BY_HAND, GYMNASIUM, USUAL_TOOLS, BATCH, SNAPSHOT, REPLAY, CAMERA]
# Blocks that no test runs, and the reason.
NOT_TYPED = {
    (CLI, "evaluate BipedalWalker-v3 --seeds"): "long; test/python/commands_evaluate_test.py",
    (CLI, "evaluate BipedalWalker-v3 --grid gravity"): "test/python/commands_worlds_test.py",
    (CLI, "record --check walk.npz"): "takes long; test/python/commands_record_test.py",
    (CLI, "walker_sim worlds"): "test/python/commands_worlds_test.py",
    ("docs/ros_interface.md", "rostopic pub -1 /push"): "test/server/push_test.py",
    ("docs/ros_interface.md", "/walker_sim/set_state"): "test/server/set_state_test.py",
    ("docs/ros_interface.md", "/walker_sim/set_world"): "test/server/world_services_test.py",
    (GUIDE, "web:=true"): "does not end; test/walks.sh",
    (GUIDE, "rtprio 50"): "needs a permission; test/server/start_test.py",
    (CLI, "walker_sim bench"): "measures; test/python/commands_bench_test.py",
    (CLI, "walker_sim doctor"): "test/python/commands_doctor_test.py",
    (CLI, "play BipedalWalker-v3 --seeds"): "needs a window; test/python/commands_play_test.py",
    (CLI, "--policy shipped --web"): "does not end; test/python/web_test.py",
    ("docs/reliability.md", "hash --steps"): "takes long; test/python/commands_hash_test.py",
    ("docs/adding_an_environment.md", "describe"): "test_rosrun_finds_each_program_once does",
    (GUIDE, "ten_walkers.launch"): "needs the machine for itself; test/server/ten_walkers_test.py",
}
# At exit, Debian 11's rospy calls Thread.isAlive(), which Python 3.9 has removed.
TOOLS_END_BADLY = not hasattr(threading.Thread, "isAlive") and "isAlive()" in inspect.getsource(
    rospy.core
)
# roslaunch searches every folder of the package, which takes long on a busy machine.
STARTUP_TIMEOUT = 120  # [s]
# Removes the variables that setup files set.
SOURCED = "CMAKE_PREFIX_PATH LD_LIBRARY_PATH PKG_CONFIG_PATH PYTHONPATH ROS_PACKAGE_PATH DISPLAY"
SHELL = ["env", *(f"-u{name}" for name in SOURCED.split())]


def block(place, language=""):
    """Returns the only block of this page and language that contains these words."""
    page, words = place
    found = [text for its_page, its, text in BLOCKS if (its_page, its) == (page, language)]
    found = [text for text in found if words in text]
    assert len(found) == 1, f"{len(found)} blocks of {page} have `{words}`; must be 1"
    return found[0]


def inline(command, page):
    assert f"`{command}`" in PAGES[page], f"{page} has no `{command}`"
    return command


def is_whole(command):
    """Returns false if a shell would prompt for a continuation line."""
    with contextlib.suppress(ValueError):
        return bool(shlex.split(command, comments=True))


def commands_of(text):
    commands = []
    for line in text.splitlines():
        if line.startswith("$ "):
            commands.append(types.SimpleNamespace(text=line[2:], shown=[]))
        elif not is_whole(commands[-1].text):
            commands[-1].text += "\n" + line
        else:
            commands[-1].shown.append(line)
    return commands


def without_numbers(line):
    """Replaces numbers, for output that depends on time."""
    return " ".join(re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "N", line).split())


def compare(command, output, reading=str.rstrip):
    """Compares a command's output with the shown output, if any. `reading` normalizes each line."""
    pattern = ""
    for line in command.shown:
        words = re.escape(reading(line)).replace(re.escape("..."), ".*")
        pattern += "(.*\n)*?" if line.strip() == "..." else words + "\n"
    lines = "".join(reading(line) + "\n" for line in output.splitlines())
    if command.shown and not re.fullmatch(pattern, lines):
        pytest.fail("\n".join(["a page shows otherwise:", f"$ {command.text}", *command.shown]))


class Program(LoggedProcess):
    """A command that runs in the background, as in another terminal, until Ctrl-C."""

    def __init__(self, command):
        # --pdeathsig stops the command if the test is killed.
        super().__init__(["setpriv", "--pdeathsig", "INT", "setsid", *command])
        self._text = command[-1]

    def wait_until(self, condition, what):
        wait_for(condition, f"{what}: $ {self._text}", STARTUP_TIMEOUT, self)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            if self.is_running():
                os.killpg(self.pid, signal.SIGINT)
            status = self.wait()
        finally:
            self.kill()
            print(f"$ {self._text}\n{self.output()}")
        allowed = {0, 1} if TOOLS_END_BADLY and " rostopic " in self._text else {0}
        assert status in allowed, f"status {status}: $ {self._text}"


class Terminal:
    """A shell in a folder with only the scripts. Nothing is sourced, and no master runs yet."""

    def __init__(self, folder):
        self.folder = folder
        self.uri = f"http://localhost:{free_port()}"
        variables = [f"ROS_MASTER_URI={self.uri}", "ROS_HOSTNAME=localhost", "PYTHONUNBUFFERED=1"]
        variables += [f"ROS_HOME={folder}/ros_home"]
        self._shell = [*SHELL, f"--chdir={folder}", *variables, "bash", "-c"]
        # Not a symbolic link: the scripts would take this folder for the repository.
        (folder / "scripts").mkdir()
        for name in ("env", "run"):
            script = folder / "scripts" / name
            script.write_text(f'#!/bin/sh\nexec "{ROOT}/scripts/{name}" "$@"\n')
            script.chmod(0o755)

    def type(self, text):
        options = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True}
        done = subprocess.run([*self._shell, text], check=False, timeout=2 * TIMEOUT, **options)
        print(f"$ {text}\n{done.stderr}{done.stdout}")
        assert done.returncode == 0, f"status {done.returncode}: $ {text}"
        return done.stdout

    def type_all(self, commands, reading=str.rstrip):
        for command in commands:
            compare(command, self.type(command.text), reading)

    def start(self, text):
        return Program([*self._shell, text])

    def _has_walker(self):
        master = xmlrpc.client.ServerProxy(self.uri)
        with contextlib.suppress(OSError):
            serves = master.lookupService(CALLER, "/walker_sim/get_spec")[0] == 1
            # The last node to start: roslaunch handles an earlier Ctrl-C differently.
            return serves and master.lookupNode(CALLER, "/status_line")[0] == 1

    @contextlib.contextmanager
    def walker(self, text):
        with self.start(text) as program:
            program.wait_until(self._has_walker, "a walker")
            yield program


@pytest.fixture(scope="module")
def ready():
    if DEVEL != ROOT / "devel":
        pytest.skip("this is not the build of scripts/, which they would make")
    subprocess.check_call([ROOT / "scripts" / "env", "true"])


@pytest.fixture
def terminal(tmp_path, ready):
    return Terminal(tmp_path)


def test_env_is_silent_once_all_is_set_up(ready):
    command = [ROOT / "scripts" / "env", "true"]
    assert subprocess.check_output(command, stderr=subprocess.STDOUT) == b""


def test_every_block_of_commands_is_run_or_has_a_reason():
    for page, _, text in BLOCKS:
        if re.search(r"^\$ ", text, re.MULTILINE):
            known = [words for its, words in (*TYPED, *NOT_TYPED) if its == page and words in text]
            assert len(known) == 1, f"{known} are in this block of {page}; must be 1:\n{text}"
    for place in (*TYPED, *NOT_TYPED):
        block(place)


def test_comparison_of_both_ids(terminal):
    text = block((README, "for name in"), "python")
    shown = block((README, "208 steps"))
    (terminal.folder / "compare.py").write_text(text)
    assert terminal.type(inline("./scripts/env python compare.py", README)) == shown


def test_first_commands(terminal):
    with terminal.walker(inline("./scripts/run agent:=none mode:=lockstep", README)):
        terminal.type_all(commands_of(block(AT_FIRST)))
        container = (ROOT / "Dockerfile").read_text(encoding="utf-8")
        (check,) = re.findall(r"^HEALTHCHECK .* CMD (.*) \|\| exit 1$", container, re.MULTILINE)
        assert "loggers:" in terminal.type(f"./scripts/env {check}")


def test_commands_by_hand(terminal):
    with terminal.walker(inline("./scripts/run agent:=none mode:=lockstep", GUIDE)):
        for place in (BY_HAND, GYMNASIUM):
            terminal.type_all(commands_of(block(place)))
        snapshot, restore = commands_of(block(SNAPSHOT))
        terminal.type(snapshot.text)
        assert "success: True" in terminal.type(restore.text).splitlines()
        (terminal.folder / "episode.py").write_text(block((README, "rospy.init_node"), "python"))
        command = inline("./scripts/env python episode.py", README)
        steps, episode_return = terminal.type(command).split()
        assert int(steps) > 1 and float(episode_return) < 0


def test_usual_tools_and_camera(terminal):
    with terminal.walker(inline("./scripts/run mode:=free", GUIDE)):
        tools = commands_of(block(USUAL_TOOLS))
        index = next(i for i, tool in enumerate(tools) if "rosbag record" in tool.text)
        terminal.type_all(tools[:index], without_numbers)
        bag = terminal.folder / "run.bag.active"
        with terminal.start(tools[index].text) as recorder:
            recorder.wait_until(lambda: bag.exists() and bag.stat().st_size > 100_000, "messages")
        terminal.type_all(tools[index + 1 :], without_numbers)
        rate, picture = commands_of(block(CAMERA))
        with terminal.start(rate.text) as program:
            program.wait_until(lambda: "average rate" in program.output(), "pictures")
        answer = terminal.type(picture.text).splitlines()
        assert {"success: True", "  width: 300"} <= set(answer)


def test_recording_is_replayed(terminal):
    record, replay = commands_of(block(REPLAY))
    with terminal.walker(record.text) as walker:
        walker.wait_until(lambda: "episode 2" in walker.output(), "a second episode")
        time.sleep(5)  # rosbag record lags behind on a busy machine
    output = terminal.type(replay.text).splitlines()
    for line in range(3):  # as far as the first episode
        assert output[line].split() == replay.shown[line].split()
    assert without_numbers(output[-1]) == without_numbers(replay.shown[-1])


def test_many_walkers_on_one_server(terminal):
    server, *calls = commands_of(block(BATCH))
    with terminal.walker(server.text):
        terminal.type_all(calls)


def mentions():
    """Returns the words after `rosrun walker_sim` in all user-visible files."""
    patterns = ("*.md", "config/*", "docs/*.md", "examples/*", "launch/*", "urdf/*")
    patterns += ("scripts/*", "scripts/dev/*")
    files = sorted(path for pattern in patterns for path in ROOT.glob(pattern) if path.is_file())
    words = re.compile(r"rosrun walker_sim\s+(\w[\w.-]*)(?: (\w[\w.-]*))?")
    return sorted({found for path in files for found in words.findall(path.read_text("utf-8"))})


def test_rosrun_finds_each_program_once():
    names = {name for name, _ in mentions()}
    assert {"describe", "replay", "topic_agent"} <= names
    for name in names:
        command = ["rosrun", "--prefix", "echo", "walker_sim", name]
        path = DEVEL / "lib" / "walker_sim" / name
        assert subprocess.check_output(command, text=True) == f"{path}\n"
    for env_id in (argument for name, argument in mentions() if name == "describe"):
        command = ["rosrun", "walker_sim", "describe", env_id]
        assert "<robot name=" in subprocess.check_output(command, text=True)
