"""The page of a server in a headless Chromium: each control acts on the server."""

import os
import re
import subprocess
import sys
import threading
import time

import pytest
import rospy
from browser import wait_for
from processes import LoggedProcess
from walker_sim.srv import GetSpec, Reset, ResetBatch, SetWorld, Snapshot, Step
from walker_sim.web.over_ros import ServerPage, to_message, to_world
from walker_sim.web.server import LOOPBACK
from walker_sim.web.server import serve as serve_page
from walker_sim.worlds import read_world


class Shown:
    """A page of a server that runs in this process."""

    def __init__(self, server):
        self.server = server
        self.web, self.address = serve_page(server, LOOPBACK)
        self.page = ServerPage(self.web, server)
        self._is_over, self._errors = False, []
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        try:
            while not self._is_over:
                self.page.advance()
                time.sleep(0.01)
        except BaseException as error:
            self._errors.append(error)
            raise

    def call(self, name, service, **fields):
        answer = rospy.ServiceProxy(f"{self.server}/{name}", service)(**fields)
        assert getattr(answer, "success", True), answer
        return answer

    def record(self):
        return self.call("snapshot", Snapshot).record

    def world(self):
        return to_world(self.call("get_spec", GetSpec).spec.world.parameters)

    def close(self):
        self._is_over = True
        self._thread.join()
        self.web.stop()
        assert not self._errors


@pytest.fixture(scope="module")
def node(master):
    rospy.init_node("page_test", disable_rostime=True, disable_signals=True)


@pytest.fixture
def show(node, serve, browse):
    """Starts a server, its page and a browser that shows it."""
    shown = []

    def start(env="BipedalWalker-v3", **parameters):
        server, _ = serve(env, **parameters)
        shown.append(Shown(server))
        return shown[-1], browse(shown[-1].address)

    yield start
    for each in shown:
        each.close()


def test_a_paused_server_is_stepped_pushed_and_saved(show, master, tmp_path):
    shown, browser = show(mode="free", paused="true")
    wait_for(lambda: "paused" in browser.text(), "the state")
    browser.fill("Seed", "77")
    browser.click("Begin this seed's episode")
    wait_for(lambda: shown.record().episode.seed == 77, "the seed's episode")
    browser.click("step")
    wait_for(lambda: shown.record().episode.length == 1, "a step")
    wait_for(lambda: "step 1," in browser.text() and "seed 77" in browser.text(), "the step shown")
    browser.evaluate("document.activeElement.blur()")
    browser.key("l", "KeyL")
    wait_for(lambda: browser.key("f", "KeyF") or shown.record().pushes, "a push")
    (push,) = shown.record().pushes
    force = shown.page._push_force
    assert push.link == 0 and [push.force_x, push.force_z] == pytest.approx([force, 0], abs=1e-6)
    browser.evaluate("document.activeElement.blur()")
    time.sleep(1)  # the last key may still be at work
    name, content = shown.page.save()
    file = tmp_path / name
    file.write_bytes(content)
    replayed = subprocess.run(
        [master.programs / "replay", file], stdout=subprocess.PIPE, text=True, check=False
    )
    assert replayed.returncode == 0, replayed.stdout
    browser.click("pause")
    wait_for(lambda: shown.record().episode.length > 20, "steps")


def test_an_unseeded_episode_is_repeated(show):
    shown, browser = show(mode="free", paused="true")
    browser.click("next")
    wait_for(lambda: shown.record().episode.episode == 2, "the next episode")
    before = shown.record().episode
    assert not before.has_seed
    browser.click("step")
    wait_for(lambda: shown.record().episode.length == 1, "a step")
    browser.click("repeat")
    wait_for(lambda: shown.record().episode.episode == 3, "the repetition")
    after = shown.record().episode
    assert after.generator_state == before.generator_state and after.length == 0


