"""A pygame window that shows a walker in real time."""

from __future__ import annotations

import importlib
import os
import time
from typing import Any, Callable, ClassVar, Sequence

import gymnasium
import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

MIN_PICTURE_INTERVAL = 0.015  # minimum time between pictures [s of wall time]; screens run at 60 Hz
MAX_PICTURE_INTERVAL = 0.1  # maximum time without a picture while steps are late [s of wall time]
WITHOUT_DISPLAY = "there is no display; DISPLAY or WAYLAND_DISPLAY names one"
MAX_LAG = 0.25  # maximum lag that steps catch up; excess lag is dropped [s of wall time]


def load_pygame() -> Any:
    """Imports pygame, or the compatible pygame-ce; DependencyNotInstalled if there is neither."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    # Without this, SDL turns SIGTERM into a QUIT event.
    os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")
    try:
        return importlib.import_module("pygame")
    except ImportError as error:
        raise DependencyNotInstalled(
            f'a window needs pygame: pip install "walker_sim[window]" ({error})'
        ) from error


class Pace:
    """Synchronises simulation time with wall time. It drops pictures, never steps.

    `dt` is the simulation time of a step [s], `now` a clock [s].
    """

    def __init__(self, dt: float, now: Callable[[], float] = time.monotonic) -> None:
        self._dt, self._now = dt, now
        self.speed = 1.0  # simulation time per wall time
        self.begin()

    def begin(self) -> None:
        """Restarts the schedule: the present state is on time."""
        self._target = self._shown_at = self._drawn_at = self._now()
        self._was_due = True  # the caller draws the present state before the first step

    def is_picture_due(self) -> bool:
        """Returns whether to show the last step, after `time_left`. Call once after each step."""
        now = self._now()
        self._target = max(self._target + self._dt / self.speed, now - MAX_LAG)
        if self._was_due:
            self._drawn_at = now
        shown_at = max(now, self._target)
        is_on_time = now <= self._target and shown_at - self._shown_at >= MIN_PICTURE_INTERVAL
        self._was_due = is_on_time or now - self._drawn_at >= MAX_PICTURE_INTERVAL
        if self._was_due:
            self._shown_at = shown_at
        return self._was_due

    def time_left(self) -> float:
        """Returns the time until the last step is due and the next may follow [s of wall time]."""
        return max(0.0, self._target - self._now())


class Window:
    """Shows pictures in a window, which opens with the first picture.

    The process has one window. A `Window` that shows a picture takes it over from another `Window`.
    A copy or an unpickled `Window` is not open. `dt` is the simulation time of a step [s].
    """

    _owner: ClassVar[Window | None] = None  # has the process's window

    def __init__(self, title: str, dt: float) -> None:
        self._title = title
        self._pace = Pace(dt)
        self.is_closed = False  # whether the user has closed it

    def begin(self) -> None:
        """Restarts the schedule for a new episode."""
        self._pace.begin()

    def wait(self) -> bool:
        """Handles window events and blocks until the last step is due. Returns whether to show it;
        False at once if the user has closed the window."""
        self._handle_events()
        if self.is_closed:
            return False
        is_picture_due = self._pace.is_picture_due()
        time.sleep(self._pace.time_left())
        return is_picture_due

    def show(self, rgb: NDArray[np.uint8]) -> None:
        """Shows a picture, shape (height, width, 3).

        Raises DependencyNotInstalled without pygame, RuntimeError if no window can be opened. A
        missing display is no error: as with Gymnasium, the window is invisible, with a warning.
        """
        pygame = load_pygame()
        if not self._is_open():
            open_window(self._title, (rgb.shape[1], rgb.shape[0]), allows_invisible=True)
            Window._owner = self
        pygame.display.get_surface().blit(to_surface(rgb), (0, 0))
        pygame.display.flip()
        self._handle_events()

    def close(self) -> None:
        """Closes the window; the next picture opens it again."""
        if self._is_open():
            load_pygame().display.quit()
        self.is_closed = False

    def _is_open(self) -> bool:
        """Returns whether the process's window is open and still belongs to this object."""
        return Window._owner is self and load_pygame().display.get_surface() is not None

    def _handle_events(self) -> None:
        """Handles window events: the close button and Escape close the window."""
        if not self._is_open():
            return
        pygame = load_pygame()
        for event in pygame.event.get():
            is_escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
            if event.type == pygame.QUIT or is_escape:
                pygame.display.quit()
                self.is_closed = True
                gymnasium.logger.warn(
                    f"{self._title}: the window was closed; the episode continues without it. "
                    "close() and a reset open another"
                )
                return

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "is_closed": False}


