"""The node `page`: the page of a server, over its ordinary topics and services."""

from __future__ import annotations

import math
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Mapping, Sequence

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from viser.transforms import SE3, SO3
from visualization_msgs.msg import Marker, MarkerArray

from walker_sim import _core
from walker_sim.msg import Episode, WorldParameter
from walker_sim.msg import World as WorldMessage
from walker_sim.srv import Reset, Restore, SetRealTimeFactor, SetWorld, Snapshot, Step
from walker_sim.web.connection import Services, Subscriptions, Watch
from walker_sim.web.panel import Panel
from walker_sim.web.scene import Drag, Drawing, Scene
from walker_sim.web.server import LOOPBACK, CannotServe, serve
from walker_sim.worlds import World

PICTURE_INTERVAL = 0.02  # [s of wall time]
MAX_STATES = 20  # that wait for the other half of what a picture needs
ADDRESS_INTERVAL = 30.0  # between prints of the address [s of wall time]
PANEL_INTERVAL = 0.2  # between updates of plots and status [s of wall time]
KINDS = {
    Marker.TRIANGLE_LIST: "triangles",
    Marker.LINE_LIST: "lines",
    Marker.LINE_STRIP: "line_strip",
    Marker.SPHERE_LIST: "spheres",
}


class Received:
    """What the topics have shown since it was last taken. Callbacks come in threads of their own.

    `links` are the names of the specification's links, the trunk first.
    """

    def __init__(self, space: str, links: Sequence[str], joints: Sequence[str]) -> None:
        self._lock = threading.Lock()
        self._links, self._joints = links, joints
        self._scenes: list[list[Drawing]] = []
        self._floor: list[Drawing] = []
        self._fixed: dict[str, Any] = {}  # frames by name
        # Of the latest states, by stamp.
        self._poses: dict[Any, NDArray[np.float64]] = {}  # of the links
        self._drawings: dict[Any, list[Drawing]] = {}
        self.trunk: NDArray[np.float64] | None = None  # its latest pose
        self._angles: list[float] = []
        self.prefix = ""  # of the frames
        self.progress: Any = None
        self.returns: dict[int, float] = {}
        self.angles: dict[int, Sequence[float]] = {}
        self.topics = Subscriptions(
            space,
            {
                "scene_markers": (MarkerArray, self._take_scene, 20),
                "state_markers": (MarkerArray, self._take_state, 2),
                "/tf_static": (TFMessage, self._take_fixed_frames, 20),
                "/tf": (TFMessage, self._take_frames, 20),  # of several walkers
                "joint_states": (JointState, self._take_joints, 2),
                "episode": (Episode, self._take_progress, 2),
                "progress": (Episode, self._take_progress, 2),
            },
        )

    def show(self, scene: Scene) -> None:
        """Shows what is new: the latest state of which there are both poses and drawings."""
        with self._lock:
            scenes, self._scenes = self._scenes, []
            whole = self._poses.keys() & self._drawings.keys()
            if whole:
                latest = max(whole)
                poses, drawings = self._poses[latest], [*self._floor, *self._drawings[latest]]
                self._floor = []
                for states in (self._poses, self._drawings):
                    for stamp in [stamp for stamp in states if stamp <= latest]:
                        del states[stamp]
        for each in scenes:
            scene.begin(each)
        if whole:
            scene.show(poses, drawings)

    def _take_scene(self, message: Any) -> None:
        drawings = [to_drawing(each) for each in message.markers if is_drawn(each)]
        with self._lock:
            if any(each.action == Marker.DELETEALL for each in message.markers):
                self._scenes.append(drawings)
                self._floor = []
            else:  # it has moved with the walker
                self._floor = drawings

    def _take_state(self, message: Any) -> None:
        drawings = [to_drawing(each) for each in message.markers if is_drawn(each)]
        if not message.markers:
            return
        header = message.markers[0].header
        self.prefix = header.frame_id.rpartition("/")[0]
        self._keep(self._drawings, header.stamp, drawings)

    def _keep(self, states: dict[Any, Any], stamp: Any, state: Any) -> None:
        with self._lock:
            if states and stamp < max(states):  # of a server that began again
                states.clear()
            states[stamp] = state
            if len(states) > MAX_STATES:
                del states[min(states)]

    def _take_fixed_frames(self, message: Any) -> None:
        self._fixed.update((each.child_frame_id, each) for each in message.transforms)

    def _take_frames(self, message: Any) -> None:
        start = f"{self.prefix}/" if self.prefix else ""
        frames = {**self._fixed, **{each.child_frame_id: each for each in message.transforms}}
        if not all(start + link in frames for link in self._links):  # another walker's
            return
        poses = np.array([pose_of(frames, start + link).wxyz_xyz for link in self._links])
        poses = np.roll(poses, 3, axis=1)  # position first
        self.trunk = poses[0]
        self._keep(self._poses, frames[start + self._links[0]].header.stamp, poses)

    def _take_joints(self, message: Any) -> None:
        angles = dict(zip(message.name, message.position))
        self._angles = [angles.get(joint, np.nan) for joint in self._joints]

    def _take_progress(self, message: Any) -> None:
        with self._lock:
            before = self.progress
            if before is None or message.episode != before.episode:
                self.returns, self.angles = {}, {}
            self.progress = message
            self.returns[message.length] = message.episode_return
            self.angles[message.length] = self._angles or [np.nan] * len(self._joints)


