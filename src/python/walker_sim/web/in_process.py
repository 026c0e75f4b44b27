"""`play --web`: the page of a walker in this process."""

from __future__ import annotations

import argparse
import copy
import io
import time
from typing import Any, Callable, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.commands.options import InputError
from walker_sim.commands.policies import PolicyFailed, make_policies, policies_of
from walker_sim.commands.recording import arrays_of
from walker_sim.commands.session import Session, text_of_end
from walker_sim.web.panel import Panel
from walker_sim.web.scene import Scene
from walker_sim.window import Pace
from walker_sim.worlds import World

END_SHOWN = 1.5  # duration of an episode's last picture [s of wall time]
POLL_INTERVAL = 0.01  # [s of wall time]
PANEL_INTERVAL = 0.2  # between updates of plots and status [s of wall time]
DRAG = 0.1
"""What pulls the trunk in each step for each metre that it is dragged, in an arrow key's pushes."""


class Page:
    """Connects session, view, panel and clock.

    `options` are those of `play`, `parameters` the environment's.
    """

    def __init__(
        self,
        server: Any,
        session: Session,
        options: argparse.Namespace,
        parameters: dict[str, Any],
        pace: Pace,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        walkers = session.walkers
        self.session, self._pace, self._now = session, pace, now
        self.is_paused = False
        self._options, self._parameters = copy.copy(options), parameters
        self._specification = walkers.specification
        env_id = self._specification["id"]
        self._walkers = walkers.pool("--web")
        self._scene = Scene(server, _core.link_shapes(env_id, parameters))
        joints = self._specification["joint_names"]
        self._panel = Panel(server, env_id, joints, self, policies_for(env_id, options.policy))
        self._panel.refuse(InputError, PolicyFailed, AttributeError)
        self._panel.show_world(walkers.worlds()[0])
        self._drag = np.zeros(2)  # from the grabbed point to the pointer, along x and z [m]
        for mesh in self._scene.trunk:
            mesh.on_drag(self._take_drag)
        self._shown_panel_at = self._ended_at = 0.0
        self._begin(lambda: None)

    def run(self) -> None:
        while True:
            self.advance()
            is_running = not self.is_paused and not self.session.episode.end
            time.sleep(min(POLL_INTERVAL, self._pace.time_left()) if is_running else POLL_INTERVAL)

    def advance(self) -> None:
        """Does what browsers have asked for, and steps if a step is due."""
        self._panel.handle()
        if not self.is_paused:
            if self.session.episode.end:
                if self._now() >= self._ended_at + END_SHOWN:
                    self.begin_next()
            elif self._pace.time_left() == 0:
                self._step()
        if self._now() >= self._shown_panel_at + PANEL_INTERVAL:
            self._show_panel()

    # What the panel asks for.

    def pause(self) -> None:
        self.is_paused = not self.is_paused
        self._pace.begin()

    def step_once(self) -> None:
        self.is_paused = True
        if not self.session.episode.end:
            self._step()

    def repeat(self) -> None:
        self._begin(self.session.begin)

    def begin_next(self) -> None:
        self._begin(self.session.begin_next)

    def begin(self, seed: int) -> None:
        self._begin(lambda: self.session.begin(seed))

    def set_speed(self, speed: float) -> None:
        self._pace.speed = speed
        self._pace.begin()

    @property
    def speed(self) -> float:
        """Simulation time per wall time."""
        return self._pace.speed

    def set_world(self, world: World) -> None:
        self.session.set_world(world)

    def set_policy(self, name: str) -> None:
        options = copy.copy(self._options)
        options.policy = name
        policies = make_policies(
            options, self._specification["id"], self._parameters, self._specification
        )
        self._options, self.session.policies = options, policies

    def load_policy(self, name: str, content: bytes) -> None:
        network = _core.Policy.from_bytes(name, content)
        network.check(self._specification["id"], self._parameters)
        self.session.policies = policies_of(network, name)
        self._options.policy = name

    def push(self, way: Sequence[float]) -> None:
        self.session.push(way)

    def save(self) -> tuple[str, bytes]:
        """Returns name and content of the file with the episode so far."""
        episode = self.session.episode
        if episode.length == 0:
            raise ValueError("the episode has no step yet")
        content = io.BytesIO()
        arrays = arrays_of([episode], self._specification, self._options)
        np.savez_compressed(content, **arrays)
        return f"{self._specification['id']}_seed{episode.seed}.npz", content.getvalue()

    async def _take_drag(self, event: Any) -> None:
        way = np.subtract(event.end_position, event.start_position)[[0, 2]]
        is_held = event.phase != "end"
        self._drag = way if is_held else np.zeros(2)

    def _begin(self, begin: Callable[[], None]) -> None:
        begin()
        self._pace.begin()
        self._returns: list[float] = [0.0]
        self._scene.begin(self._walkers.capture(0).scene_drawings())
        self._floor_center: float | None = None
        self._show()
        self._angles = [self._joint_angles]
        self._show_panel()

    def _step(self) -> None:
        if self._drag.any():
            self.session.push(DRAG * self._drag)
        self.session.step()
        episode = self.session.episode
        is_due = self._pace.is_picture_due()
        if episode.end:
            self._ended_at = self._now()
            print(text_of_end(episode), flush=True)
        if is_due or episode.end:
            self._show()
        self._returns.append(episode.episode_return)
        self._angles.append(self._joint_angles)

    def _show(self) -> None:
        if self.session.episode.end == "failed":
            return
        captured = self._walkers.capture(0)
        self._joint_angles = captured.joint_positions
        drawings = captured.state_drawings()
        center = captured.floor_center
        if center is not None and center != self._floor_center:
            drawings.append(captured.floor_drawing(center))
        self._floor_center = center
        self._scene.show(captured.link_poses, drawings)

    def _show_panel(self) -> None:
        self._shown_panel_at = self._now()
        episode = self.session.episode
        state = episode.end or ("paused" if self.is_paused else "")
        drawn = ", ".join(f"{name} {value:.3g}" for name, value in episode.world.items())
        world = f"\n\nworld: {drawn}" if drawn else ""
        pushes = f", pushed in {len(episode.pushes)} steps" if episode.pushes else ""
        self._panel.show_status(
            f"**{self._specification['id']}** episode {episode.order}, seed {episode.seed}\n\n"
            f"step {episode.length}, return **{episode.episode_return:.1f}** {state}{pushes}{world}"
        )
        self._panel.plot(self._returns, self._angles)


def policies_for(env_id: str, chosen: str) -> list[str]:
    """Returns the policies that the page offers, the chosen one first."""
    names = ["shipped", "robust", "heuristic", "random", "zero"]
    return [chosen, *(name for name in names if name != chosen)]
