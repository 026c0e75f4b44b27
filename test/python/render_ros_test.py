"""Pictures over ROS equal those rendered in process to the byte."""

import re

import gymnasium
import numpy as np
import pytest
import walker_sim
from walker_sim import WalkerEnv
from walkers import IDS, random_actions

MODES = [
    *((env_id, "rgb_array") for env_id in IDS),
    ("Walker2d-v5", "depth_array"),
    ("Walker2d-v5", "rgbd_tuple"),
]


def parts(picture):
    return picture if isinstance(picture, tuple) else (picture,)


def assert_equal(ours, theirs):
    assert type(ours) is type(theirs)
    for our, their in zip(parts(ours), parts(theirs)):
        assert our.dtype == their.dtype
        assert np.array_equal(our, their)


@pytest.mark.parametrize(("env_id", "mode"), MODES)
def test_one_walker(serve, env_id, mode):
    server, _ = serve(env_id)
    here = gymnasium.make(f"walker_sim/{env_id}", render_mode=mode)
    there = gymnasium.make(f"walker_sim/{env_id}", render_mode=mode, transport="ros", server=server)
    for environment in (here, there):
        environment.reset(seed=4)
    assert_equal(there.render(), here.render())
    for action in random_actions(env_id, 20):
        expected, outcome = here.step(action), there.step(action)
        assert outcome[0].tobytes() == expected[0].tobytes()
        assert outcome[1:] == expected[1:]
        assert_equal(there.render(), here.render())


def test_the_camera_of_the_client_applies(serve):
    server, _ = serve("BipedalWalker-v3", camera_width=50, camera_height=30)
    for size in ({}, {"width": 90, "height": 60}):
        environments = [
            WalkerEnv("BipedalWalker-v3", render_mode="rgb_array", **size, **where)
            for where in ({}, {"transport": "ros", "server": server})
        ]
        pictures = []
        for environment in environments:
            environment.reset(seed=4)
            pictures.append(environment.render())
        assert_equal(*pictures)


def test_many_walkers(serve):
    server, _ = serve("BipedalWalker-v3", num_envs=3, autoreset_mode="next_step")
    here, there = (
        gymnasium.make_vec("walker_sim/BipedalWalker-v3", 3, render_mode="rgb_array", **where)
        for where in ({}, {"transport": "ros", "server": server})
    )
    with pytest.raises(walker_sim.ResetNeeded, match="render: there is no episode yet"):
        there.render()
    for environments in (here, there):
        environments.reset(seed=4)
        for _ in range(5):
            environments.step(np.ones((3, 4)))
    for one, other in zip(there.render(), here.render()):
        assert_equal(one, other)


def test_refused_calls(serve):
    server, _ = serve("BipedalWalker-v3")
    there = WalkerEnv("BipedalWalker-v3", render_mode="rgb_array", transport="ros", server=server)
    with pytest.raises(walker_sim.ResetNeeded, match="render: there is no episode yet; reset fi"):
        there.render()
    there.reset(seed=4)
    client = there._walker.client
    camera = there._pictures.camera_parameters
    with pytest.raises(IndexError, match=re.escape("environment 1: must be in [0, 0]")):
        client.render(1, camera, np.empty((400, 600, 3), np.uint8), None)
    with pytest.raises(walker_sim.RequestRefused, match="zoom"):
        client.render(0, {**camera, "zoom": 2}, np.empty((400, 600, 3), np.uint8), None)
    with pytest.raises(walker_sim.RequestRefused, match=r"depth|32FC1"):
        client.render(0, camera, None, np.empty((400, 600), np.float32))
    with pytest.raises(walker_sim.ConnectionError, match="values of rgb"):
        client.render(0, camera, np.empty((2, 2, 3), np.uint8), None)
    # No error ends the episode.
    there.step(np.zeros(4))
    assert there.render().shape == (400, 600, 3)
    there.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        there.render()


def test_a_killed_server(serve):
    server, process = serve("BipedalWalker-v3")
    there = WalkerEnv("BipedalWalker-v3", render_mode="rgb_array", transport="ros", server=server)
    there.reset(seed=4)
    there.render()
    process.kill()
    process.wait()
    with pytest.raises(walker_sim.ConnectionError):
        there.render()
