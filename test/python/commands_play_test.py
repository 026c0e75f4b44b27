"""``play`` on a dummy display: keys, episodes, and ways to stop."""

import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from walker_sim.commands import play
from walker_sim.commands.policies import make_policies
from walker_sim.commands.session import END_SHOWN
from walker_sim.in_process import InProcessWalkers
from walker_sim.rendering import Pictures
from walker_sim.walkers import Walkers
from walker_sim.window import Pace
from walkers import shown

WALKER = "BipedalWalker-v3"
SEEDS = [3, 8]
DT = 1 / 50

pytestmark = pytest.mark.usefixtures("pygame")


@pytest.fixture
def viewer(clock):
    return make_viewer(clock)


def make_viewer(clock, policy="zero", walker=WALKER, kind=InProcessWalkers, **parameters):
    walkers = kind(walker, parameters, 1, 1, "next_step")
    options = SimpleNamespace(policy=policy, normalization=None)
    policies = make_policies(options, walker, {}, walkers.specification)
    pictures = Pictures(walker, parameters, "human", {}, DT)

    def draw():
        return pictures.colors(lambda *given: walkers.render(0, *given))

    screen = play.Screen("a walker", 600, 400)
    return play.Viewer(play.Session(walkers, policies, SEEDS), draw, screen, Pace(DT, clock), clock)


def post(pygame, *names):
    for name in names:
        key = {} if name == "QUIT" else {"key": getattr(pygame, f"K_{name}")}
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN if key else pygame.QUIT, **key))


def press(pygame, viewer, *names):
    post(pygame, *names)
    viewer.handle_events()


def pass_time(viewer, clock, seconds):
    end = clock.time + seconds
    while clock.time < end - 1e-9:
        viewer.advance()
        clock.time += DT / 64


def test_steps_in_real_time(viewer, clock):
    pass_time(viewer, clock, 10 * DT)
    assert viewer.session.episode.length == 10
    assert viewer.status().split("    ")[:3] == ["episode 1", "seed 3", "step 10"]


def test_pause_and_single_steps(pygame, viewer, clock):
    press(pygame, viewer, "SPACE")
    pass_time(viewer, clock, 1)
    assert viewer.session.episode.length == 0
    assert viewer.status().endswith("paused")
    press(pygame, viewer, "PERIOD", "PERIOD")
    pass_time(viewer, clock, 1)
    assert viewer.session.episode.length == 2
    press(pygame, viewer, "SPACE")
    pass_time(viewer, clock, 5 * DT)
    assert viewer.session.episode.length == 7
    press(pygame, viewer, "PERIOD")  # also pauses
    pass_time(viewer, clock, 1)
    assert viewer.session.episode.length == 8


def speed_after(pygame, viewer, *keys):
    """Returns the trunk's velocity along x and z one step after the reset and these keys, in the
    units of the observation."""
    press(pygame, viewer, "SPACE", "r", *keys, "PERIOD")
    observation = viewer.session._observation
    first = 2 if len(observation) == 24 else (len(observation) - 1) // 2
    return np.array(observation[first : first + 2], float)


@pytest.mark.parametrize("walker", ["BipedalWalker-v3", "Walker2d-v5", "Hopper-v5"])
def test_arrows_push_the_trunk(pygame, clock, walker):
    viewer = make_viewer(clock, walker=walker)
    unpushed = speed_after(pygame, viewer)
    right = speed_after(pygame, viewer, "RIGHT") - unpushed
    up = speed_after(pygame, viewer, "UP") - unpushed
    assert right[0] > 0.03
    assert up[1] > 0  # feet on the ground push less
    assert speed_after(pygame, viewer, "LEFT")[0] < unpushed[0] - 0.03
    assert speed_after(pygame, viewer, "DOWN")[1] < unpushed[1]
    twice = speed_after(pygame, viewer, "RIGHT", "RIGHT") - unpushed
    assert twice[0] > 1.5 * right[0]
    ((step, force),) = viewer.session.episode.pushes
    assert (step, force[1]) == (0, 0)
    diagonal = speed_after(pygame, viewer, "RIGHT", "UP") - unpushed
    assert min(diagonal) > 0
    assert np.array_equal(speed_after(pygame, viewer, "LEFT", "RIGHT"), unpushed)
    assert np.array_equal(speed_after(pygame, viewer), unpushed)
    assert len(viewer.session.episode.pushes) == 0


def test_a_push_is_the_worlds_and_acts_for_one_step(pygame, clock):
    viewer = make_viewer(clock)
    press(pygame, viewer, "SPACE", "PERIOD", "LEFT", "PERIOD", "PERIOD")
    walkers = InProcessWalkers(WALKER, {}, 1, 1, "next_step")
    walkers.reset([], [SEEDS[0]])
    for force in (0, -3 / DT, 0):  # push_impulse is 3 N s by default
        walkers.push_trunk(0, force, 0)
        expected = walkers.step(np.zeros((1, 4))).observations[0]
    assert np.array_equal(viewer.session._observation, expected)


