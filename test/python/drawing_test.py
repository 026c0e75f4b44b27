"""Drawings of the core: links, surroundings and sensors as viewers without ROS show them."""

import gc
from collections import Counter

import numpy as np
import pytest
from walker_sim import WalkerEnv, _core
from walkers import IDS

STEP = 0.1  # height of the stairs' steps [m]
STAIRS = {"stair_height": STEP, "stair_width": 1, "stair_steps": 3, "ground_roughness": 0}
FAR = {"lidar_range": 50}


def begun(env_id, **keywords):
    environment = WalkerEnv(env_id, **keywords)
    return environment, environment.reset(seed=5)[0]


def capture(environment):
    return environment._walkers._pool.capture(0)


def by_name(drawings):
    return {drawing["name"]: drawing for drawing in drawings}


def edges(faces):
    """Counts the edges of triangles, each in its face's direction."""
    return Counter(
        (int(face[i]), int(face[(i + 1) % len(face)])) for face in faces for i in range(len(face))
    )


def volume(mesh):
    corners = mesh["vertices"].astype(float)[mesh["faces"]]
    return np.linalg.det(corners).sum() / 6


def in_world(link, pose):
    """Returns the vertices of a link's meshes in the world."""
    vertices = np.concatenate([mesh["vertices"] for mesh in link["meshes"]]).astype(float)
    w, vector = pose[3], pose[4:]
    across = 2 * np.cross(vector, vertices)
    return pose[:3] + vertices + w * across + np.cross(vector, across)


@pytest.mark.parametrize("env_id", IDS)
def test_the_links_are_closed_bodies(env_id):
    environment, _ = begun(env_id)
    links = _core.link_shapes(env_id, {})
    assert len(links) == len(capture(environment).link_poses)
    assert len({link["name"] for link in links}) == len(links)
    for link in links:
        assert link["meshes"], link["name"]
        for mesh in link["meshes"]:
            assert (mesh["vertices"].dtype, mesh["faces"].dtype) == (np.float32, np.uint32)
            assert len(mesh["color"]) == 4
            assert {*mesh["faces"].ravel().tolist()} == {*range(len(mesh["vertices"]))}
            directed = edges(mesh["faces"])
            assert all(count == 1 and directed[b, a] == 1 for (a, b), count in [*directed.items()])
            assert volume(mesh) > 1e-5  # [m^3], of a cube of 2 cm


@pytest.mark.parametrize("env_id", IDS)
def test_the_poses_place_the_links_on_the_ground(env_id):
    """At the start some foot is near to the ground, and none is below it."""
    environment, _ = begun(env_id)
    captured = capture(environment)
    assert (captured.link_poses.shape[1], captured.link_poses.dtype) == (7, np.float64)
    drawn = by_name(captured.state_drawings())
    ground = drawn["hits"]["points"][0, 2]  # of the first ray, straight down
    links = _core.link_shapes(env_id, {})
    lowest = [in_world(link, pose)[:, 2].min() for link, pose in zip(links, captured.link_poses)]
    assert ground - 0.02 < min(lowest) < ground + 0.06
    assert lowest[0] > ground + 0.5, "the trunk lies on the ground"


@pytest.mark.parametrize("env_id", IDS)
def test_drawings_have_a_row_per_point(env_id):
    environment, _ = begun(env_id)
    captured = capture(environment)
    drawings = captured.scene_drawings() + captured.state_drawings("a text")
    if captured.floor_center is not None:
        drawings.append(captured.floor_drawing(captured.floor_center))
    per_element = {"triangles": 3, "lines": 2, "line_strip": 1, "spheres": 1, "text": 1}
    for drawing in drawings:
        assert [*drawing] == ["name", "kind", "size", "color", "points", "colors", "text"]
        points, colors = drawing["points"], drawing["colors"]
        assert (points.dtype, points.shape[1:]) == (np.float32, (3,))
        assert len(points) % per_element[drawing["kind"]] == 0
        assert len(drawing["color"]) == 4
        if colors is not None:
            assert (colors.dtype, colors.shape) == (np.float32, (len(points), 4))
    text = by_name(drawings)["episode"]
    assert (text["kind"], text["text"]) == ("text", "a text")
    assert text["points"][0, 2] > captured.link_poses[0, 2]