class ServerPage:
    """The page of one server, given by its node's resolved name."""

    def __init__(self, web_server: Any, server: str) -> None:
        self._web, self._server = web_server, server
        self._space = server.rpartition("/")[0]
        self._services, self._watch = Services(server), Watch(server)
        self._pushes = rospy.Publisher(f"{self._space}/push", WrenchStamped, queue_size=10)
        self._spec: Any = None  # for which the page is built
        self._received: Received | None = None
        self._status = web_server.gui.add_markdown("")
        self._is_seen = False  # by a browser
        self._shown_panel_at = 0.0

    def run(self, address: str) -> None:
        """Shows the server until this node is shut down. Prints the address, and again until a
        browser has opened it: status lines move it out of the terminal."""
        next_print = time.monotonic()
        while not rospy.is_shutdown():
            if time.monotonic() >= next_print:
                print(address, flush=True)
                next_print += ADDRESS_INTERVAL
            self.advance()
            if self._is_seen:
                next_print = math.inf
            time.sleep(PICTURE_INTERVAL)

    def advance(self) -> None:
        spec = self._watch.spec
        if spec is not None and (self._spec is None or _robot_of(spec) != _robot_of(self._spec)):
            self._build(spec)
        if self._received is None:
            self._status.content = f"Waits for {self._server}. {self._watch.trouble()}"
            return
        self._panel.handle()
        is_seen = bool(self._web.get_clients())
        if is_seen != self._is_seen:  # markers cost the server time
            self._is_seen = is_seen
            self._received.topics.begin() if is_seen else self._received.topics.end()
        self._received.show(self._scene)
        self._pull()
        if is_seen and time.monotonic() >= self._shown_panel_at + PANEL_INTERVAL:
            self._show_panel()

    def _build(self, spec: Any) -> None:
        if self._received is not None:
            self._received.topics.end()
        self._web.gui.reset()
        self._web.scene.reset()
        self._spec, self._is_seen = spec, False
        names = dict(zip(spec.parameter_names, spec.parameter_values))
        model = {"xml_file": names["xml_file"]} if "xml_file" in names else {}
        shapes = _core.link_shapes(spec.id, model)
        self._links = [shape["name"] for shape in shapes]
        self._scene = Scene(self._web, shapes)
        self._drag = Drag(self._scene.trunk)
        self._panel = Panel(self._web, spec.id, spec.joint_names, self)
        self._received = Received(self._space, self._links, spec.joint_names)
        self._world: World | None = None
        (impulse,) = (
            each["default"]
            for each in _core.world_parameters(spec.id)
            if each["name"] == "push_impulse"
        )
        self._push_force = impulse / spec.dt  # [N]
        self._pushed_at = -1  # step

    # What the panel asks for.

    def pause(self) -> None:
        is_paused = self._watch.is_paused
        self._services("unpause" if is_paused else "pause", Trigger)
        self._watch.is_paused = not is_paused and self._spec.mode == "free"

    def step_once(self) -> None:
        self._services("step", Step, action=[0.0] * self._spec.action_size)

    def repeat(self) -> None:
        """Begins the present episode again, also one that continued the generator."""
        record = self._services("snapshot", Snapshot).record
        record.actions, record.pushes, record.checksums = [], [], []
        record.episode.length, record.episode.episode_return = 0, 0.0
        self._services("restore", Restore, record=record)

    def begin_next(self) -> None:
        self._services("reset", Reset)

    def begin(self, seed: int) -> None:
        self._services("reset", Reset, has_seed=True, seed=seed)

    def set_speed(self, speed: float) -> None:
        self._services("set_real_time_factor", SetRealTimeFactor, factor=speed)

    def set_world(self, world: World) -> None:
        self._services("set_world", SetWorld, worlds=[to_message(world)])
        self._watch.look()  # an older specification would show the world before
        self._world = world

    def push(self, way: Sequence[float] | NDArray[np.float64]) -> None:
        received = self._received
        if received is None or received.trunk is None:
            raise RuntimeError("the server has not shown the walker yet")
        message = WrenchStamped()
        message.header.frame_id = f"{received.prefix}/{self._links[0]}".lstrip("/")
        to_trunk = SO3(received.trunk[3:]).inverse()  # a push is along the trunk's own axes
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

    def _pull(self) -> None:
        """Pushes once for each state that the topics show."""
        progress = self._received.progress if self._received else None
        if progress is None or progress.length == self._pushed_at or not self._drag.way.any():
            return
        self._pushed_at = progress.length
        self.push(self._drag.push())

    def _show_panel(self) -> None:
        self._shown_panel_at = time.monotonic()
        received, watch = self._received, self._watch
        assert received is not None
        world = to_world(watch.spec.world)
        if world != self._world:  # another client may have set it
            self._world = world
            self._panel.show_world(world)
        if watch.wanted_factor is not None:
            self._panel.show_speed(watch.wanted_factor)
        trouble, progress = watch.trouble(), received.progress
        if trouble or progress is None:
            self._panel.show_status(f"**{self._spec.id}** {trouble or 'waits for an episode'}")
            return
        state = progress.end_reason or ("paused" if watch.is_paused else self._spec.mode)
        seed = f"seed {progress.seed}" if progress.has_seed else "unseeded"
        drawn = ", ".join(f"{each.name} {each.low:.3g}" for each in progress.world)
        self._panel.show_status(
            f"**{self._spec.id}** episode {progress.episode}, {seed}\n\n"
            f"step {progress.length}, return **{progress.episode_return:.1f}** {state}"
            + (f"\n\nworld: {drawn}" if drawn else "")
        )
        self._panel.plot(progress.episode, received.returns, received.angles)


