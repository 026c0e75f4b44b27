"""A window on the screen, by pygame, for walkers that are watched as they walk."""

from __future__ import annotations

import importlib
import os
import time
from typing import Any, Callable, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

SHORTEST_GAP = 0.015  # between pictures [s of wall time]; screens show some 60 a second
LONGEST_GAP = 0.1  # after a picture, where there is time for none [s of wall time]
WITHOUT_DISPLAY = "there is no display; DISPLAY or WAYLAND_DISPLAY names one"
FORGIVEN = 0.25  # as late as this, the walker no longer tries to catch up [s of wall time]


def load_pygame() -> Any:
    """The module, or one that is compatible with it.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    # SDL would take SIGTERM for a window's cross.
    os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")
    try:
        return importlib.import_module("pygame")
    except ImportError as error:
        raise DependencyNotInstalled(
            f'a window needs pygame: pip install "walker_sim[window]" ({error})'
        ) from error


class Pace:
    """Keeps simulation time beside wall time. Steps are never left out, pictures are.

    Parameters
    ----------
    dt
        Simulation time of a step [s].
    now
        The clock [s].
    """

    def __init__(self, dt: float, now: Callable[[], float] = time.monotonic) -> None:
        self._dt, self._now = dt, now
        self.speed = 1.0  # simulation time per wall time
        self.begin()

    def begin(self) -> None:
        """What is shown now is on time, whatever was before."""
        self._target = self._shown_at = self._drawn_at = self._now()
        self._was_due = True  # its picture is drawn until the first step

    def is_picture_due(self) -> bool:
        """To be asked once after each step: whether that has to be shown, after `time_left`."""
        now = self._now()
        self._target = max(self._target + self._dt / self.speed, now - FORGIVEN)
        if self._was_due:
            self._drawn_at = now
        shown_at = max(now, self._target)
        is_on_time = now <= self._target and shown_at - self._shown_at >= SHORTEST_GAP
        self._was_due = is_on_time or now - self._drawn_at >= LONGEST_GAP
        if self._was_due:
            self._shown_at = shown_at
        return self._was_due

    def time_left(self) -> float:
        """Until what the last step made is due, and the next step may follow [s of wall time]."""
        return max(0.0, self._target - self._now())


class Window:
    """Shows pictures in a window, which opens with the first. There is one in a process: whoever
    shows a picture while another's window is open takes that over.

    A copy, and what comes out of a pickle, is a window that has not been opened.

    Parameters
    ----------
    title
        Of the window.
    dt
        Simulation time of a step [s].
    """

    _owner: ClassVar[Window | None] = None  # of the process's window

    def __init__(self, title: str, dt: float) -> None:
        self._title = title
        self._pace = Pace(dt)
        self.is_closed = False  # by its user

    def begin(self) -> None:
        """An episode begins."""
        self._pace.begin()

    def is_picture_due(self) -> bool:
        """As `Pace.is_picture_due`; takes note of the user, too."""
        self._attend()
        return not self.is_closed and self._pace.is_picture_due()

    def wait(self) -> None:
        """Until the next step is to be made. Without the window nobody waits."""
        if not self.is_closed:
            time.sleep(self._pace.time_left())

    def show(self, rgb: NDArray[np.uint8]) -> None:
        """Shows a picture, shape (height, width, 3).

        Raises
        ------
        gymnasium.error.DependencyNotInstalled
            Without pygame.
        RuntimeError
            Where no window can be opened. Where there is no display nobody sees it, as nobody sees
            Gymnasium's own, and a warning says so.
        """
        pygame = load_pygame()
        if not self._is_open():
            open_window(self._title, (rgb.shape[1], rgb.shape[0]), may_be_unseen=True)
            Window._owner = self
        pygame.display.get_surface().blit(to_surface(rgb), (0, 0))
        pygame.display.flip()
        self._attend()

    def close(self) -> None:
        """The next picture opens it again."""
        if self._is_open():
            load_pygame().display.quit()
        self.is_closed = False

    def _is_open(self) -> bool:
        """Others may have taken the window over, or closed it."""
        return Window._owner is self and load_pygame().display.get_surface() is not None

    def _attend(self) -> None:
        """Closes the window where its user wants that, by its cross or by Escape."""
        if not self._is_open():
            return
        pygame = load_pygame()
        for event in pygame.event.get():
            is_escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
            if event.type == pygame.QUIT or is_escape:
                pygame.display.quit()
                self.is_closed = True
                gymnasium.logger.warn(
                    f"{self._title}: the window was closed, and the walker goes on without. "
                    "close() and a reset open another"
                )
                return

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "is_closed": False}


def open_window(title: str, size: tuple[int, int], may_be_unseen: bool = False) -> Any:
    """The surface of pygame's window, width and height [pixels].

    Without a display one that may be unseen is drawn to memory, and a warning says so.

    Raises
    ------
    RuntimeError
        Without a display, if it has to be seen.
    """
    pygame = load_pygame()
    try:
        if not _init_display(pygame):
            if not may_be_unseen:
                raise RuntimeError(f"no window can be opened: {WITHOUT_DISPLAY}")
            gymnasium.logger.warn(f"{title}: nobody sees the window: {WITHOUT_DISPLAY}")
            _init_display(pygame, driver="dummy")
        surface = pygame.display.set_mode(size)
    except pygame.error as error:
        raise RuntimeError(f"no window can be opened ({error})") from error
    pygame.display.set_caption(title)
    return surface


def _init_display(pygame: Any, driver: str | None = None) -> bool:
    """Whether there is a screen, or what the user or the caller has chosen in its place."""
    chosen = os.environ.get("SDL_VIDEODRIVER")
    if driver and not chosen:
        os.environ["SDL_VIDEODRIVER"] = driver
    try:
        pygame.display.init()
        # Where there is no display SDL may draw off-screen by EGL, whose end is that of MuJoCo's
        # pictures, and says so only here.
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
    """A picture of shape (height, width, 3) for pygame."""
    size = (rgb.shape[1], rgb.shape[0])
    return load_pygame().image.frombuffer(np.ascontiguousarray(rgb), size, "RGB")
