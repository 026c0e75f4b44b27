"""Worlds over ROS: bits, infos and refusals are those in process."""

import signal

import numpy as np
import pytest
import walker_sim
from walkers import (
    MODES,
    assert_same,
    follow,
    make_many,
    make_ours,
    play_both,
    random_actions,
)

EFFECTS = {
    "gravity": (-12, -8),
    "push_interval": (0.1, 0.3),
    "action_delay": (0, 0.06),
    "action_noise": 0.1,
    "observation_delay": (0, 0.06),
    "joint_velocity_noise": 0.1,
    "dropout": 0.1,
}
WORLDS = {
    "BipedalWalker-v3": {**EFFECTS, "stump_height": (0.2, 0.6), "lidar_range": (3, 6)},
    "Walker2d-v5": {**EFFECTS, "friction_scale": (0.5, 1), "ground_roughness": (1, 2)},
    "Hopper-v5": {**EFFECTS, "mass_scale": (0.9, 1.1)},
}
LIMITS = {"BipedalWalker-v3": 60, "Walker2d-v5": 20, "Hopper-v5": 20}


@pytest.mark.parametrize("environment_id", WORLDS)
def test_single(serve, environment_id):
    server, _ = serve(environment_id)
    world = WORLDS[environment_id]
    remote = make_ours(environment_id, transport="ros", server=server, world=world)
    local = make_ours(environment_id, world=world)
    assert remote.unwrapped.world == local.unwrapped.world
    actions = random_actions(environment_id, 150)
    ours, theirs = remote.reset(seed=1), local.reset(seed=1)
    assert_same(ours, theirs)
    assert ours[1]["world"].keys() == world.keys()
    assert follow(remote, actions) == follow(local, actions)
    for environment in (remote, local):
        environment.unwrapped.set_world("moon")
    assert follow(remote, actions) == follow(local, actions)
    for options in ({"world": {"gravity": (-4, -2)}}, None, {"world": None}):
        ours, theirs = remote.reset(options=options), local.reset(options=options)
        assert_same(ours, theirs)
        assert follow(remote, actions) == follow(local, actions)
    assert "world" not in ours[1]
    # What was drawn, as a world under the same seed.
    first = remote.reset(seed=7, options={"world": world})
    outcomes = follow(remote, actions)
    again = local.reset(seed=7, options={"world": first[1]["world"]})
    assert again[0].tobytes() == first[0].tobytes()
    assert follow(local, actions)[:20] == outcomes[:20]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("environment_id", WORLDS)
def test_vectorised(serve, environment_id, mode):
    limit = LIMITS[environment_id]
    server, _ = serve(environment_id, num_envs=4, autoreset_mode=mode, max_episode_steps=limit)
    worlds = [None, WORLDS[environment_id], "moon", {"gravity": (-20, -5)}]
    options = {"autoreset_mode": mode, "max_episode_steps": limit, "world": worlds}
    remote = make_many(environment_id, 4, transport="ros", server=server, **options)
    local = make_many(environment_id, 4, **options)
    assert remote.get_attr("world") == local.get_attr("world")
    changes = {limit: (["slippery", None], [0, 3]), 2 * limit: ("laggy",)}
    assert play_both(remote, local, 4 * limit, worlds=changes)[1] > 4
    mask = np.array([True, False, True, False])
    reset = {"reset_mask": mask, "world": ["moon", None, None, None]}
    assert_same(remote.reset(options=reset), local.reset(options=reset))
    actions = np.zeros(remote.action_space.shape, np.float32)
    assert_same(remote.step(actions), local.step(actions))


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


def test_state_is_continued_with_its_world(serve):
    world = WORLDS["Walker2d-v5"]
    servers = [serve("Walker2d-v5")[0] for _ in range(2)]
    one, other = (make_ours("Walker2d-v5", transport="ros", server=name) for name in servers)
    drawn = one.reset(seed=3, options={"world": world})[1]["world"]
    actions = random_actions("Walker2d-v5", 60)
    follow(one, actions[:5])
    state = one.unwrapped.get_state()
    other.reset(seed=4, options={"world": "moon"})
    other.unwrapped.set_state(state)
    assert other.unwrapped._walker.world_values() == drawn
    steps = [environment.step(actions[7]) for environment in (one, other)]
    assert_same(*steps)
    assert other.reset()[1]["world"] == {"gravity": -1.62}, "the server keeps its own"


REFUSED = [
    ({"gravty": -3}, "world parameter gravty = -3.0: unknown; did you mean gravity?"),
    ({"gravity": (-3, -5)}, "low <= high"),
    ({"dropout": 2}, r"must be in \[0.0, 1.0\]"),
    ({"hip_speed": 1}, "cannot be applied by Walker2d-v5"),
    ("moom", "did you mean moon?"),
    ({"action_delay": 0.001}, "shorter than half a step"),
]


@pytest.mark.parametrize(("world", "words"), REFUSED)
def test_refusals(serve, world, words):
    server, _ = serve("Walker2d-v5", world="moon")
    remote = make_ours("Walker2d-v5", transport="ros", server=server)
    local = make_ours("Walker2d-v5", world="moon")
    for environment in (remote, local):
        environment.reset(seed=1)
    actions = random_actions("Walker2d-v5", 30)
    texts = []
    for environment in (remote, local):
        for call in (
            lambda e=environment: e.unwrapped.set_world(world),
            lambda e=environment: e.reset(options={"world": world}),
        ):
            with pytest.raises(ValueError, match=words) as error:
                call()
            texts.append(str(error.value))
        assert not getattr(environment.unwrapped._walker, "is_lost", False)
    assert texts[:2] == texts[2:]
    with pytest.raises(ValueError, match=words):
        make_ours("Walker2d-v5", transport="ros", server=server, world=world)
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
