"""Worlds over ROS: whose they are, options of resets, refusals, restarted servers.

promises_ros_test.py and as_in_process_ros_test.py compare episodes in worlds.
"""

import re
import signal

import numpy as np
import pytest
import walker_sim
from walkers import assert_same, follow, make_many, make_ours, random_actions

WORLD = {"gravity": (-12, -8), "push_interval": (0.1, 0.3), "observation_delay": (0, 0.06)}


def test_the_worlds_of_resets(serve):
    server, _ = serve("Walker2d-v5")
    pair = [
        make_ours("Walker2d-v5", world=WORLD, **where)
        for where in ({"transport": "ros", "server": server}, {})
    ]
    remote, local = pair
    (action,) = random_actions("Walker2d-v5", 1)
    for seed, options in enumerate([None, {"world": "moon"}, None, {"world": None}, None]):
        assert remote.unwrapped.world == local.unwrapped.world
        begun = [environment.reset(seed=seed, options=options) for environment in pair]
        assert_same(*begun)
        assert_same(remote.step(action), local.step(action))
        assert ("world" in begun[0][1]) == (seed < 3)


def test_none_leaves_the_servers_own(serve):
    server, _ = serve(world="moon")
    remote = make_ours("BipedalWalker-v3", transport="ros", server=server)
    local = make_ours("BipedalWalker-v3", world="moon")
    assert remote.unwrapped.world == local.unwrapped.world
    options = {"transport": "ros", "server": server}
    many = make_many("BipedalWalker-v3", 1, **options)
    assert many.get_attr("world") == (local.unwrapped.world,)
    assert_same(remote.reset(seed=2), local.reset(seed=2))
    actions = random_actions("BipedalWalker-v3", 100)
    assert follow(remote, actions) == follow(local, actions)


def test_a_restored_state_leaves_the_servers_own(serve):
    server, _ = serve("Walker2d-v5")
    environment = make_ours("Walker2d-v5", transport="ros", server=server)
    environment.reset(seed=3, options={"world": WORLD})
    state = environment.unwrapped.get_state()
    environment.reset(seed=4, options={"world": "moon"})
    environment.unwrapped.set_state(state)
    assert environment.reset()[1]["world"] == {"gravity": -1.62}


def test_refusals(serve):
    """The texts are those of a walker in process."""
    server, _ = serve("Walker2d-v5", world="moon")
    remote = make_ours("Walker2d-v5", transport="ros", server=server)
    local = make_ours("Walker2d-v5", world="moon")
    for environment in (remote, local):
        environment.reset(seed=1)
    for world, words in (
        ({"gravty": -3}, "world parameter gravty = -3.0: unknown; did you mean gravity?"),
        ({"hip_speed": 1}, "cannot be applied by Walker2d-v5"),
        ("moom", "did you mean moon?"),
        ({"action_delay": 0.001}, "shorter than half a step"),
    ):
        texts = []
        for call in (
            remote.unwrapped.set_world,
            local.unwrapped.set_world,
            lambda world: remote.reset(options={"world": world}),
            lambda world: make_ours("Walker2d-v5", transport="ros", server=server, world=world),
        ):
            with pytest.raises(ValueError, match=re.escape(words)) as error:
                call(world)
            texts.append(str(error.value))
        assert len({*texts}) == 1
    actions = random_actions("Walker2d-v5", 30)
    assert follow(remote, actions) == follow(local, actions)


def test_list_of_worlds_is_set_at_once(serve):
    server, _ = serve("Walker2d-v5", num_envs=3)
    remote = make_many("Walker2d-v5", 3, transport="ros", server=server, world="moon")
    remote.reset(seed=1)
    for worlds, words in (
        (["slippery", None, {"dropout": 2}], "must be in"),
        (["slippery", None], "2 worlds; must be one, or 3"),
    ):
        with pytest.raises(ValueError, match=words):
            remote.set_world(worlds)
    infos = remote.reset(seed=1)[1]
    assert infos["world"]["gravity"].tolist() == [-1.62] * 3
    assert "friction_scale" not in infos["world"]


def test_server_restarted_before_the_first_reset_gets_the_world(serve):
    server, process = serve("Walker2d-v5")
    remote = make_ours("Walker2d-v5", transport="ros", server=server, world="moon")
    process.send_signal(signal.SIGKILL)
    process.wait()
    serve("Walker2d-v5", namespace=server.rpartition("/")[0])
    try:
        begun = remote.reset(seed=1)
    except walker_sim.ConnectionError:
        begun = remote.reset(seed=1)
    assert begun[1]["world"] == {"gravity": -1.62}


def test_restarted_server_gets_the_world_again(serve):
    """A server that is started again has its own world: without the client's it would differ."""
    server, process = serve("Walker2d-v5", num_envs=2)
    namespace = server.rpartition("/")[0]
    options = {"transport": "ros", "server": server}
    remote = make_many("Walker2d-v5", 2, world=[None, "moon"], **options)
    remote.set_world("slippery", indices=[0])
    before = remote.reset(seed=1)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with pytest.raises(walker_sim.ConnectionError):
        remote.step(np.zeros((2, 6)))
    serve("Walker2d-v5", namespace=namespace, num_envs=2)
    assert_same(remote.reset(seed=1), before)