def test_a_push_by_hand_is_reported(pygame, clock, capsys):
    viewer = make_viewer(clock, max_episode_steps=2)
    press(pygame, viewer, "RIGHT", "PERIOD", "UP", "PERIOD", "UP")  # the last one after the end
    assert len(viewer.session.episode.pushes) == 2
    assert capsys.readouterr().out.endswith("time limit, pushes by hand: 2\n")


class RemoteWalkers(InProcessWalkers):
    """Has the pool of walkers over ROS: none."""

    pool = Walkers.pool


def test_arrows_are_refused_over_ros(pygame, clock, capsys):
    viewer = make_viewer(clock, kind=RemoteWalkers)
    press(pygame, viewer, "RIGHT", "LEFT", "PERIOD")
    assert viewer.session.episode.length == 1
    assert len(viewer.session.episode.pushes) == 0
    error = capsys.readouterr().err
    assert error.startswith("walker_sim play: pushes by hand: not over ROS; ")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("keys", "speed"),
    [
        (["PLUS"], 2),
        (["EQUALS", "KP_PLUS", "f"], 8),
        (["MINUS"], 0.5),
        (["KP_MINUS", "s", "MINUS"], 0.125),
        (["f"] * 20, 64),
        (["s"] * 20, 1 / 64),
    ],
)
def test_speed(pygame, viewer, clock, keys, speed):
    press(pygame, viewer, *keys)
    assert f"speed {speed:g}x" in viewer.status()
    pass_time(viewer, clock, 16 * DT / speed)
    assert viewer.session.episode.length == pytest.approx(16, abs=1)


def test_repeat_and_next(pygame, viewer, clock):
    first = shown(pygame)
    pass_time(viewer, clock, 10 * DT)
    press(pygame, viewer, "r")
    assert (viewer.session.count, viewer.session.episode.seed, viewer.session.episode.length) == (
        1,
        3,
        0,
    )
    assert np.array_equal(shown(pygame), first)
    for seed, episode in ((8, 2), (3, 3)):
        press(pygame, viewer, "n")
        assert (viewer.session.count, viewer.session.episode.seed) == (episode, seed)


def test_help(pygame, viewer):
    before = shown(pygame)
    press(pygame, viewer, "h")
    assert not np.array_equal(shown(pygame), before)
    press(pygame, viewer, "h")
    assert np.array_equal(shown(pygame), before)


@pytest.mark.parametrize("name", ["q", "ESCAPE", "QUIT"])
def test_quitting(pygame, viewer, name):
    post(pygame, name)
    viewer.run()
    assert viewer.is_over


def test_shows_the_end_before_the_next_episode(capsys, clock):
    viewer = make_viewer(clock, max_episode_steps=5)
    pass_time(viewer, clock, 6 * DT)
    assert viewer.status().endswith("time limit")
    pass_time(viewer, clock, END_SHOWN - 4 * DT)
    assert viewer.session.count == 1
    pass_time(viewer, clock, 4 * DT)
    assert viewer.session.count == 2
    line = capsys.readouterr().out
    assert line.startswith("episode 1, seed 3: return ")
    assert line.endswith(", 5 steps, time limit\n")


def test_paused_at_the_end_of_an_episode(pygame, clock, capsys):
    viewer = make_viewer(clock)
    while not viewer.session.episode.end:
        press(pygame, viewer, "PERIOD")
    assert viewer.session.episode.end == "fell"
    length = viewer.session.episode.length
    press(pygame, viewer, "PERIOD")
    assert viewer.session.episode.length == length
    assert viewer.status().endswith("fell, paused")
    pass_time(viewer, clock, 2 * END_SHOWN)
    assert viewer.session.count == 1
    press(pygame, viewer, "r")
    assert viewer.session.episode.end == ""


def start(*arguments, **variables):
    environment = {name: value for name, value in {**os.environ, **variables}.items() if value}
    return subprocess.Popen(
        [sys.executable, "-u", "-W", "error", "-m", "walker_sim", "play", *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize(
    ("number", "status", "message"),
    [(signal.SIGINT, 130, "interrupted\n"), (signal.SIGTERM, -signal.SIGTERM, "")],
)
def test_plays_until_a_signal(number, status, message):
    process = start(
        *("max_episode_steps=3", "--policy", "random", "--seeds", "7", "--speed", "64"),
        *("width=200", "height=100"),
    )
    assert process.stdout.readline().startswith("episode 1, seed 7: return ")
    process.send_signal(number)
    _, errors = process.communicate()
    assert (process.returncode, errors) == (status, message)


def test_without_a_display():
    process = start(SDL_VIDEODRIVER="", DISPLAY="", WAYLAND_DISPLAY="")
    error = process.communicate()[1]
    assert "walker_sim play: no window can be opened: there is no display" in error
    assert process.returncode == 2