def _robot_of(spec: Any) -> tuple[Any, ...]:
    return spec.id, spec.mode, spec.parameter_names, spec.parameter_values


def is_drawn(marker: Any) -> bool:
    return marker.type in KINDS or marker.action == Marker.DELETE


def to_drawing(marker: Any) -> Drawing:
    """Returns a marker of the server as the drawing of which it was made."""
    points = np.array([(each.x, each.y, each.z) for each in marker.points], np.float32)
    colors = np.array([(each.r, each.g, each.b, each.a) for each in marker.colors], np.float32)
    color = marker.color
    return {
        "name": marker.ns,
        "kind": KINDS.get(marker.type, "triangles"),
        "size": marker.scale.x,
        "points": points.reshape(-1, 3),
        "color": (color.r, color.g, color.b, color.a),
        "colors": colors if len(colors) else None,
    }


def pose_of(frames: Mapping[str, Any], name: str) -> Any:
    """Returns a frame's pose in the fixed frame as a `viser.transforms.SE3`."""
    transform = frames[name].transform
    at, turn = transform.translation, transform.rotation
    pose = SE3(np.array([turn.w, turn.x, turn.y, turn.z, at.x, at.y, at.z]))
    parent = frames[name].header.frame_id
    return pose_of(frames, parent) @ pose if parent in frames else pose


def to_message(world: World) -> WorldMessage:
    if not world:
        return WorldMessage(preset="gymnasium")
    return WorldMessage(parameters=[WorldParameter(name, *ends) for name, ends in world.items()])


def to_world(message: WorldMessage) -> World:
    return {each.name: (each.low, each.high) for each in message.parameters}


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
