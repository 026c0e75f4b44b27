"""``play``: shows a walker in a window or on a page in the browser."""

from __future__ import annotations

import argparse
import functools
import sys
import time
from contextlib import closing
from typing import Any, Callable, Sequence

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from walker_sim.commands import options as common
from walker_sim.commands.policies import POLICY_HELP, make_policies
from walker_sim.commands.session import MAX_SPEED, MIN_SPEED, Playback, Session
from walker_sim.rendering import Pictures, split_keywords
from walker_sim.web.in_process import Page
from walker_sim.web.server import LOOPBACK, CannotServe, serve
from walker_sim.window import Pace, Screen, load_pygame

EPISODES = 100

KEYS = """\
Space            pause or continue
.                one step
Arrows           push the trunk
R                repeat the episode
N                next episode
+, F             double the speed
-, S             halve the speed
H                show or hide this help
Q, Esc           quit"""

PUSHES = {"LEFT": (-1, 0), "RIGHT": (1, 0), "UP": (0, 1), "DOWN": (0, -1)}  # x and z, by key

DESCRIPTION = """\
Shows a walker in real time, in a window or with --web on a page in the browser: one episode for
each seed, and then again from the first seed. A line beside the picture has the episode, its seed,
step and return, the speed, and how the episode ended. The window needs pygame, pip install
"walker_sim[window]"; the page needs viser and no display, pip install "walker_sim[web]".

An arrow key pushes the trunk in the next step. The impulse is the default of a world's parameter
push_impulse; keys in the same step add up. After such a push the episode is no longer the one that
its seed gives, so the line printed at its end counts the pushes. Over ROS publish on the topic push
instead.
"""

EPILOG = f"""\
keys:
  {KEYS.replace(chr(10), chr(10) + "  ")}

{common.WALKER_HELP}width=960 and height=640 set the picture's size, and for Walker2d and Hopper
camera_name=track or camera_id=0 the camera.

{POLICY_HELP}
examples:
  python3 -m walker_sim play
  python3 -m walker_sim play Walker2d-v5 --speed 0.25
  python3 -m walker_sim play BipedalWalker-v3 --world hard
  python3 -m walker_sim play BipedalWalkerHardcore-v3 --policy shipped --web
  python3 -m walker_sim play BipedalWalkerHardcore-v3 --policy model.zip --seeds 1000:1010
"""


