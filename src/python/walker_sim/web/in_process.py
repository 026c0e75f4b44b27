"""`play --web`: the page of a walker in this process."""

from __future__ import annotations

import argparse
import copy
import io
import time
from typing import Any, Callable, Sequence

import numpy as np

from walker_sim import _core
from walker_sim.commands.policies import Policies, has_policy, make_policies, policies_of
from walker_sim.commands.recording import arrays_of
from walker_sim.commands.session import Playback, Session
from walker_sim.web.panel import PANEL_INTERVAL, Panel, text_of
from walker_sim.web.scene import Drag, Scene
from walker_sim.window import Pace
from walker_sim.worlds import World, read_world

MAX_POLICY = 64 << 20  # size of a policy's file [bytes]


class Page(Playback):
    """Connects session, view, panel and clock.

    `options` are those of `play`, `parameters` the environment's. `policy` is the name of the
    policy of the episodes to come.
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
        super().__init__(session, pace, now)
        self._server, self._options, self._parameters = server, options, parameters
        self._specification = walkers.specification
        env_id = self._specification["id"]
        self._walkers = walkers.pool("--web")
        self.policy = options.policy
        self._known: dict[str, Policies] = {self.policy: session.policies}
        self._scene = Scene(server, _core.link_shapes(env_id, parameters))
        joints = self._specification["joint_names"]
        self._panel = Panel(server, env_id, joints, self)
        self._panel.add_policies(self, policies_for(env_id, self.policy))
        self._panel.show_world(walkers.worlds()[0])
        self._drag = Drag(self._scene.trunk)
        self._path = _core.Path()
        self._num_browsers = 0
        self._shown_panel_at = 0.0
        self._begin(lambda: None)

    def run(self) -> None:
        while True:
            self.advance()
            self.sleep()

    def advance(self) -> None:
        """Does what browsers have asked for, and steps if a step is due. If that fails, the page
        says so and pauses."""
        self._panel.handle()
        num_browsers = len(self._server.get_clients())
        try:
            if num_browsers > self._num_browsers:
                self._show()
            super().advance()
            if self._now() >= self._shown_panel_at + PANEL_INTERVAL:
                self._show_panel()
        except Exception as error:
            self.is_paused = True
            self._drag.offset = np.zeros(2)
            self._panel.tell_all(error)
        self._num_browsers = num_browsers

    # What the panel asks for, beside what every playback does.

    def begin(self, seed: int) -> None:
        self._begin(lambda: self.session.begin(seed))

    def set_world(self, world: World) -> None:
        self.session.set_world(world)

    def set_policy(self, name: str) -> None:
        if name not in self._known:
            options = argparse.Namespace(policy=name, normalization=None)
            self._known[name] = make_policies(
                options, self._specification["id"], self._parameters, self._specification
            )
        self.policy, self.session.policies = name, self._known[name]

    def load_policy(self, name: str, content: bytes) -> None:
        if len(content) > MAX_POLICY:
            raise ValueError(f"{name}: {len(content)} bytes; must be at most {MAX_POLICY}")
        network = _core.Policy.from_bytes(name, content)
        network.check(self._specification["id"], self._parameters)
        self._known[name] = policies_of(network, name)
        self.set_policy(name)

    def push(self, way: Sequence[float]) -> None:
        self.session.push(way)

    def save(self) -> tuple[str, bytes]:
        """Returns name and content of the file with the episode so far."""
        episode = self.session.episode
        if episode.length == 0:
            raise ValueError("the episode has no step yet")
        options = copy.copy(self._options)
        options.policy = self._acting
        if self._acting != self._options.policy:
            options.normalization = None
        content = io.BytesIO()
        np.savez_compressed(content, **arrays_of([episode], self._specification, options))
        return f"{self._specification['id']}_seed{episode.seed}.npz", content.getvalue()

    def _begin(self, begin: Callable[[], None]) -> None:
        def begin_picture() -> None:
            begin()
            self._acting = self.policy  # of this episode
            self._path.clear()
            self._scene.begin(self._walkers.capture(0).scene_drawings())
            self._floor_center: float | None = None

        super()._begin(begin_picture)
        self._show_panel()

    def _step(self) -> None:
        if self._drag.offset.any():
            self.session.push(self._drag.push())
        super()._step()

    def _show(self) -> None:
        """Shows the present state, if there is one and anybody to see it."""
        episode = self.session.episode
        if episode.end == "failed":
            return
        captured = self._walkers.capture(0)
        self._panel.add_point(
            episode.order, episode.length, episode.episode_return, captured.joint_positions
        )
        if not self._server.get_clients():  # viser would keep what is sent, for those to come
            return
        drawings = captured.state_drawings()
        center = captured.floor_center
        if center is not None and center != self._floor_center:
            drawings.append(captured.floor_drawing(center))
        self._floor_center = center
        if self._path.add(captured.link_poses[0, :3].tolist()):
            drawings.append(self._path.drawing())
        self._scene.show(captured.link_poses, drawings)

    def _show_panel(self) -> None:
        self._shown_panel_at = self._now()
        self._panel.show_speed(self.pace.speed)
        episode = self.session.episode
        state = episode.end or ("paused" if self.is_paused else "")
        drawn = text_of(read_world(episode.world))
        world = f"\n\nworld: {drawn}" if drawn else ""
        pushes = f", pushed in {len(episode.pushes)} steps" if episode.pushes else ""
        self._panel.show_status(
            f"**{self._specification['id']}** episode {episode.order}, seed {episode.seed}\n\n"
            f"step {episode.length}, return **{episode.episode_return:.1f}** {state}{pushes}{world}"
        )
        self._panel.plot()


def policies_for(env_id: str, chosen: str) -> list[str]:
    """Returns the policies that the page offers, the chosen one first."""
    robust = ["robust"] if has_policy(env_id, "robust") else []
    return list(dict.fromkeys([chosen, "shipped", *robust, "heuristic", "random", "zero"]))
