"""Makes the pictures in the folder beside it: what Gymnasium draws, for tests that need none of it.

    PYTHONPATH=test:test/bipedal_walker python test/recordings/record_pictures.py

needs gymnasium[box2d] 1.4.0 with box2d 2.3.10, pygame 2.6.1, NumPy 2 and pillow. test/pictures.h
reads them. A picture's name is ID_KIND_SEED_STEP.
"""

from __future__ import annotations

import pathlib

from bipedal_walker_reference import IDS, draw_episode
from PIL import Image

FOLDER = pathlib.Path(__file__).parent / "pictures"

# ID, kind of the actions, seed, steps: walks, falls to either side, pits, stumps, stairs, the flag,
# the far end, rays that hit and that do not.
BIPEDAL_WALKER = (
    (IDS[0], "heuristic", 6, (0, 9, 150, 1544)),
    (IDS[0], "noisy", 14, (83,)),
    (IDS[1], "heuristic", 4, (0, 200, 610)),
    (IDS[1], "saturated", 9, (82,)),
)


def write(name, picture):
    """Without loss. Where it has few colors the file stores their numbers, and is small."""
    image = Image.fromarray(picture)
    if image.getcolors() is not None:
        image = image.quantize(256)
    assert image.convert("RGB").tobytes() == picture.tobytes()
    image.save(FOLDER / f"{name}.png", optimize=True)


def record_bipedal_walker():
    for environment_id, kind, seed, steps in BIPEDAL_WALKER:
        for step, (_, picture) in enumerate(draw_episode(environment_id, kind, seed)):
            if step in steps:
                write(f"{environment_id}_{kind}_{seed}_{step}", picture)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    record_bipedal_walker()