class Viewer(Playback):
    """Connects session, screen, keyboard and clock."""

    def __init__(
        self,
        session: Session,
        draw: Callable[[], NDArray[np.uint8]],
        screen: Screen,
        pace: Pace,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(session, pace, now)
        self.is_over, self.has_help = False, False
        self._has_warned = False  # that pushes do not work
        self._draw, self._screen = draw, screen
        pygame = load_pygame()
        self._pushes = {getattr(pygame, f"K_{name}"): way for name, way in PUSHES.items()}
        self._show()

    def run(self) -> None:
        while not self.is_over:
            self.handle_events()
            self.advance()
            self.sleep()

    def handle_events(self) -> None:
        pygame = load_pygame()
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.is_over = True
            elif event.type == pygame.KEYDOWN:
                self._handle_key(pygame, event.key)
                self._show()
            elif event.type == pygame.VIDEOEXPOSE:
                self._show()

    def status(self) -> str:
        episode = self.session.episode
        state = [episode.end] * bool(episode.end) + ["paused"] * self.is_paused
        words = (
            f"episode {episode.order}",
            f"seed {episode.seed}",
            f"step {episode.length}",
            f"return {episode.episode_return:.1f}",
            f"speed {self.pace.speed:g}x",
            ", ".join(state) or "H: help",
        )
        return "    ".join(words)

    def _handle_key(self, pygame: Any, key: int) -> None:
        if key == pygame.K_SPACE:
            self.pause()
        elif key == pygame.K_PERIOD:
            self.step_once()
        elif key in self._pushes:
            self._push(self._pushes[key])
        elif key == pygame.K_r:
            self.repeat()
        elif key == pygame.K_n:
            self.begin_next()
        elif key in (pygame.K_PLUS, pygame.K_EQUALS, pygame.K_KP_PLUS, pygame.K_f):
            self.set_speed(min(2 * self.pace.speed, MAX_SPEED))
        elif key in (pygame.K_MINUS, pygame.K_KP_MINUS, pygame.K_s):
            self.set_speed(max(self.pace.speed / 2, MIN_SPEED))
        elif key == pygame.K_h:
            self.has_help = not self.has_help
        elif key in (pygame.K_q, pygame.K_ESCAPE):
            self.is_over = True

    def _push(self, direction: tuple[int, int]) -> None:
        try:
            self.session.push(direction)
        except AttributeError as error:
            if not self._has_warned:
                print(f"walker_sim play: {error}; publish on the topic push", file=sys.stderr)
            self._has_warned = True

    def _show(self) -> None:
        if self.session.episode.end != "failed":  # a failed engine has no state to draw
            self._picture = self._draw()
        self._screen.show(self._picture, self.status(), KEYS.split("\n") * self.has_help)


def run(arguments: Sequence[str]) -> int:
    parser = common.Parser("play", DESCRIPTION, EPILOG)
    common.add_episodes(parser, EPISODES)
    parser.add_argument(
        "--speed",
        type=common.positive,
        default=1.0,
        metavar="FACTOR",
        help="speed at the start: simulation time over wall time (default: 1)",
    )
    parser.add_argument(
        "--web",
        action="store_true",
        help="show a page in the browser instead of a window, and print its address",
    )
    parser.add_argument(
        "--port",
        type=common.port,
        metavar="N",
        help="with --web: port of the page (default: the first free one from 8080 on)",
    )
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        help="with --web: address to listen on (default: 127.0.0.1, this machine only)",
    )
    common.add_world(parser)
    common.add_walker_options(parser)
    options = parser.parse_intermixed_args(arguments)
    if not MIN_SPEED <= options.speed <= MAX_SPEED:
        raise common.InputError(
            f"--speed {options.speed:g}: must be between {MIN_SPEED:g} and {MAX_SPEED:g}"
        )
    for name in ("port", "host"):
        if getattr(options, name) is not None and not options.web:
            raise common.InputError(f"--{name} {getattr(options, name)}: only with --web")
    if options.web and options.transport == "ros":
        raise common.InputError("--web: must be with --transport inprocess")
    words = options.walker
    if all("=" in word for word in words):
        words = ["BipedalWalker-v3", *words]
    env_id, parameters = common.walker_of(words)
    parameters, camera = split_keywords(env_id, parameters)
    if options.web and camera:
        raise common.InputError(f"{next(iter(camera))}: must be without --web, whose view has it")
    with closing(common.make_walkers(options, env_id, parameters, None, 1)) as walkers:
        policies = make_policies(options, env_id, parameters, walkers.specification)
        session = Session(walkers, policies, common.chosen_seeds(options))
        pace = Pace(walkers.specification["dt"])
        pace.speed = options.speed
        if options.web:
            return show_page(options, session, parameters, pace)
        try:
            pictures = Pictures(env_id, parameters, "human", camera, walkers.specification["dt"])
            size = pictures.camera_parameters["width"], pictures.camera_parameters["height"]
            screen = Screen(f"walker_sim {env_id}", *size)
            draw = functools.partial(pictures.colors, walkers.drawer(0))
            viewer = Viewer(session, draw, screen, pace)
        except (DependencyNotInstalled, RuntimeError) as error:
            raise common.InputError(f"{error}; --web shows a page in the browser") from error
        except (ValueError, TypeError) as error:
            raise common.InputError(str(error)) from error
        with closing(screen):
            viewer.run()
    return 0


def show_page(
    options: argparse.Namespace, session: Session, parameters: dict[str, Any], pace: Pace
) -> int:
    """Serves the page until Ctrl-C."""
    env_id = session.walkers.specification["id"]
    try:
        server, address = serve(f"walker_sim {env_id}", options.host or LOOPBACK, options.port)
    except CannotServe as error:
        raise common.InputError(f"--web: {error}") from error
    page = Page(server, session, options, parameters, pace)
    print(f"{env_id}: {address} (Ctrl-C ends it)", flush=True)
    page.run()
    return 0
