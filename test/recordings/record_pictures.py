"""Writes Gymnasium's renderings to pictures/, for test/python/recorded_pictures_test.py.

    export PYTHONPATH=test:test/robots/bipedal_walker:test/robots/mujoco
    python test/recordings/record_pictures.py

Needs gymnasium[box2d,mujoco] 1.4.0 with box2d 2.3.10, pygame 2.6.1, mujoco 4.0.0, OpenGL, NumPy 2
and pillow. A picture's name is ID_KIND_SEED_STEP. Walker2d is rendered with the model's camera
`track` and reduced to a quarter of its width and height.
"""

from __future__ import annotations

import pathlib

import bipedal_walker_reference
import mujoco_reference
import numpy as np
from PIL import Image

FOLDER = pathlib.Path(__file__).parent / "pictures"

# ID, kind of actions, seed, steps. They show walking, falls to either side, pits, stumps, stairs,
# the flag, the far end, and lidar rays that hit and that miss.
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
    """Writes a lossless PNG, with a palette if the picture has at most 256 colors."""
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
