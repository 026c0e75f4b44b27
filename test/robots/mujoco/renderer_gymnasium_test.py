"""Images against those of the installed Gymnasium in the same states, and the choice of OpenGL.

MuJoCo 2.2.2 filters the floor slightly differently from Gymnasium's version here. This sometimes
leaves a stray shadow of some 20 by 20 pixels on the floor.
"""

import numpy as np
import pytest
from mujoco_reference import IDS, draw_episode, robot_of
from picture_comparison import compare
from walkers import make_ours, run_python

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


def pairs(environment_id, camera):
    """Yields our image and Gymnasium's for each of STATES."""
    ours = make_ours(environment_id, render_mode="rgb_array", **camera)
    for kind, chosen, steps in STATES:
        seed = RANDOM_SEEDS[robot_of(environment_id)] if chosen is None else chosen
        ours.reset(seed=seed)
        for actions, theirs in draw_episode(environment_id, kind, seed, steps, **camera):
            for action in actions:
                ours.step(action)
            yield ours.render(), theirs


@pytest.mark.parametrize("camera", [{}, {"camera_name": "track"}], ids=str)
@pytest.mark.parametrize("environment_id", IDS)
def test_pictures_are_gymnasiums(environment_id, camera, capsys):
    similarities, others = compare(
        pairs(environment_id, camera), f"{environment_id}, {camera}", capsys
    )
    assert len(similarities) == 20
    assert min(similarities) > 0.97
    assert max(others) < 500


PICTURE = """
import gymnasium, numpy, walker_sim
environment = gymnasium.make("walker_sim/Walker2d-v5", render_mode="rgb_array")
environment.reset(seed=4)
for _ in range(10):
    environment.step(numpy.full(6, 0.5))
print(environment.render().tobytes().hex())
"""


def picture_by(library, **variables):
    """Returns the raw bytes of an image of a walker after ten steps, with MUJOCO_GL=`library`."""
    return bytes.fromhex(run_python(PICTURE, MUJOCO_GL=library, **variables)[0])


def error_by(library, **variables):
    return run_python(PICTURE, status=1, MUJOCO_GL=library, **variables)[1]


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
    assert picture_by("", **broken_libraries("libEGL.so.1")) == picture_by("osmesa")


@pytest.mark.parametrize("library", ["", "egl", "osmesa"])
def test_without_opengl_the_error_says_what_to_install(broken_libraries, library):
    message = error_by(library, **broken_libraries("libEGL.so.1", "libOSMesa.so.8"))
    packages = "libegl1, libegl-mesa0 and libgl1-mesa-dri, or libosmesa6"
    assert f"install the packages {packages}" in message
    assert ("libEGL.so.1" in message) == (library != "osmesa")
    assert ("libOSMesa.so.8" in message) == (library != "egl")


def test_osmesa_beside_an_egl_that_all_see_is_refused():
    """MuJoCo would call EGL's functions in OSMesa's context."""
    message = error_by("osmesa", LD_PRELOAD="libEGL.so.1")
    assert "another part of this process has loaded EGL" in message
