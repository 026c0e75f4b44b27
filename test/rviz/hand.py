"""The mouse and the keyboard of a screen with rviz."""

import os
import subprocess

import numpy as np
from stage import wait_for
from view_geometry import View, shapes_of, world_poses


class Hand:
    """The mouse and the keyboard of the screen."""

    def __init__(self, screen):
        self._screen = screen

    def do(self, *arguments):
        subprocess.run(
            ["xdotool", *map(str, arguments)],
            env={**os.environ, "DISPLAY": self._screen.display},
            check=True,
        )

    def click(self, point):
        self.do("mousemove", *point, "click", 1)

    def find(self, color):
        """Returns the centre of the icon of this colour; None if the screen does not show it."""
        picture = np.asarray(self._screen.grab().convert("RGB")).astype(int)
        rows, columns = np.nonzero((abs(picture - color) < 6).all(axis=2))
        return (int(columns.mean()), int(rows.mean())) if len(rows) > 40 else None

    def press(self, color):
        """Clicks the button with the icon of this colour."""
        self.click(wait_for(lambda: self.find(color), f"the button of the colour {color}"))


def trunk_of(env):
    """Returns the names of the robot and of its trunk's link."""
    return ("bipedal_walker", "hull") if env.startswith("Bipedal") else ("walker2d", "torso")


def trunk_pixel(show, env, stamp):
    """Returns the column and row of the screen where rviz shows the trunk's centre at this time."""
    robot, trunk = trunk_of(env)
    view = View(robot)
    frames = [trunk, view.target]
    poses = world_poses(show.transforms_at(stamp, frames), frames)
    left, upper, right, lower = show.picture_box()
    centre = shapes_of(robot)[trunk].at(poses[trunk])
    size = (right - left, lower - upper)
    pixel = view.project(centre, poses[view.target][0], size)[0]
    return np.add(pixel, (left, upper)).round().astype(int)