@pytest.mark.parametrize("env_id", IDS)
def test_a_level_ends_where_the_lidar_does(env_id):
    """Stairs are drawn at their heights, and hits of rays, which the engine casts, are on what is
    drawn."""
    environment, _ = begun(env_id, world={**STAIRS, **FAR})
    captured = capture(environment)
    assert captured.floor_center is None
    scene, state = by_name(captured.scene_drawings()), by_name(captured.state_drawings())
    triangles = np.concatenate([scene[name]["points"] for name in ("ground", "obstacles")])
    triangles = triangles.reshape(-1, 3, 3).astype(float)
    hits = state["hits"]["points"].astype(float)

    level = triangles[np.ptp(triangles[:, :, 2], axis=1) == 0]
    steps = (level[:, 0, 2] - hits[0, 2]) / STEP
    steps = steps[steps > -5]  # without the bottoms of earth and pits
    assert np.allclose(steps, np.round(steps), atol=1e-3)
    assert len({*np.round(steps)}) >= 4

    # A wall across the world's depth is a line in the plane of motion.
    walls = triangles[np.ptp(triangles[:, :, 1], axis=1) > 0][:, :, ::2]
    starts = walls[:, 0]
    other = np.where((walls[:, 1] == starts).all(1, keepdims=True), walls[:, 2], walls[:, 1])
    along = other - starts
    has_length = (along != 0).any(1)
    starts, along = starts[has_length], along[has_length]
    for hit in hits[:, ::2]:
        share = ((hit - starts) * along).sum(1) / (along**2).sum(1)
        nearest = starts + np.clip(share, 0, 1)[:, None] * along
        assert np.linalg.norm(hit - nearest, axis=1).min() < 1e-3
    assert np.ptp(hits[:, 2]) > STEP / 2, "no ray reaches a step"


def test_rays_are_the_observed_lidar():
    environment, observation = begun("BipedalWalkerHardcore-v3", world={"lidar_range": 7})
    lengths = {"hits": [], "misses": []}
    for _ in range(30):
        captured = capture(environment)
        drawn, lidar = by_name(captured.state_drawings()), observation[14:]
        trunk = captured.link_poses[0, :3]
        for name, expected in [("rays", lidar[lidar < 1]), ("missed_rays", lidar[lidar == 1])]:
            starts, ends = drawn[name]["points"][::2], drawn[name]["points"][1::2]
            assert np.allclose(starts, trunk, atol=1e-6)
            assert np.allclose(np.linalg.norm(ends - starts, axis=1), 7 * expected, atol=1e-5)
            lengths["hits" if name == "rays" else "misses"].extend(expected)
        assert np.array_equal(drawn["hits"]["points"], drawn["rays"]["points"][1::2])
        observation = environment.step(environment.action_space.sample() * 0)[0]
    assert min(map(len, lengths.values())) > 10


def test_contacts_are_drawn_where_they_are_observed():
    environment, observation = begun("BipedalWalker-v3")
    environment.action_space.seed(1)
    links = {link["name"]: link for link in _core.link_shapes("BipedalWalker-v3", {})}
    order = [*links]
    seen = set()
    ended = False
    while not ended:
        captured = capture(environment)
        drawn = by_name(captured.state_drawings())["contacts"]["points"]
        flags = observation[8] == 1, observation[13] == 1
        seen.add(flags)
        expected = []
        for name, flag in zip(("lower_leg_1", "lower_leg_2"), flags):
            foot = in_world(links[name], captured.link_poses[order.index(name)])
            if flag:
                expected.append([foot[foot[:, 2].argmin(), 0], foot[:, 2].min()])
        assert np.allclose(drawn[:, ::2], np.reshape(expected, (-1, 2)), atol=1e-5)
        observation, _, terminated, truncated, _ = environment.step(
            environment.action_space.sample()
        )
        ended = terminated or truncated
    assert {(True, True), (False, False)} <= seen
    assert seen & {(True, False), (False, True)}


@pytest.mark.parametrize("env_id, num_coordinates", [("Walker2d-v5", 9), ("Hopper-v5", 6)])
def test_a_floor_follows_the_walker(env_id, num_coordinates):
    environment, _ = begun(env_id)
    assert capture(environment).floor_center == 0
    position = np.zeros(num_coordinates)
    position[:2] = 100.3, 1.25
    environment.set_state(position, np.zeros(num_coordinates))
    captured = capture(environment)
    assert captured.floor_center == 100
    floor = captured.floor_drawing(captured.floor_center)["points"]
    assert (floor[:, 2] == 0).all()
    assert floor[:, 0].min() < 95 < 105 < floor[:, 0].max()


def test_an_environment_without_a_floor_has_no_drawing_of_one():
    environment, _ = begun("BipedalWalker-v3")
    assert capture(environment).floor_center is None
    with pytest.raises(ValueError, match="no floor"):
        capture(environment).floor_drawing(0.0)


def test_a_capture_outlives_its_environment():
    environment, _ = begun("Walker2d-v5")
    captured = capture(environment)
    before = captured.state_drawings()
    environment.close()
    del environment
    gc.collect()
    for old, new in zip(before, captured.state_drawings()):
        assert np.array_equal(old["points"], new["points"])
