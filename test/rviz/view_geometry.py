"""Projection of points by rviz's orbit view, and poses of a robot's links from transforms."""

import pathlib
import xml.etree.ElementTree

import numpy as np
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]


def rotation_of(quaternion):
    """Returns the rotation matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_of_angles(roll, pitch, yaw):
    """Returns the rotation matrix of URDF's angles: about the fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


class View:
    def __init__(self, robot):
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
        self.axes = rotation_of_angles(*angles)
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
        own = rotation_of([turn.x, turn.y, turn.z, turn.w])
        return position + rotation @ [shift.x, shift.y, shift.z], rotation @ own

    return {frame: pose(frame) for frame in frames}
