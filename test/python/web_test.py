"""The page of `play --web` in a headless Chromium: each control acts on the environment."""

import asyncio
import pathlib
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from browser import SIZE, wait_for
from PIL import Image
from walker_sim.commands.policies import make_policies, shipped_policy
from walker_sim.commands.session import Session
from walker_sim.in_process import InProcessWalkers
from walker_sim.web.in_process import Page
from walker_sim.web.server import LOOPBACK, serve
from walker_sim.window import Pace
from walker_sim.worlds import read_world

RECORDED = pathlib.Path(__file__).resolve().parents[1] / "recordings" / "page.png"
SEEDS = [3, 8]
HULL = SIZE[0] * 0.32, SIZE[1] * 0.4  # about where the page shows the trunk [pixels]


class Shown:
    """A page that runs, and its address."""

    def __init__(self, env_id, policy, **parameters):
        walkers = InProcessWalkers(env_id, parameters, 1, 1, "next_step")
        options = SimpleNamespace(policy=policy, normalization=None, transport="inprocess")
        policies = make_policies(options, env_id, parameters, walkers.specification)
        self.session = Session(walkers, policies, SEEDS)
        self.server, self.address = serve("a walker", LOOPBACK)
        self.page = Page(
            self.server, self.session, options, parameters, Pace(walkers.specification["dt"])
        )
        self.page.is_paused = True  # a browser without a GPU takes long to show the first picture
        self._is_over = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._is_over:
            self.page.advance()
            time.sleep(0.002)

    def do(self, function):
        """Calls a function in the page's thread."""
        done = threading.Event()
        self.page._panel._waiting.put((lambda: (function(), done.set()), None))
        assert done.wait(60)

    def close(self):
        self._is_over = True
        self._thread.join()
        self.server.stop()


@pytest.fixture
def show():
    shown = []

    def start(env_id="BipedalWalker-v3", policy="shipped", **parameters):
        shown.append(Shown(env_id, policy, **parameters))
        return shown[-1]

    yield start
    for each in shown:
        each.close()


def test_buttons_and_keys(show, browse):
    shown = show()
    browser = browse(shown.address)
    session = shown.session
    browser.click("pause")
    wait_for(lambda: not shown.page.is_paused and session.episode.length > 20, "steps")
    browser.click("pause")
    wait_for(lambda: shown.page.is_paused, "pause")
    length = session.episode.length
    browser.click("step")
    wait_for(lambda: session.episode.length == length + 1, "step")
    seed = session.episode.seed
    browser.click("repeat")
    wait_for(lambda: session.episode.length == 0 and session.episode.seed == seed, "repetition")
    browser.click("next")
    wait_for(lambda: session.episode.seed != seed, "next episode")
    browser.evaluate("document.activeElement.blur()")
    browser.key("f", "KeyF")
    wait_for(lambda: session.episode.length == 1, "step by key")
    browser.key("l", "KeyL")
    browser.key("f", "KeyF")
    wait_for(lambda: session.episode.length == 2, "step by key")
    ((step, force),) = session.episode.pushes
    assert step == 1 and force[0] > 0 and force[1] == 0


def test_seed_speed_policy_and_world(show, browse):
    shown = show(policy="zero")
    browser = browse(shown.address)
    session = shown.session

    def submit(label, text, button, condition):
        """The page sends a field's text some time after it was typed."""
        browser.fill(label, text)

        def click():
            browser.click(button)
            time.sleep(0.5)
            return condition()

        wait_for(click, f"effect of {text}")

    begin, set_world = "Begin this seed's episode", "Set the text's world"
    submit("Seed", "77", begin, lambda: session.episode.seed == 77)
    refusal = "seed = '-1': must be a whole number"
    submit("Seed", "-1", begin, lambda: refusal in browser.text())
    browser.open("World", "Preset")
    world = {"gravity": (-5, -5), "push_interval": (1, 3)}
    text = "{gravity: -5, push_interval: [1, 3]}"
    submit("Text", text, set_world, lambda: session.walkers.worlds()[0] == world)
    refusal = "gravity = 5.0: must be in [-30.0, 0.0]"
    submit("Text", "{gravity: 5}", set_world, lambda: refusal in browser.text())
    assert session.walkers.worlds()[0] == world
    browser.click("next")
    wait_for(lambda: session.episode.world.get("gravity") == -5, "the world's episode")
    browser.fill("friction_scale", "0.5")
    wait_for(lambda: session.walkers.worlds()[0].get("friction_scale") == (0.5, 0.5), "the slider")
    assert session.walkers.worlds()[0]["gravity"] == (-5, -5)
    browser.choose("Preset", "moon")
    wait_for(lambda: session.walkers.worlds()[0] == read_world("moon"), "the preset")
    wait_for(lambda: "{gravity: -1.62}" in browser.text(), "the preset's text")
    browser.fill("Speed", "4")
    wait_for(lambda: shown.page.pace.speed == 4, "the speed")
    browser.fill("Speed", "65")
    refusal = "speed = 65: must be between 0.015625 and 64"
    wait_for(lambda: refusal in browser.text(), "the refusal")
    assert shown.page.pace.speed == 4
    browser.choose("Policy", "shipped")

    def walks():
        browser.click("next")
        browser.click("step")
        time.sleep(0.5)
        return np.any(session.episode.steps.actions)  # the policy before is zero

    wait_for(walks, "the policy's action")


