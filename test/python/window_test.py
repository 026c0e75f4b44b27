"""The window and its frame rate, on SDL's dummy display."""

import copy

import numpy as np
import pytest
from walker_sim import WalkerEnv
from walker_sim.window import (
    MAX_LAG,
    MAX_PICTURE_INTERVAL,
    MIN_PICTURE_INTERVAL,
    Pace,
    Screen,
    Window,
)
from walkers import follow, make_ours, random_actions, run_python, shown, through_pickle

DT = 1 / 50


pytestmark = pytest.mark.usefixtures("pygame")


def play(pace, clock, num_steps, step_time=0.0, picture_time=0.0):
    """Simulates steps of the given duration. Returns the number of pictures shown."""
    num_pictures = 0
    for _ in range(num_steps):
        clock.time += step_time
        is_due = pace.is_picture_due()
        clock.time += pace.time_left()
        if is_due:
            clock.time += picture_time
            num_pictures += 1
    return num_pictures


@pytest.mark.parametrize("speed", [1.0, 0.25])
def test_steps_run_in_real_time_and_each_is_shown(speed, clock):
    pace = Pace(DT, clock)
    pace.speed = speed
    assert play(pace, clock, 100, step_time=0.001, picture_time=0.002) == 100
    assert clock.time == pytest.approx(100 + 100 * DT / speed + 0.002)


def test_pictures_are_limited_to_the_refresh_rate(clock):
    pace = Pace(0.001, clock)
    num_pictures = play(pace, clock, 1000)
    assert clock.time == pytest.approx(101)
    assert num_pictures == pytest.approx(1 / MIN_PICTURE_INTERVAL, abs=3)


@pytest.mark.parametrize("picture_time", [0.04, 0.14])
def test_slow_pictures_are_dropped(picture_time, clock):
    pace = Pace(0.008, clock)
    num_pictures = play(pace, clock, 1000, step_time=0.0001, picture_time=picture_time)
    assert clock.time == pytest.approx(108, abs=1.1 * picture_time)
    assert 0.8 * 8 / picture_time < num_pictures < 8 / picture_time


def test_slow_steps_are_shown(clock):
    pace = Pace(DT, clock)
    num_pictures = play(pace, clock, 100, step_time=0.04)
    assert 0.5 * 4 / MAX_PICTURE_INTERVAL < num_pictures <= 4 / MAX_PICTURE_INTERVAL


def test_a_long_lag_is_dropped(clock):
    pace = Pace(DT, clock)
    play(pace, clock, 1)
    clock.time += 60  # no step for a minute
    begun = clock.time
    play(pace, clock, 100)
    assert clock.time == pytest.approx(begun + 100 * DT - MAX_LAG, abs=DT)


def picture(value):
    return np.full((40, 60, 3), value, np.uint8)


def test_a_window_opens_shows_and_closes(pygame):
    window = Window("a walker", DT)
    assert pygame.display.get_surface() is None
    for value in (50, 200):
        window.show(picture(value))
        assert np.array_equal(shown(pygame), picture(value))
    assert pygame.display.get_caption()[0] == "a walker"
    window.close()
    assert pygame.display.get_surface() is None
    window.close()


def test_a_screen_has_a_picture_a_line_and_help(pygame):
    screen = Screen("a walker", 60, 40)
    screen.show(picture(50), "", ())
    without_line = shown(pygame)
    screen.show(picture(50), "step 1", ())
    assert np.array_equal(shown(pygame)[:40], picture(50))
    assert not np.array_equal(shown(pygame)[40:], without_line[40:])
    screen.show(picture(50), "step 1", ("H   help",))
    assert not np.array_equal(shown(pygame)[:40], picture(50))
    screen.close()
    assert pygame.display.get_surface() is None


def test_two_windows_share_the_display(pygame):
    first, second = Window("first", DT), Window("second", DT)
    first.show(picture(1))
    second.show(np.full((20, 30, 3), 2, np.uint8))
    first.show(picture(3))
    assert np.array_equal(shown(pygame), picture(3))
    second.close()
    first.show(picture(4))
    assert np.array_equal(shown(pygame), picture(4))


def test_a_window_shows_what_render_returns(pygame):
    environment, drawn = (
        make_ours("BipedalWalker-v3", render_mode=mode) for mode in ("human", "rgb_array")
    )
    for one in (environment, drawn):
        one.reset(seed=3)
    assert np.array_equal(shown(pygame), drawn.render())
    action = random_actions("BipedalWalker-v3", 1)[0]
    for one in (environment, drawn):
        one.step(action)
    assert environment.render() is None  # shows the frame if step() was not due to
    assert np.array_equal(shown(pygame), drawn.render())
    environment.close()
    assert pygame.display.get_surface() is None


@pytest.mark.parametrize("name", ["QUIT", "K_ESCAPE"])
def test_a_closed_window_does_not_end_the_episode(pygame, name):
    environment = make_ours("BipedalWalker-v3", render_mode="human")
    environment.reset(seed=3)
    event = pygame.event.Event(pygame.QUIT)
    if name == "K_ESCAPE":
        event = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_ESCAPE)
    pygame.event.post(event)
    actions = random_actions("BipedalWalker-v3", 30)
    with pytest.warns(UserWarning, match="the window was closed; the episode continues"):
        outcomes = follow(environment, actions)
    assert pygame.display.get_surface() is None
    unseen = make_ours("BipedalWalker-v3")
    unseen.reset(seed=3)
    assert outcomes == follow(unseen, actions)
    environment.close()
    environment.reset()
    assert pygame.display.get_surface() is not None
    environment.close()


@pytest.mark.parametrize("copied", [copy.deepcopy, through_pickle])
def test_a_copy_has_its_own_window(pygame, copied):
    environment = WalkerEnv("BipedalWalker-v3", render_mode="human")
    environment.reset(seed=3)
    before = shown(pygame)
    other = copied(environment)
    other.close()
    assert np.array_equal(shown(pygame), before)
    other.reset(seed=4)
    assert not np.array_equal(shown(pygame), before)
    environment.render()
    assert np.array_equal(shown(pygame), before)
    other.close()
    assert np.array_equal(shown(pygame), before)
    environment.close()
    assert pygame.display.get_surface() is None


@pytest.mark.parametrize("environment_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_without_a_display_the_window_is_invisible(monkeypatch, environment_id):
    """As in Gymnasium, whose check_env opens a window and then renders in other modes."""
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    program = f"""
import gymnasium, pygame, walker_sim
from gymnasium.utils.env_checker import check_env
env = gymnasium.make("walker_sim/{environment_id}", render_mode="human")
check_env(env.unwrapped)
env.reset(seed=1)
assert pygame.surfarray.array3d(pygame.display.get_surface()).std() > 5
env.close()
"""
    words = "the window is invisible: there is no display; DISPLAY or WAYLAND_DISPLAY names one"
    assert words in run_python(program, warns=True)[1]


def test_without_pygame():
    program = """
import sys
sys.modules["pygame"] = None
import gymnasium, walker_sim
gymnasium.make("walker_sim/BipedalWalker-v3", render_mode="human").reset()
"""
    words = 'DependencyNotInstalled: a window needs pygame: pip install "walker_sim[window]"'
    assert words in run_python(program, status=1)[1]
