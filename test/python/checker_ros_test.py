"""Gymnasium's check_env over ROS, which makes copies from the environment's spec."""

import numpy as np
import pytest
import walker_sim
from gymnasium.utils.env_checker import check_env
from walkers import make_ours

pytestmark = pytest.mark.usefixtures("pygame")


@pytest.mark.parametrize(
    ("environment_id", "limit"),
    [("BipedalWalker-v3", 1600), ("BipedalWalker-v3", 100), ("Walker2d-v5", 0)],
)
def test_the_checker_passes(serve, environment_id, limit):
    server, _ = serve(environment_id, max_episode_steps=limit)
    options = {"transport": "ros", "server": server, "max_episode_steps": limit or -1}
    check_env(make_ours(environment_id, **options).unwrapped)
    for render_mode in ("human", "rgb_array"):
        check_env(make_ours(environment_id, render_mode=render_mode, **options).unwrapped)


def test_a_copy_by_the_unwrapped_spec_accepts_the_servers_limit(serve):
    server, _ = serve(max_episode_steps=3)
    first = make_ours("BipedalWalker-v3", transport="ros", server=server, max_episode_steps=3)
    copy = first.unwrapped.spec.make()
    copy.reset(seed=1)
    assert [copy.step(np.zeros(4))[3] for _ in range(3)] == [False, False, True]
    with pytest.raises(walker_sim.ServerMismatch, match="max_episode_steps is 3 there; must be 9"):
        first.unwrapped.spec.make(max_episode_steps=9)
    first.spec.make().reset(seed=1)
