"""The node `page`: the page of a server, over its ordinary topics and services."""

from __future__ import annotations

import math
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any, Sequence

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from std_srvs.srv import Trigger
from viser.transforms import SO3

from walker_sim import _core
from walker_sim.commands.session import push_force
from walker_sim.msg import World as WorldMessage
from walker_sim.msg import WorldParameter
from walker_sim.srv import Reset, Restore, SetRealTimeFactor, SetWorld, Snapshot, Step
from walker_sim.web.connection import ServerMonitor, Services
from walker_sim.web.panel import PANEL_INTERVAL, Panel, text_of
from walker_sim.web.scene import Drag, Scene
from walker_sim.web.server import LOOPBACK, CannotServe, serve
from walker_sim.web.topics import TopicBuffer
from walker_sim.worlds import World, ends_of

PICTURE_INTERVAL = 0.02  # [s of wall time]
ADDRESS_INTERVAL = 30.0  # between prints of the address [s of wall time]


class ServerPage:
    """The page of one server, given by its node's resolved name."""

    def __init__(self, web_server: Any, server: str) -> None:
        self._web, self._server = web_server, server
        self._namespace = server.rpartition("/")[0]
        self._services, self._monitor = Services(server), ServerMonitor(server)
        self._pushes = rospy.Publisher(f"{self._namespace}/push", WrenchStamped, queue_size=10)
        self._status = web_server.gui.add_markdown("")
        self._robot: tuple[Any, ...] = ()  # for which the page is built
        self._buffer: TopicBuffer | None = None
        self._refusal = ""  # why the robot cannot be drawn
        self._failure = ""  # the error that the status shows next
        self._is_seen = False  # by a browser
        self._is_cleared = False  # since the server was lost
        self._shown_panel_at = 0.0

    def run(self, address: str) -> None:
        """Shows the server until this node is shut down. Prints the address, and again until a
        browser has opened it: status lines move it out of the terminal."""
        next_print = time.monotonic()
        while not rospy.is_shutdown():
            if time.monotonic() >= next_print:
                print(address, flush=True)
                next_print += ADDRESS_INTERVAL
            if self._web.get_clients():
                next_print = math.inf
            self.advance()
            time.sleep(PICTURE_INTERVAL)

    def advance(self) -> None:
        """Does what browsers have asked for and shows what is new. An error ends nothing: a browser
        may have sent it."""
        try:
            self._advance()
        except Exception as error:
            self._failure = str(error)
            rospy.logerr_throttle_identical(60, traceback.format_exc())

    def _advance(self) -> None:
        spec, monitor = self._monitor.spec, self._monitor
        if spec is not None and robot_of(spec) != self._robot:
            self._robot = robot_of(spec)
            try:
                self._build(spec)
            except ValueError as error:  # a model that is not on this machine
                self._refusal = str(error)
        if self._buffer is None:
            reason = self._refusal or monitor.unavailable_reason()
            self._status.content = f"Waits for {self._server}. {reason}"
            return
        if monitor.error and not self._is_cleared:
            self._buffer.clear()
        self._is_cleared = bool(monitor.error)
        is_seen = bool(self._web.get_clients())
        if is_seen != self._is_seen:  # markers cost the server time
            self._is_seen = is_seen
            self._buffer.subscribe.put(is_seen)
        self._panel.handle()
        self._buffer.show(self._scene)
        self._push_by_drag(self._buffer)
        if (progress := self._buffer.progress) is not None:
            self._panel.add_point(
                progress.episode, progress.length, progress.episode_return, self._buffer.angles
            )
        if is_seen and time.monotonic() >= self._shown_panel_at + PANEL_INTERVAL:
            self._shown_panel_at = time.monotonic()
            self._show_panel(self._buffer)

    def _build(self, spec: Any) -> None:
        if self._buffer is not None:
            self._buffer.subscribe.put(False)
        self._buffer, self._is_seen, self._refusal = None, False, ""
        self._web.gui.reset()
        self._web.scene.reset()
        self._status = self._web.gui.add_markdown("")
        names = dict(zip(spec.parameter_names, spec.parameter_values))
        model = {"xml_file": names["xml_file"]} if "xml_file" in names else {}
        shapes = _core.link_shapes(spec.id, model)
        self._status.remove()
        self._spec, self._links = spec, [shape["name"] for shape in shapes]
        self._push_force = push_force(spec.id, spec.dt)
        self._pushed_at = 0, 0  # episode and step
        self._scene = Scene(self._web, shapes)
        self._drag = Drag(self._scene.trunk)
        self._panel = Panel(self._web, spec.id, spec.joint_names, self, "a bag for `replay`")
        self._buffer = TopicBuffer(self._namespace, self._links, spec.joint_names)

    # What the panel asks for.

    def pause(self) -> None:
        is_paused = self._monitor.is_paused
        self._services("unpause" if is_paused else "pause", Trigger)
        self._monitor.is_paused = not is_paused and self._spec.mode == "free"

    def step_once(self) -> None:
        self._services("step", Step, action=[0.0] * self._spec.action_size)

    def repeat(self) -> None:
        """Begins the present episode again, also one that continued the generator."""
        record = self._services("snapshot", Snapshot).record
        record.actions, record.pushes, record.coordinates, record.checksums = [], [], [], []
        record.episode.length, record.episode.episode_return = 0, 0.0
        self._services("restore", Restore, record=record)

    def begin_next(self) -> None:
        self._services("reset", Reset)

    def begin(self, seed: int) -> None:
        self._services("reset", Reset, has_seed=True, seed=seed)

    def set_speed(self, speed: float) -> None:
        self._services("set_real_time_factor", SetRealTimeFactor, factor=speed)
        self._monitor.wanted_factor = speed

    def set_world(self, world: World) -> None:
        self._services("set_world", SetWorld, worlds=[to_message(world)])
        self._monitor.refresh()  # an older specification would show the world before

    def push(self, way: Sequence[float] | NDArray[np.float64]) -> None:
        trunk = None if self._buffer is None else self._buffer.trunk
        if self._buffer is None or trunk is None:
            raise RuntimeError("the server has not shown the walker yet")
        message = WrenchStamped()
        message.header.frame_id = f"{self._buffer.prefix}/{self._links[0]}".lstrip("/")
        to_trunk = SO3(trunk[3:]).inverse()  # a push is along the trunk's own axes
        force = to_trunk @ (self._push_force * np.array([way[0], 0.0, way[1]]))
        message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = force
        self._pushes.publish(message)

    def save(self) -> tuple[str, bytes]:
        """Returns name and content of a bag with the episode so far, for `replay`."""
        record = self._services("snapshot", Snapshot).record
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{record.spec.id}_episode{record.episode.episode}.bag"
            with rosbag.Bag(str(file), "w") as bag:
                bag.write("episode_record", record, record.episode.header.stamp)
            return file.name, file.read_bytes()

    def _push_by_drag(self, buffer: TopicBuffer) -> None:
        """Pushes once for each state that the topics show."""
        progress = buffer.progress
        if progress is None or buffer.trunk is None or not self._drag.offset.any():
            return
        step = progress.episode, progress.length
        if step != self._pushed_at:
            self._pushed_at = step
            self.push(self._drag.push())

    def _show_panel(self, buffer: TopicBuffer) -> None:
        panel, monitor = self._panel, self._monitor
        world = to_world(monitor.spec.world.parameters)
        if world != panel.world:  # another client has set it
            panel.show_world(world)
        if monitor.wanted_factor is not None:
            panel.show_speed(monitor.wanted_factor)
        head = f"**{self._spec.id}**"
        failure, self._failure = self._failure, ""
        reason, progress = failure or monitor.unavailable_reason(), buffer.progress
        if reason or progress is None:
            panel.show_status(f"{head} {reason or 'waits for an episode'}")
            return
        state = progress.end_reason or ("paused" if monitor.is_paused else self._spec.mode)
        seed = f"seed {progress.seed}" if progress.has_seed else "unseeded"
        drawn = text_of(to_world(progress.world))
        panel.show_status(
            f"{head} episode {progress.episode}, {seed}\n\n"
            f"step {progress.length}, return **{progress.episode_return:.1f}** {state}"
            + (f"\n\nworld: {drawn}" if drawn else "")
        )
        panel.plot()


def robot_of(spec: Any) -> tuple[Any, ...]:
    """Returns what a page is built for."""
    return spec.id, spec.mode, spec.parameter_names, spec.parameter_values


def to_message(world: World) -> WorldMessage:
    if not world:
        return WorldMessage(preset="gymnasium")
    return WorldMessage(
        parameters=[
            WorldParameter(name, *ends_of(given), isinstance(given, dict))
            for name, given in world.items()
        ]
    )


def to_world(parameters: Sequence[WorldParameter]) -> World:
    return {
        each.name: {"log": (each.low, each.high)} if each.log_uniform else (each.low, each.high)
        for each in parameters
    }


def main() -> None:
    """Runs the node until it is shut down."""
    rospy.init_node("page", disable_rostime=True)
    server = rospy.resolve_name(rospy.get_param("~server", "walker_sim"))
    host, port = str(rospy.get_param("~host", LOOPBACK)), rospy.get_param("~port", None)
    try:
        web_server, address = serve(server, host, port)
    except CannotServe as error:
        sys.exit(f"page: {error}")
    ServerPage(web_server, server).run(f"page of {server}: {address}")
