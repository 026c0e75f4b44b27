"""rviz draws each walker at the poses of its transforms and logs neither warnings nor errors."""

import os
import re

import numpy as np
import pytest
import yaml
from stage import Stage, wait_for
from view_geometry import ROOT, View, shapes_of, world_poses

WALKERS = {
    "BipedalWalker-v3": "bipedal_walker",
    "BipedalWalkerHardcore-v3": "bipedal_walker",
    "Walker2d-v5": "walker2d",
    "Hopper-v5": "hopper",
}
# Unavoidable log lines that this package's configuration does not cause.
ALLOWED = [
    # rviz looks for plugins of a package that distributions do not ship.
    r"\[rospack\] Error: no such package media_export",
    r"\[librospack\]: error while executing command",
]
# Colours of a display's name in rviz's list, by status.
STATUS_OK, STATUS_WARN, STATUS_ERROR = (40, 120, 197), (192, 128, 0), (192, 32, 32)
PATCH = 3  # half the size of the patch around a point [pixel]


def share_of_color(picture, pixel, color):
    """Returns the share of the patch around the pixel that has the colour, lit or slightly shaded.

    Pixels of the range finder's red rays, which may cross the patch, are ignored.
    """
    column, row = np.round(pixel).astype(int)
    patch = picture[row - PATCH : row + PATCH + 1, column - PATCH : column + PATCH + 1]
    if patch.shape[:2] != (2 * PATCH + 1, 2 * PATCH + 1):
        return 0.0  # outside the picture
    values = patch.reshape(-1, 3).astype(float)
    values = values[values[:, 0] - values[:, 1:].max(axis=1) < 60]
    if len(values) < PATCH * PATCH:
        return 0.0  # mostly rays
    brightness = values @ color / (color @ color)
    distances = abs(values - brightness[:, None] * color).max(axis=1)
    return float(((distances < 12) & (brightness > 0.6) & (brightness < 1.1)).mean())


class Observer:
    def __init__(self, show, robot):
        self._show = show
        self._view = View(robot)
        self._shapes = shapes_of(robot)
        # Free radius around a link's centre [m]; the hopper's leg ends near the middle of its foot.
        self._margin = 0.02 if robot == "hopper" else 0.05

    def poses(self, transition):
        frames = [*self._shapes, self._view.target]
        return world_poses(self._show.transforms_at(transition.header.stamp, frames), frames)

    def is_free(self, poses, point, margin, but=None):
        """Whether no link except `but` is within `margin` of the line of sight to the point."""
        return not any(
            shape.covers(poses[name], point, margin)
            for name, shape in self._shapes.items()
            if name != but
        )

    def all_centers_are_free(self, poses):
        return all(
            self.is_free(poses, shape.at(poses[name]), self._margin, but=name)
            for name, shape in self._shapes.items()
        )

    def points_beside(self, poses, name):
        """Returns the points close to both flanks of the link that no link covers."""
        shape = self._shapes[name]
        distance = shape.half[0] + shape.half[1] / 2 + 0.05  # the top is visible as well
        across = [shape.at(poses[name], (side * distance, 0, 0)) for side in (-1, 1)]
        if name == "hull":
            across = [shape.at(poses[name], (0, 0, shape.half[2] + 0.2))]
        return [point for point in across if self.is_free(poses, point, 0.03)]

    def complaints(self, poses):
        image = self._show.picture()
        picture = np.asarray(image)
        target = poses[self._view.target][0]
        found, beside = [], 0

        def share(point, color):
            pixel = self._view.project(point, target, image.size)[0]
            return share_of_color(picture, pixel, color), pixel.round()

        for name, shape in self._shapes.items():
            seen, pixel = share(shape.at(poses[name]), shape.color)
            if seen < 0.6:
                found.append(f"{name}: {seen:.0%} of its colour at {pixel}, where its centre is")
            for point in self.points_beside(poses, name):
                beside += 1
                seen, pixel = share(point, shape.color)
                if seen > 0.2:
                    found.append(f"{name}: {seen:.0%} of its colour at {pixel}, beside it")
        assert beside >= len(self._shapes) / 2, "hardly a point beside a link is free"
        return found

    def check(self, transition, picture_file):
        poses = self.poses(transition)
        last = []

        def is_right():
            last[:] = self.complaints(poses)
            return not last

        try:
            wait_for(is_right, "rviz to show the walker where it is")
        except AssertionError as error:
            self._show.picture().save(picture_file)
            raise AssertionError(f"{error}: {last}; the picture is {picture_file}") from None

    def walk(self, transition, distance):
        """Steps until the trunk has moved by `distance` and no link hides another's centre."""
        goal = self.poses(transition)[self._view.target][0][0] + distance
        for _ in range(400):
            transition = self._show.walk(transition)
            assert not (transition.terminated or transition.truncated), "the gait was to walk"
            poses = self.poses(transition)
            if poses[self._view.target][0][0] >= goal and self.all_centers_are_free(poses):
                return transition
        raise AssertionError("the gait never shows all links")


def complaints_in(log):
    lines = re.sub(r"\x1b\[[0-9;]*m", "", log).splitlines()
    bad = [line for line in lines if re.search(r"error|warn|fatal|fail|died", line, re.IGNORECASE)]
    return [line for line in bad if not any(re.search(allowed, line) for allowed in ALLOWED)]


@pytest.fixture(name="stage", scope="module")
def start_stage():
    stage = Stage()
    yield stage
    stage.close()


def pixels_of(picture, color):
    return int((np.asarray(picture) == color).all(axis=2).sum())


def check_statuses(show, robot, folder):
    """Starts rviz with its list visible: no name has the colour of a warning or an error."""
    path = ROOT / "config" / f"{robot}.rviz"
    configuration = yaml.safe_load(path.read_text(encoding="utf-8"))
    configuration["Window Geometry"]["Hide Left Dock"] = False
    shown = [d for d in configuration["Visualization Manager"]["Displays"] if d["Enabled"]]
    copy = folder / "with_list.rviz"
    copy.write_text(yaml.safe_dump(configuration), encoding="utf-8")
    show.start(["rviz", "-d", os.fspath(copy), "__name:=second_rviz"])

    def all_are_fine():
        screen = show.screen.grab()
        if pixels_of(screen, STATUS_ERROR) or pixels_of(screen, STATUS_WARN):
            return False
        return pixels_of(screen, STATUS_OK) >= 30 * len(shown)

    try:
        wait_for(all_are_fine, "rviz's list of displays, all well")
    except AssertionError:
        show.screen.grab().save(folder / "screen.png")
        raise


@pytest.mark.parametrize("env", WALKERS)
def test_rviz_shows_the_walker_where_it_is(stage, env, tmp_path):
    robot = WALKERS[env]
    with stage.show(env, "heuristic") as show:  # its links rarely hide each other
        observer = Observer(show, robot)
        transition = observer.walk(show.reset(seed=0), 0)
        observer.check(transition, tmp_path / "first.png")
        # Much further than a link's width: a view that does not follow fails the check.
        transition = observer.walk(transition, 1)
        observer.check(transition, tmp_path / "second.png")
        check_statuses(show, robot, tmp_path)
        assert complaints_in(show.log()) == []
