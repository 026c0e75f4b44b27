"""What a server's topics have shown, as a page draws it."""

from __future__ import annotations

import queue
import threading
from typing import Any, Mapping, Sequence

import numpy as np
import rospy
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from viser.transforms import SE3
from visualization_msgs.msg import Marker, MarkerArray

from walker_sim.msg import Episode
from walker_sim.web.scene import Drawing, Scene

MAX_STATES = 20
"""States that wait for their frames or for their markers."""
KINDS = {
    Marker.TRIANGLE_LIST: "triangles",
    Marker.LINE_LIST: "lines",
    Marker.LINE_STRIP: "line_strip",
    Marker.SPHERE_LIST: "spheres",
}

Poses = NDArray[np.float64]
"""Of the links, shape (links, 7): position [m] and quaternion w, x, y, z."""


class TopicBuffer:
    """Keeps the latest messages until the page's loop shows them. They come in threads of rospy's.

    `links` are the names of the specification's links, the trunk first. `subscribe` takes whether
    messages are wanted. `prefix` is that of the frames, `trunk` the trunk's latest pose, `progress`
    the latest message about the episode; each is None until a message has shown it.
    """

    def __init__(self, namespace: str, links: Sequence[str], joints: Sequence[str]) -> None:
        self._lock = threading.Lock()
        self._links, self._joints = links, joints
        self._fixed: dict[str, Any] = {}  # static frames by name
        self.clear()
        self._topics = (
            (f"{namespace}/scene_markers", MarkerArray, self._take_scene, 20),
            (f"{namespace}/state_markers", MarkerArray, self._take_state, 2),
            ("/tf_static", TFMessage, self._take_fixed_frames, 20),
            ("/tf", TFMessage, self._take_frames, 20),
            (f"{namespace}/joint_states", JointState, self._take_joints, 2),
            (f"{namespace}/episode", Episode, self._take_progress, 2),
            (f"{namespace}/progress", Episode, self._take_progress, 2),
        )
        self.subscribe: queue.SimpleQueue[bool] = queue.SimpleQueue()
        threading.Thread(target=self._subscribe, daemon=True).start()

    def _subscribe(self) -> None:
        """Waits for the master, however long it is gone; therefore a thread of its own."""
        subscribers: list[rospy.Subscriber] = []
        while True:
            is_wanted = self.subscribe.get()
            while subscribers:
                subscribers.pop().unregister()
            for name, kind, take, size in self._topics * is_wanted:
                subscriber = rospy.Subscriber(name, kind, take, queue_size=size, tcp_nodelay=True)
                subscribers.append(subscriber)

    def clear(self) -> None:
        """Forgets what a server that is gone has shown."""
        with self._lock:
            self.prefix: str | None = None
            self.trunk: Any = None
            self.progress: Any = None
            self._scene: tuple[Any, list[Drawing]] | None = None  # stamp and drawings
            self._floor: list[Drawing] = []
            self._poses: dict[Any, Poses] = {}  # by stamp
            self._drawings: dict[Any, list[Drawing]] = {}  # by stamp
            self._shown: tuple[Any, Poses, dict[str, Drawing]] | None = None
            self._unplaced: Any = None  # the latest frames before the prefix was known
            self.angles: list[float] = [np.nan] * len(self._joints)

    def show(self, scene: Scene) -> None:
        """Shows the latest surroundings, and the latest state that has both frames and markers."""
        with self._lock:
            begun, self._scene = self._scene, None
            complete = self._poses.keys() & self._drawings.keys()
            if complete:
                latest = max(complete)
                drawings = {each["name"]: each for each in [*self._floor, *self._drawings[latest]]}
                before = self._shown[2] if self._shown else {}  # the path is not in each message
                self._shown = latest, self._poses[latest], {**before, **drawings}
                self._floor = []
                for states in (self._poses, self._drawings):
                    for stamp in [stamp for stamp in states if stamp <= latest]:
                        del states[stamp]
            if begun and self._shown and self._shown[0] < begun[0]:
                self._shown = None  # of the episode before
            shown = self._shown
        if begun:
            scene.begin(begun[1])
        if shown and (begun or complete):
            scene.show(shown[1], list((shown[2] if begun else drawings).values()))

    def _take_scene(self, message: Any) -> None:
        drawings = drawings_of(message)
        cleared = [each for each in message.markers if each.action == Marker.DELETEALL]
        with self._lock:
            if cleared:
                self._scene, self._floor = (cleared[0].header.stamp, drawings), []
            else:  # only the floor, which has moved with the walker
                self._floor = drawings

    def _take_state(self, message: Any) -> None:
        drawings = drawings_of(message)
        if not message.markers:
            return
        header = message.markers[0].header
        with self._lock:
            self.prefix = header.frame_id.rpartition("/")[0]
            keep(self._drawings, header.stamp, drawings)
            unplaced, self._unplaced = self._unplaced, None
        if unplaced is not None:
            self._take_frames(unplaced)

    def _take_fixed_frames(self, message: Any) -> None:
        self._fixed = {**self._fixed, **by_name(message)}

    def _take_frames(self, message: Any) -> None:
        if self.prefix is None:
            self._unplaced = message
            return
        names = [f"{self.prefix}/{link}".lstrip("/") for link in self._links]
        frames = {**self._fixed, **by_name(message)}
        if not all(name in frames for name in names):
            return  # of another walker
        poses = np.array([pose_of(frames, name).wxyz_xyz for name in names])
        poses = np.roll(poses, 3, axis=1)  # position first
        with self._lock:
            self.trunk = poses[0]
            keep(self._poses, frames[names[0]].header.stamp, poses)

    def _take_joints(self, message: Any) -> None:
        angles = dict(zip(message.name, message.position))
        self.angles = [angles.get(joint, np.nan) for joint in self._joints]

    def _take_progress(self, message: Any) -> None:
        with self._lock:
            before = self.progress
            if before is None or message.header.stamp >= before.header.stamp:
                self.progress = message  # else of the other topic, which is behind


def keep(states: dict[Any, Any], stamp: Any, state: Any) -> None:
    """Adds a state, and drops the oldest ones, or those of a server that has begun again."""
    if states and stamp < max(states):
        states.clear()
    states[stamp] = state
    if len(states) > MAX_STATES:
        del states[min(states)]


def drawings_of(message: Any) -> list[Drawing]:
    """Returns what the server's markers show and remove, without texts."""
    markers = message.markers
    return [
        to_drawing(each) for each in markers if each.type in KINDS or each.action == Marker.DELETE
    ]


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


def by_name(message: Any) -> dict[str, Any]:
    return {each.child_frame_id: each for each in message.transforms}


def pose_of(frames: Mapping[str, Any], name: str) -> Any:
    """Returns a frame's pose in the fixed frame as a `viser.transforms.SE3`."""
    transform = frames[name].transform
    at, turn = transform.translation, transform.rotation
    pose = SE3(np.array([turn.w, turn.x, turn.y, turn.z, at.x, at.y, at.z]))
    parent = frames[name].header.frame_id
    return pose_of(frames, parent) @ pose if parent in frames else pose