def test_worlds_and_speed(show):
    shown, browser = show("Hopper-v5", mode="free", paused="true")
    browser.open("World", "Preset")
    browser.choose("Preset", "moon")
    wait_for(lambda: shown.world() == read_world("moon"), "the preset")
    browser.fill("friction_scale", "0.5")
    wait_for(lambda: shown.world().get("friction_scale") == (0.5, 0.5), "the slider")
    assert shown.world()["gravity"] == (-1.62, -1.62)
    world = {"gravity": (-3, -2)}
    shown.call("set_world", SetWorld, worlds=[to_message(world)])
    wait_for(lambda: "{gravity: [-3.0, -2.0]}" in browser.text(), "the world of another client")
    browser.choose("Preset", "gymnasium")
    wait_for(lambda: not shown.world(), "Gymnasium's world")
    browser.fill("Speed", "4")
    wait_for(lambda: shown.page._monitor.wanted_factor == 4, "the speed")


def test_frames_with_a_prefix_and_the_refusals_of_several_walkers(show):
    shown, browser = show("Hopper-v5", num_envs="2", tf_prefix="far/left")

    def is_seen():
        # Again, because the server sends a later subscriber no frames before its next state.
        shown.call("reset_batch", ResetBatch)
        time.sleep(0.5)
        return shown.page._buffer.trunk is not None

    wait_for(is_seen, "a pose")
    assert shown.page._buffer.prefix == "far/left"

    def is_refused():
        browser.click("next")  # again: the page may have moved it
        time.sleep(1)
        return "walker_sim/reset: " in browser.text() and "reset_batch" in browser.text()

    wait_for(is_refused, "the refusal")


def test_an_error_in_the_page_ends_nothing(show, caplog):
    """viser lets a browser set any attribute of an element."""
    shown, browser = show(mode="free", paused="true")
    shown.page._panel._status._impl.removed = True
    browser.click("step")
    wait_for(lambda: "removed" in caplog.text, "the error")
    browser.click("step")
    wait_for(lambda: shown.record().episode.length == 2, "the next step")


def test_lock_step_shows_what_its_client_does_and_why_it_refuses(show):
    shown, browser = show("Walker2d-v5")
    shown.call("reset", Reset, has_seed=True, seed=5)

    def is_shown():
        length = shown.call("step", Step, action=[0.1] * 6).transition.step
        time.sleep(1)
        return f"step {length}," in browser.text() and "seed 5" in browser.text()

    wait_for(is_shown, "a step")
    wait_for(lambda: is_shown() and shown.page._buffer.trunk is not None, "a pose")
    assert 1 < shown.page._buffer.trunk[2] < 1.5  # the torso's height
    browser.fill("Speed", "4")
    wait_for(lambda: "set_real_time_factor: " in browser.text(), "the refusal")


def test_the_node_shows_a_server_that_hangs_ends_and_starts_again(node, serve, browse, master):
    server, process = serve(mode="free", namespace="/lost")
    words = ["rosrun", "walker_sim", "page", "__ns:=/lost"]
    path = f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}"
    with LoggedProcess(words, {}, **master.environment, PATH=path) as page:
        wait_for(lambda: "token=" in page.output(), "the address", process=page)
        address = re.match(r"page of /lost/walker_sim: (\S+)\n", page.output())[1]
        browser = browse(address)
        wait_for(lambda: "free" in browser.text(), "the state")
        with process.halted():
            wait_for(lambda: f"{server} does not answer" in browser.text(), "the reason")
            browser.click("next")
            refusal = "/lost/walker_sim/reset: no answer within 5 s"
            wait_for(lambda: refusal in browser.text(), "the refusal")
        process.kill()
        wait_for(lambda: f"no server {server}" in browser.text(), "the reason")
        serve(mode="free", namespace="/lost", seed="77", auto_reset="false")
        wait_for(lambda: "episode 1, seed 77" in browser.text(), "the new server")
        assert page.end() == 0


def test_the_node_needs_viser(node, master):
    """The system's Python has none."""
    words = ["/usr/bin/python3", "-m", "walker_sim.web"]
    with LoggedProcess(words, {}, **master.environment) as page:
        assert page.wait() == 1
        words = "page: /usr/bin/python3, the first python3 on PATH, needs ROS and viser, "
        assert page.output().startswith(words)
