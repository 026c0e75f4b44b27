"""Images against those of the installed Gymnasium in the same states, and the choice of OpenGL.

MuJoCo 2.2.2 filters the floor slightly differently from Gymnasium's version here. This sometimes
leaves a stray shadow of some 20 by 20 pixels on the floor.
"""

import os

import numpy as np
import pytest
from mujoco_reference import IDS, draw_episode, robot_of
from picture_comparison import compare
from rollout_tool import Refused, Rollout

SIZE = 480
# Kind of the actions, seed, steps. They cover standing, reaching out, falling forward and backward.
STATES = (
    ("balance", 1, (0, 20, 40, 60, 80, 100)),
    ("saturated", 2, (0, 5, 10, 15, 20)),
    ("random", None, (4, 8, 12, 16)),
    ("outside", 5, (6, 12)),
    ("smooth", 7, (5, 15, 25)),
)
# The first seeds with sufficiently long episodes.
RANDOM_SEEDS = {"Walker2d": 3, "Hopper": 4}


def pairs(rollout, environment_id, **camera):
    """Yields our image and Gymnasium's for each of STATES."""
    rollout.make(environment_id)
    theirs_camera = {name: value for name, value in camera.items() if value}
    for kind, chosen, steps in STATES:
        seed = RANDOM_SEEDS[robot_of(environment_id)] if chosen is None else chosen
        rollout.reset(seed)
        for actions, theirs in draw_episode(environment_id, kind, seed, steps, **theirs_camera):
            if len(actions):
                rollout.step(actions)
            yield rollout.render(SIZE, SIZE, **camera), theirs


@pytest.mark.parametrize("camera_name", ["", "track"])
@pytest.mark.parametrize("environment_id", IDS)
def test_pictures_are_gymnasiums(rollout, environment_id, camera_name, capsys):
    similarities, others = compare(
        pairs(rollout, environment_id, camera_name=camera_name),
        f"{environment_id}, camera {camera_name!r}",
        capsys,
    )
    assert len(similarities) == 20
    assert min(similarities) > 0.97
    assert max(others) < 500


def picture_by(library, environment=None):
    """Returns the raw bytes of an image of a walker after ten steps, with MUJOCO_GL=`library`."""
    before = dict(os.environ)
    os.environ.update({"MUJOCO_GL": library, **(environment or {})})
    try:
        tool = Rollout()
    finally:
        os.environ.clear()
        os.environ.update(before)
    try:
        tool.make("Walker2d-v5")
        tool.reset(4)
        tool.step(np.full((10, 6), 0.5))
        return tool.render(SIZE, SIZE).tobytes()
    finally:
        tool.close()


def test_egl_and_osmesa_draw_the_same():
    by_egl = np.frombuffer(picture_by("egl"), np.uint8).astype(int)
    by_osmesa = np.frombuffer(picture_by("osmesa"), np.uint8).astype(int)
    assert by_egl.std() > 30
    assert np.abs(by_egl - by_osmesa).mean() < 1


def test_any_other_value_of_mujoco_gl_leaves_the_choice():
    assert picture_by("glfw") == picture_by("")


@pytest.fixture
def broken_libraries(tmp_path):
    """Returns a function that writes invalid libraries and returns the environment to load them."""

    def make(*names):
        for name in names:
            (tmp_path / name).write_text("no library")
        return {"LD_LIBRARY_PATH": str(tmp_path)}

    return make


def test_osmesa_where_there_is_no_egl(broken_libraries):
    assert picture_by("", broken_libraries("libEGL.so.1")) == picture_by("osmesa")


@pytest.mark.parametrize("library", ["", "egl", "osmesa"])
def test_without_opengl_the_error_says_what_to_install(broken_libraries, library):
    with pytest.raises(Refused) as refusal:
        picture_by(library, broken_libraries("libEGL.so.1", "libOSMesa.so.8"))
    message = str(refusal.value)
    assert (
        "install the packages libegl1, libegl-mesa0 and libgl1-mesa-dri, or libosmesa6" in message
    )
    assert ("libEGL.so.1" in message) == (library != "osmesa")
    assert ("libOSMesa.so.8" in message) == (library != "egl")


def test_osmesa_beside_an_egl_that_all_see_is_refused():
    """MuJoCo would call EGL's functions in OSMesa's context."""
    with pytest.raises(Refused, match="another part of this process has loaded EGL"):
        picture_by("osmesa", {"LD_PRELOAD": "libEGL.so.1"})
