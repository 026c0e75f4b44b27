"""Makes the pictures in the folder beside it: what Gymnasium draws, for tests that need none of it.

    export PYTHONPATH=test:test/robots/bipedal_walker:test/robots/mujoco
    python test/recordings/record_pictures.py

needs gymnasium[box2d,mujoco] 1.4.0 with box2d 2.3.10, pygame 2.6.1, mujoco 4.0.0, OpenGL, NumPy 2
and pillow. test/pictures.h reads them. A picture's name is ID_KIND_SEED_STEP. Walker2d's are seen
by the model's camera `track`, at a quarter of their size.
"""

from __future__ import annotations

import pathlib

import bipedal_walker_reference
import mujoco_reference
import numpy as np
from PIL import Image

FOLDER = pathlib.Path(__file__).parent / "pictures"

# ID, kind of the actions, seed, steps: walks, falls to either side, pits, stumps, stairs, the flag,
# the far end, rays that hit and that do not.
BIPEDAL_WALKER = (
    (bipedal_walker_reference.IDS[0], "heuristic", 6, (0, 9, 150, 1544)),
    (bipedal_walker_reference.IDS[0], "noisy", 14, (83,)),
    (bipedal_walker_reference.IDS[1], "heuristic", 4, (0, 200, 610)),
    (bipedal_walker_reference.IDS[1], "saturated", 9, (82,)),
)
WALKER2D = (
    (mujoco_reference.IDS[0], "balance", 1, (0, 60)),
    (mujoco_reference.IDS[1], "saturated", 2, (0, 10, 20)),
)
SHRINKING = 4


def write(name, picture):
    """Without loss. Where it has few colors the file stores their numbers, and is small."""
    image = Image.fromarray(picture)
    if image.getcolors() is not None:
        image = image.quantize(256)
    assert image.convert("RGB").tobytes() == picture.tobytes()
    image.save(FOLDER / f"{name}.png", optimize=True)


def record_bipedal_walker():
    for environment_id, kind, seed, steps in BIPEDAL_WALKER:
        for step, (_, picture) in enumerate(
            bipedal_walker_reference.draw_episode(environment_id, kind, seed)
        ):
            if step in steps:
                write(f"{environment_id}_{kind}_{seed}_{step}", picture)


def record_walker2d():
    for environment_id, kind, seed, steps in WALKER2D:
        episode = mujoco_reference.draw_episode(
            environment_id, kind, seed, steps, camera_name="track"
        )
        for step, (_, picture) in zip(steps, episode):
            small = Image.fromarray(picture).reduce(SHRINKING)
            write(f"{environment_id}_{kind}_{seed}_{step}", np.asarray(small))


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    record_bipedal_walker()
    record_walker2d()