class Screen:
    """Window with a picture, a line of text below it, and help over it."""

    LINE = 26  # height of a line [pixels]
    TEXT, BACKGROUND = (235, 235, 235), (40, 40, 40)  # colours

    def __init__(self, title: str, width: int, height: int) -> None:
        self._size = (width, height)
        self._surface = open_window(title, (width, height + self.LINE))
        pygame = load_pygame()
        pygame.font.init()
        self._font = pygame.font.Font(None, 20)
        pygame.key.set_repeat(400, 50)  # [ms]

    def show(self, rgb: NDArray[np.uint8], line: str, help_lines: Sequence[str]) -> None:
        pygame = load_pygame()
        self._surface.fill(self.BACKGROUND)
        self._surface.blit(to_surface(rgb), (0, 0))
        self._write(line, 8, self._size[1] + 6)
        if help_lines:
            shade = pygame.Surface((self._size[0], len(help_lines) * self.LINE + 12))
            shade.fill(self.BACKGROUND)
            shade.set_alpha(200)
            self._surface.blit(shade, (0, 0))
        for row, text in enumerate(help_lines):
            key, _, meaning = text.partition("  ")
            self._write(key, 16, row * self.LINE + 12)
            self._write(meaning.strip(), 130, row * self.LINE + 12)
        pygame.display.flip()

    def close(self) -> None:
        load_pygame().display.quit()

    def _write(self, text: str, x: int, y: int) -> None:
        self._surface.blit(self._font.render(text, True, self.TEXT), (x, y))


def open_window(title: str, size: tuple[int, int], allows_invisible: bool = False) -> Any:
    """Opens pygame's window and returns its surface; `size` is width and height [pixels].

    Without a display, draws to memory, with a warning, if `allows_invisible`; else raises
    RuntimeError, as if the window cannot be opened.
    """
    pygame = load_pygame()
    try:
        if not _init_display(pygame):
            if not allows_invisible:
                raise RuntimeError(f"no window can be opened: {WITHOUT_DISPLAY}")
            gymnasium.logger.warn(f"{title}: the window is invisible: {WITHOUT_DISPLAY}")
            _init_display(pygame, driver="dummy")
        surface = pygame.display.set_mode(size)
    except pygame.error as error:
        raise RuntimeError(f"no window can be opened ({error})") from error
    pygame.display.set_caption(title)
    return surface


def _init_display(pygame: Any, driver: str | None = None) -> bool:
    """Returns whether there is a display, or a driver that the user or the caller has chosen."""
    chosen = os.environ.get("SDL_VIDEODRIVER")
    if driver and not chosen:
        os.environ["SDL_VIDEODRIVER"] = driver
    try:
        pygame.display.init()
        # Without a display SDL may choose its offscreen driver, whose EGL shutdown breaks MuJoCo's
        # renderer. Only get_driver() reports it.
        if pygame.display.get_driver() != "offscreen" or chosen:
            return True
        pygame.display.quit()
        return False
    except pygame.error:
        if chosen or driver:
            raise
        return False
    finally:
        if driver and not chosen:
            del os.environ["SDL_VIDEODRIVER"]


def to_surface(rgb: NDArray[np.uint8]) -> Any:
    """Converts a picture of shape (height, width, 3) to a pygame surface."""
    size = (rgb.shape[1], rgb.shape[0])
    return load_pygame().image.frombuffer(np.ascontiguousarray(rgb), size, "RGB")
