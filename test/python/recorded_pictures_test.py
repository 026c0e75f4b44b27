"""Pictures resemble Gymnasium's in test/recordings/pictures, and scale with width and height."""

import pathlib

import numpy as np
import pytest
from bipedal_walker_reference import Actions as WalkerActions
from mujoco_reference import Actions as RobotActions
from mujoco_reference import action_size
from picture_comparison import MAX_DIFFERENCE
from PIL import Image
from skimage.metrics import structural_similarity
from walkers import IDS, ROBOTS, make_ours

FOLDER = pathlib.Path(__file__).resolve().parents[1] / "recordings" / "pictures"
NAMES = sorted(path.stem for path in FOLDER.glob("*.png"))
SHRINKING = 4  # record_pictures.py shrinks Walker2d's pictures by this
WALKS = pytest.mark.parametrize(("env_id", "seed"), [(IDS[0], 6), (IDS[1], 4)])


def drawn(env_id, kind, seed, num_steps, **camera):
    """Returns the picture after an episode's first steps."""
    environment = make_ours(env_id, render_mode="rgb_array", **camera)
    if env_id in ROBOTS:
        actions = RobotActions(kind, seed, action_size(env_id))
    else:
        actions = WalkerActions(kind, seed)
    observation, _ = environment.reset(seed=seed)
    for _ in range(num_steps):
        observation, *_ = environment.step(actions.draw(observation).astype(np.float32))
    return environment.render()


def recorded(name):
    return np.asarray(Image.open(FOLDER / f"{name}.png").convert("RGB"))


def shrunk(picture, factor):
    return np.asarray(Image.fromarray(picture).reduce(factor))


def similarity(one, other):
    return structural_similarity(one, other, channel_axis=2)


@pytest.mark.parametrize("name", NAMES)
def test_looks_as_gymnasiums(name):
    env_id, kind, seed, num_steps = name.split("_")
    episode = (env_id, kind, int(seed), int(num_steps))
    least_similarity, most_others = 0.995, 0.0005
    if env_id in ROBOTS:
        ours = shrunk(drawn(*episode, camera_name="track"), SHRINKING)
        least_similarity, most_others = 0.96, 0.002
    else:
        ours = drawn(*episode)
    theirs = recorded(name)
    assert similarity(ours, theirs) > least_similarity
    differs = np.abs(ours.astype(int) - theirs).max(axis=2) > MAX_DIFFERENCE
    assert differs.mean() < most_others


def palette(picture):
    colors, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    return dict(zip(map(tuple, colors.tolist()), counts.tolist()))


@WALKS
def test_colors_are_gymnasiums(env_id, seed):
    """Colours that cover more than a blended edge are equal; structural similarity would not detect
    a small difference in colour."""
    ours = palette(drawn(env_id, "heuristic", seed, 0))
    theirs = palette(recorded(f"{env_id}_heuristic_{seed}_0"))
    compared = {color: count for color, count in theirs.items() if count >= 60}
    assert len(compared) >= 11  # sky, clouds, ground, hull, legs, outlines, flag
    for color, count in compared.items():
        assert ours[color] == pytest.approx(count, rel=0.05), color


@WALKS
@pytest.mark.parametrize("num_steps", [0, 9, 40, 150])
def test_height_scales(env_id, seed, num_steps):
    episode = (env_id, "heuristic", seed, num_steps)
    picture = drawn(*episode)
    large = drawn(*episode, width=1800, height=1200)
    assert large.shape == (1200, 1800, 3)
    assert similarity(shrunk(large, 3), picture) > 0.97
    small = drawn(*episode, width=300, height=200)
    assert similarity(small, shrunk(picture, 2)) > 0.95


def test_draws_larger_than_the_models_buffer():
    episode = ("Walker2d-v5", "saturated", 2, 10)
    large = drawn(*episode, camera_name="track", width=1000, height=960)
    assert large.shape == (960, 1000, 3)
    assert similarity(shrunk(large, 2), drawn(*episode, camera_name="track", width=500)) > 0.9
