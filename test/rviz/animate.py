"""Makes the animations of README.md and docs/worlds.md in rviz, one picture every few steps."""

import os
import sys
from types import MappingProxyType
from typing import Mapping, NamedTuple

from hand import Hand, trunk_pixel
from PIL import Image
from stage import Stage
from view_geometry import ROOT

WIDTH = 640  # animation width [pixel]
MAX_BYTES = 2_000_000
COLORS = 128


class Scene(NamedTuple):
    """Range of an episode's steps that is shown.

    Attributes
    ----------
    env : str
        Id of the environment.
    seed : int
        Seed of the episode.
    first, last : int
        Step numbers of the first and last pictures.
    stride : int
        Steps from one picture to the next.
    duration : int
        Display time of each picture [ms], a multiple of GIF's unit of 10 ms.
    pushes : dict
        Maps a step to the pixels to the right by which the mouse then drags the trunk; 0: lets go.
    world : str
        Preset. In another world than Gymnasium's, and if it is pushed, the robust policy walks.
    """

    env: str
    seed: int
    first: int
    last: int
    stride: int
    duration: int
    pushes: Mapping[int, int] = MappingProxyType({})
    world: str = "gymnasium"


PUSHES = MappingProxyType({90: -120, 102: 0, 189: 130, 201: 0})

# In real time: 3 steps of 0.02 s in 60 ms; 8 steps of 0.008 s in 60 ms.
SCENES = {
    "bipedal_walker": Scene("BipedalWalker-v3", 0, 0, 300, 3, 60, PUSHES),
    "bipedal_walker_hardcore": Scene("BipedalWalkerHardcore-v3", 3, 120, 420, 3, 60),
    "walker2d": Scene("Walker2d-v5", 0, 40, 600, 8, 60),
    "med_pit_gap": Scene("BipedalWalker-v3", 0, 0, 240, 3, 60, world="med_pit_gap"),
    "walker2d_stairs": Scene("Walker2d-v5", 3, 40, 520, 8, 60, world="walker2d_stairs"),
}


def take_pictures(stage, scene):
    env = scene.env
    is_plain = scene.world == "gymnasium" and not scene.pushes
    agent, world = "shipped" if is_plain else "robust", f"world:={scene.world}"
    with stage.show(env, agent, arguments=[world]) as show:
        hand, place = Hand(show.screen), None
        if scene.pushes:
            left, upper, _, _ = show.picture_box()
            hand.click((left + 30, upper + 30))
            hand.do("key", "u")  # the tool that pushes
        transition = show.reset(scene.seed)
        pictures = [show.settled_picture(times=20)]
        while transition.step < scene.last:
            transition = show.walk(transition)
            if transition.terminated or transition.truncated:
                raise SystemExit(f"{env}, seed {scene.seed}: ended at step {transition.step}")
            drag = scene.pushes.get(transition.step)
            if drag:
                place = trunk_pixel(show, env, transition.header.stamp)
                hand.do("mousemove", *place, "mousedown", 1)
                place[0] += drag
            elif drag == 0:
                hand.do("mouseup", 1)
                place = None
            if place is not None:
                # The goal moves with the camera, which follows the walker, when the mouse moves.
                hand.do("mousemove", place[0] + transition.step % 2, place[1])
            if transition.step % scene.stride == 0:
                pictures.append(show.settled_picture(before=pictures[-1]))
                if transition.step <= scene.first:
                    pictures = pictures[-1:]
        return pictures


def write_animation(pictures, duration, path):
    """Writes a GIF with one palette for all pictures, which prevents flicker.

    The octree keeps the colours of small areas (walker and contacts) beside the ground's.
    """
    height = round(WIDTH * pictures[0].height / pictures[0].width)
    small = [picture.resize((WIDTH, height), Image.Resampling.LANCZOS) for picture in pictures]
    sheet = Image.new("RGB", (WIDTH, height * 8))
    for i in range(8):
        sheet.paste(small[i * (len(small) - 1) // 7], (0, i * height))
    palette = sheet.quantize(COLORS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    frames = [
        picture.quantize(palette=palette, dither=Image.Dither.NONE).copy() for picture in small
    ]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=duration, loop=0, optimize=True
    )
    size = os.path.getsize(path)
    seconds = len(frames) * duration / 1000
    print(f"{path}: {len(frames)} pictures, {seconds:.1f} s, {size / 1e6:.2f} MB")
    if size > MAX_BYTES:
        raise SystemExit(f"{path}: {size} bytes; must be at most {MAX_BYTES}")


def main():
    stage = Stage()
    try:
        for name in sys.argv[1:] or SCENES:
            pictures = take_pictures(stage, SCENES[name])
            write_animation(pictures, SCENES[name].duration, ROOT / "docs" / f"{name}.gif")
    finally:
        stage.close()


if __name__ == "__main__":
    main()