def test_a_dragged_trunk_is_pushed_and_the_saved_file_repeats(show, browse, command, tmp_path):
    shown = show()
    browser = browse(shown.address)
    session = shown.session
    wait_for(lambda: colors(browser.screenshot()) > 100, "a picture")
    target = HULL[0] - 60, HULL[1]
    browser.drag(HULL, target)
    shown.page.is_paused = False
    wait_for(lambda: len(session.episode.pushes) > 5, "pushes")
    shown.page.is_paused = True
    browser.release(*target)
    (_, force) = session.episode.pushes[-1]
    assert force[0] < 0
    file = tmp_path / "saved.npz"
    time.sleep(0.1)  # a step may still be running
    file.write_bytes(shown.page.save()[1])
    assert "1 of 1 episodes equal to the bit" in command("record", "--check", file).out
    arrays = dict(np.load(file))
    arrays["push_forces"] = np.zeros_like(arrays["push_forces"])
    np.savez(file, **arrays)
    assert "differs at step" in command("record", "--check", file, status=1).out


def colors(picture):
    """Returns the number of different colours."""
    return len(np.unique(picture.reshape(-1, 3), axis=0))


def test_two_browsers_a_reload_and_a_server_that_ends(show, browse):
    shown = show("Walker2d-v5", policy="zero")
    browsers = [browse(shown.address) for _ in range(2)]
    browsers[0].click("step")
    wait_for(lambda: all("step 1," in each.text() for each in browsers), "the step in each")
    browsers[0].call("Page.reload")
    wait_for(lambda: "step 1," in browsers[0].text(), "the page after the reload")
    browsers[1].close()
    browsers[0].click("step")
    wait_for(lambda: shown.session.episode.length == 2, "a step after the other browser closed")
    shown.close()
    is_loading = "!!document.querySelector('.mantine-Loader-root')"
    wait_for(lambda: browsers[0].evaluate(is_loading), "the lost connection")


class Client:
    """A browser as the page's callbacks see it."""

    def __init__(self):
        self.notes = []

    def add_notification(self, title, body, color):
        self.notes.append(body)

    def send(self, callbacks, value):
        event = SimpleNamespace(client=self, target=SimpleNamespace(value=value))
        for callback in callbacks:
            asyncio.run(callback(event))
        return wait_for(lambda: self.notes and self.notes.pop(), "the refusal")


def test_a_browser_cannot_name_modules_files_or_other_values(show, tmp_path):
    """viser passes on what a browser sends for a list, also what is not on it."""
    shown = show()
    panel, client = shown.page._panel, Client()
    secret = tmp_path / "secret"
    secret.write_text("a word")
    for value in ("os:system", str(secret), f"{secret}.zip"):
        answer = client.send(panel._policy._impl.update_cb, value)
        assert answer.endswith("must be one of shipped, robust, heuristic, random, zero")
    answer = client.send(panel._preset._impl.update_cb, str(secret))
    assert "must be one of gymnasium, " in answer and "a word" not in answer
    for value in (0, "nan", float("inf")):
        assert "must be between 0.015625" in client.send(panel._speed._impl.update_cb, value)
    assert "could not convert" in client.send(panel._speed._impl.update_cb, "1/2")
    assert (shown.page.policy, panel._policy.value) == ("shipped", "shipped")
    assert shown.session.walkers.worlds() == ({},)


def test_a_refused_slider_shows_what_acts(show):
    shown = show()
    panel, client = shown.page._panel, Client()
    slider, default = panel._sliders["gravity"]
    slider._impl.value = float("nan")
    assert "gravity = .nan: must be" in client.send(slider._impl.update_cb, float("nan"))
    wait_for(lambda: slider.value == default, "the slider's former value")


def test_errors_pause_the_page(show):
    shown = show("Hopper-v5", policy="zero")
    page, client = shown.page, Client()
    shown.server.get_clients = lambda: {0: client}
    content = shipped_policy("Hopper-v5").read_bytes()
    begin = 8 + int.from_bytes(content[:8], "little")
    weights = np.frombuffer(content[begin:], np.float32).copy()
    weights[len(weights) // 4 :] = 3e38
    weights[len(weights) // 2 :] = -3e38  # sums become infinite, and their sums not numbers
    with pytest.raises(ValueError, match="made for Walker2d-v5: it takes 17"):
        page.load_policy("other.safetensors", shipped_policy("Walker2d-v5").read_bytes())
    shown.do(lambda: page.load_policy("large.safetensors", content[:begin] + weights.tobytes()))
    shown.do(page.begin_next)
    page.is_paused = False
    wait_for(lambda: client.notes, "the error")
    assert "action" in client.notes[0] and "must be finite" in client.notes[0]
    assert page.is_paused
    shown.do(lambda: page.set_policy("zero"))
    shown.do(page.begin_next)
    page.is_paused = False
    wait_for(lambda: shown.session.episode.length > 3, "steps with another policy")


def test_a_large_drag_is_bounded_and_a_senseless_one_ignored(show):
    shown = show()
    page = shown.page
    for end, expected in ((1e9, 20.0), (float("nan"), 0.0)):
        event = SimpleNamespace(end_position=(end, 0, 0), start_position=(0, 0, 0), phase="update")
        asyncio.run(page._drag.take(event))
        assert page._drag.offset.tolist() == [expected, 0.0]


def test_the_view_is_the_recorded_one(show, browse):
    """Recorded with Chromium 156 of Debian 12. One step later, 2.2 % of the pixels differ."""
    shown = show("BipedalWalkerHardcore-v3")
    browser = browse(shown.address)
    for _ in range(60):
        shown.do(shown.page.step_once)
    recorded = np.asarray(Image.open(RECORDED), np.int16)
    top, right = 160, 940  # below viser's note about software WebGL, left of the panel

    def share():
        """Returns the share of pixels that differ."""
        picture = browser.screenshot()[top:, :right].astype(np.int16)
        differs = np.abs(picture - recorded).max(axis=2) > 40
        return np.count_nonzero(differs) / differs.size

    wait_for(lambda: share() < 0.01, "the recorded view")
