"""Projection of points by rviz's orbit view, and poses of a robot's links from transforms."""

import pathlib
import xml.etree.ElementTree

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

ROOT = pathlib.Path(__file__).resolve().parents[2]


class View:
    def __init__(self, robot):
        self.robot = robot
        text = (ROOT / "config" / f"{robot}.rviz").read_text(encoding="utf-8")
        self._view = yaml.safe_load(text)["Visualization Manager"]["Views"]["Current"]
        assert self._view["Class"] == "rviz/Orbit"
        self.target = self._view["Target Frame"]

    def project(self, points, target, size):
        """Returns the pixels (n, 2) of world points (n, 3) in a picture of size (width, height).

        The camera orbits the focal point, which is relative to the target frame's origin, along the
        fixed frame's axes. Pitch is the camera's elevation above the focal point [rad].
        """
        view, (width, height) = self._view, size
        yaw, pitch = view["Yaw"], view["Pitch"]
        backward = np.array(
            [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
        )
        focal = np.asarray(target) + [view["Focal Point"][axis] for axis in "XYZ"]
        right = np.array([-np.sin(yaw), np.cos(yaw), 0])
        upward = np.cross(backward, right)
        arms = np.atleast_2d(points) - (focal + view["Distance"] * backward)
        depth = -arms @ backward
        focal_length = height / 2 / np.tan(view["Field of View"] / 2)  # [pixel]
        return np.stack(
            [
                width / 2 + focal_length * (arms @ right) / depth,
                height / 2 - focal_length * (arms @ upward) / depth,
            ],
            axis=1,
        )


class Shape:
    """Visible shape of a link: a colour, and the box around its first shape.

    Attributes
    ----------
    center : ndarray
        Centre of the box, in the link's frame [m].
    axes : ndarray
        Directions of the box's edges, as columns.
    half : ndarray
        Half the lengths of the box's edges [m].
    """

    def __init__(self, link):
        self.name = link.get("name")
        visual, collision = link.find("visual"), link.find("collision")
        color = visual.find("material/color").get("rgba")
        self.color = 255 * np.array([float(part) for part in color.split()[:3]])
        origin = collision.find("origin")
        self.center = np.array([float(x) for x in origin.get("xyz").split()])
        angles = [float(x) for x in origin.get("rpy", "0 0 0").split()]
        self.axes = Rotation.from_euler("xyz", angles).as_matrix()  # about the fixed axes
        geometry = collision.find("geometry")[0]
        if geometry.tag == "box":
            self.half = np.array([float(x) for x in geometry.get("size").split()]) / 2
        elif geometry.tag == "cylinder":
            radius, length = float(geometry.get("radius")), float(geometry.get("length"))
            self.half = np.array([radius, radius, length / 2 + radius])  # with the caps
        else:  # the hull: its mesh surrounds its centre of mass
            self.center = self.center + [
                float(x) for x in link.find("inertial/origin").get("xyz").split()
            ]
            self.half = np.array([0.9, 0.2, 0.25])

    def at(self, pose, local=(0, 0, 0)):
        """Returns the world position of a point, given from the box's centre along the edges."""
        position, rotation = pose
        return position + rotation @ (self.center + self.axes @ np.asarray(local))

    def covers(self, pose, point, margin):
        """Whether the world point, seen along y, is in the box or less than `margin` outside."""
        position, rotation = pose
        local = self.axes.T @ (rotation.T @ (point - position) - self.center)
        return bool((abs(local) < self.half + margin)[[0, 2]].all())


def shapes_of(robot):
    tree = xml.etree.ElementTree.parse(ROOT / "urdf" / f"{robot}.urdf")
    links = [link for link in tree.getroot().findall("link") if link.find("visual") is not None]
    return {link.get("name"): Shape(link) for link in links}


def world_poses(transforms, frames):
    """Returns each frame's position and rotation matrix in odom, from the transforms by frame."""

    def pose(frame):
        if frame == "odom":
            return np.zeros(3), np.eye(3)
        transform = transforms[frame]
        position, rotation = pose(transform.header.frame_id)
        shift, turn = transform.transform.translation, transform.transform.rotation
        own = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        return position + rotation @ [shift.x, shift.y, shift.z], rotation @ own

    return {frame: pose(frame) for frame in frames}
