"""Over ROS as in process: types, infos, pictures, saved states, check_env, another locale.

promises_ros_test.py compares the bits of all ids.
"""

import locale
import re
import subprocess

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.utils.env_checker import check_env
from walker_sim import WalkerEnv
from walkers import (
    IDS,
    MODES,
    assert_same,
    changed_model,
    follow,
    make_many,
    make_ours,
    overflowing,
    play_both,
    random_actions,
    through_pickle,
)


def make_remote(environment_id, server, **parameters):
    return make_ours(environment_id, transport="ros", server=server, **parameters)


# ---------------------------------------------------------------- types and infos


CASES = [
    *((environment_id, {}, {"render_mode": "rgb_array"}) for environment_id in IDS),
    ("BipedalWalker-v3", {}, {"render_mode": "rgb_array", "width": 90, "height": 60}),
    ("Walker2d-v5", {}, {"render_mode": "depth_array"}),
    ("Walker2d-v5", {"include_lidar_in_observation": True}, {"render_mode": "rgbd_tuple"}),
]


@pytest.mark.parametrize(("environment_id", "keywords", "camera"), CASES, ids=str)
def test_one_walker(serve, environment_id, keywords, camera):
    """Spaces, types and pictures. The server has another camera, for its own topic."""
    server, _ = serve(environment_id, camera_width=50, camera_height=30, **keywords)
    remote = make_remote(environment_id, server, **keywords, **camera)
    local = make_ours(environment_id, **keywords, **camera)
    assert remote.observation_space == local.observation_space
    assert remote.action_space == local.action_space
    assert remote.unwrapped.dt == local.unwrapped.dt
    assert_same(remote.reset(seed=4), local.reset(seed=4))
    assert_same(remote.render(), local.render())
    for action in random_actions(environment_id, 20):
        assert_same(remote.step(action), local.step(action))
        assert_same(remote.render(), local.render())


def make_pair(serve, environment_id, num_envs, **options):
    """Makes vector environments over ROS and in process."""
    server, _ = serve(environment_id, num_envs=num_envs, **options)
    remote = make_many(environment_id, num_envs, transport="ros", server=server, **options)
    return remote, make_many(environment_id, num_envs, **options)


@pytest.mark.parametrize("mode", MODES)
def test_vectorised(serve, mode):
    pair = make_pair(serve, "Walker2d-v5", 4, autoreset_mode=mode, max_episode_steps=20)
    worlds = [None, {"push_interval": (0.1, 0.3), "dropout": 0.1}, "moon", {"gravity": (-20, -5)}]
    for environments in pair:
        environments.set_world(worlds)
    remote, local = pair
    assert remote.get_attr("world") == local.get_attr("world")
    changes = {30: (["slippery", None], [0, 3]), 50: ("laggy",)}
    assert play_both(remote, local, 80, changes).min() > 1
    mask = np.array([True, False, True, False])
    reset = {"reset_mask": mask, "world": ["moon", None, None, None]}
    assert_same(remote.reset(options=reset), local.reset(options=reset))
    actions = np.zeros(remote.action_space.shape, np.float32)
    assert_same(remote.step(actions), local.step(actions))


def test_one_walker_as_a_batch(serve):
    remote, local = make_pair(serve, "BipedalWalker-v3", 1, max_episode_steps=10)
    assert_same(remote.reset(seed=1), local.reset(seed=1))
    for action in random_actions("BipedalWalker-v3", 25):
        assert_same(remote.step(action[None]), local.step(action[None]))


@pytest.mark.parametrize("mode", MODES)
def test_infos_of_failures(serve, tmp_path, mode):
    parameters = {**overflowing(tmp_path), "max_episode_steps": 20}
    remote, local = make_pair(serve, "Walker2d-v5", 20, autoreset_mode=mode, **parameters)
    result = remote.reset(seed=0)
    assert_same(result, local.reset(seed=0))
    failed = result[1]["_error"]
    assert 0 < failed.sum() < 20
    actions = np.full((20, 6), 0.5, np.float32)
    if mode == "disabled":
        words = f"environment {failed.argmax()}: the simulation failed at its reset; reset first"
        for environments in (local, remote):
            with pytest.raises(walker_sim.ResetNeeded, match=words):
                environments.step(actions)
        return
    for number in range(25):
        assert_same(remote.step(actions), local.step(actions), number)


# ---------------------------------------------------------------- pictures


def test_pictures_of_many_walkers(serve):
    server, _ = serve("BipedalWalker-v3", num_envs=3, autoreset_mode="next_step")
    here, there = (
        make_many("BipedalWalker-v3", 3, render_mode="rgb_array", **where)
        for where in ({}, {"transport": "ros", "server": server})
    )
    with pytest.raises(walker_sim.ResetNeeded, match="render: there is no episode yet"):
        there.render()
    for environments in (here, there):
        environments.reset(seed=4)
        for _ in range(5):
            environments.step(np.ones((3, 4)))
    assert_same(there.render(), here.render())


def test_refused_pictures(serve):
    server, process = serve("BipedalWalker-v3")
    there = WalkerEnv("BipedalWalker-v3", render_mode="rgb_array", transport="ros", server=server)
    with pytest.raises(walker_sim.ResetNeeded, match="render: there is no episode yet; reset fi"):
        there.render()
    there.reset(seed=4)
    client = there._walkers.client
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
    process.kill()
    process.wait()
    with pytest.raises(walker_sim.ConnectionError):
        there.render()
    there.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        there.render()


# ---------------------------------------------------------------- saved states


def test_set_state_opens_a_closed_environment(serve):
    server, _ = serve("Hopper-v5")
    environment = make_remote("Hopper-v5", server).unwrapped
    environment.reset(seed=5)
    state = environment.get_state()
    environment.close()
    environment.set_state(state)
    environment.step(np.zeros(3))


def test_refused_states(serve):
    server, _ = serve("Hopper-v5")
    environment = make_remote("Hopper-v5", server).unwrapped
    with pytest.raises(walker_sim.ResetNeeded, match="get_state: there is no episode yet"):
        environment.get_state()
    environment.reset(seed=1)
    state = environment.get_state()
    another, _ = serve("Hopper-v5", healthy_reward=0.5)
    stranger = make_remote("Hopper-v5", another, healthy_reward=0.5).unwrapped
    stranger.reset(seed=1)
    with pytest.raises(walker_sim.RequestRefused, match="healthy_reward"):
        stranger.set_state(state)
    stranger.step(np.zeros(3))
    with pytest.raises(TypeError, match="must be bytes"):
        environment.set_state(("a",))


def test_set_coordinates(serve, tmp_path):
    """The errors are those in process. promises_ros_test.py compares the bits."""
    parameters = {
        "xml_file": changed_model(tmp_path, 'gear="100"', 'gear="1e14"'),
        "terminate_when_unhealthy": False,
    }
    server, _ = serve("Walker2d-v5", **parameters)
    zeros, standing = np.zeros(9), np.array([0, 1.25, 0, 0, 0, 0, 0, 0, 0])
    wrong = [
        (zeros, zeros[:8], "qvel has 8 values; must have 9, one per coordinate"),
        ([np.nan, *zeros[:8]], zeros, "qpos[0] = nan; must be finite"),
        (zeros[None], zeros, "qpos has the shape (1, 9); must be one-dimensional"),
    ]
    remote = make_remote("Walker2d-v5", server, **parameters).unwrapped
    for walker in (make_ours("Walker2d-v5", **parameters).unwrapped, remote):
        with pytest.raises(walker_sim.ResetNeeded, match="set_state: there is no episode yet; r"):
            walker.set_state(standing, zeros)
        walker.reset(seed=1)
        for qpos, qvel, message in wrong:
            with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
                walker.set_state(qpos, qvel)
        walker.set_state(standing, zeros)
        while "error" not in walker.step(np.ones(6))[4]:
            pass
        with pytest.raises(walker_sim.ResetNeeded, match="set_state: the simulation failed; res"):
            walker.set_state(standing, zeros)
    remote.reset(seed=1)
    other = make_remote("Walker2d-v5", server, **parameters)
    other.reset(seed=1)
    with pytest.raises(walker_sim.ConnectionError, match="another client"):
        remote.set_state(standing, zeros)
    with pytest.raises(walker_sim.ResetNeeded, match="set_state: the server or its episode was l"):
        remote.set_state(standing, zeros)
    server, _ = serve("BipedalWalker-v3")
    bipedal = make_remote("BipedalWalker-v3", server).unwrapped
    bipedal.reset(seed=1)
    with pytest.raises(RuntimeError, match="BipedalWalker-v3 has no positions and velocities"):
        bipedal.set_state(zeros, zeros)
    bipedal.step(np.zeros(4))


def test_calls_that_work_in_process_only(serve):
    server, _ = serve("Hopper-v5", num_envs=2)
    envs = make_many("Hopper-v5", 2, transport="ros", server=server)
    envs.reset(seed=1)
    actions = np.zeros((2, 3))
    calls = {
        "get_state": envs.get_state,
        "set_state": lambda: envs.set_state([b"", b""]),
        "send": lambda: envs.send(actions),
        "recv": envs.recv,
        "env_id": lambda: envs.step(actions[:1], [0]),
        "async_reset": envs.async_reset,
        "np_random": lambda: envs.np_random,
        "np_random_seed": lambda: envs.np_random_seed,
        "num_threads": lambda: envs.num_threads,
        "batch_size": lambda: envs.batch_size,
    }
    for name, call in calls.items():
        message = f'^{name}: not over ROS; only with transport="inprocess"$'
        with pytest.raises(AttributeError, match=message):
            call()
    server, _ = serve("Hopper-v5")
    walker = make_remote("Hopper-v5", server).unwrapped
    walker.reset(seed=1)
    message = "np_random: over ROS there is none"
    with pytest.raises(AttributeError, match=message):
        _ = walker.np_random
    with pytest.raises(AttributeError, match=message):
        walker.np_random = np.random.default_rng(1)


# ---------------------------------------------------------------- check_env


@pytest.mark.usefixtures("pygame")
@pytest.mark.parametrize(
    ("environment_id", "limit"),
    [("BipedalWalker-v3", 1600), ("BipedalWalker-v3", 100), ("Walker2d-v5", 0)],
)
def test_the_checker_passes(serve, environment_id, limit):
    server, _ = serve(environment_id, max_episode_steps=limit)
    for render_mode in (None, "human", "rgb_array"):
        options = {"max_episode_steps": limit or -1, "render_mode": render_mode}
        check_env(make_remote(environment_id, server, **options).unwrapped)


def test_a_copy_by_the_unwrapped_spec_accepts_the_servers_limit(serve):
    server, _ = serve(max_episode_steps=3)
    first = make_remote("BipedalWalker-v3", server, max_episode_steps=3)
    copy = first.unwrapped.spec.make()
    copy.reset(seed=1)
    assert [copy.step(np.zeros(4))[3] for _ in range(3)] == [False, False, True]
    with pytest.raises(walker_sim.ServerMismatch, match="max_episode_steps is 3 there; must be 9"):
        first.unwrapped.spec.make(max_episode_steps=9)
    first.spec.make().reset(seed=1)


# ---------------------------------------------------------------- a locale


@pytest.fixture
def german(tmp_path, monkeypatch):
    """Compiles a locale with a decimal comma. Returns its name."""
    subprocess.run(
        ["localedef", "-i", "de_DE", "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")], check=True
    )
    monkeypatch.setenv("LOCPATH", str(tmp_path))
    before = locale.setlocale(locale.LC_ALL)
    yield "de_DE.UTF-8"
    monkeypatch.delenv("LOCPATH")
    locale.setlocale(locale.LC_ALL, before)


def test_an_episode_and_its_record_under_another_locale(serve, german):
    """A program may set a locale with a decimal comma, as Qt and GTK do."""
    env_id, parameters = "Walker2d-v5", {"reset_noise_scale": 0.001, "forward_reward_weight": 1.5}
    server, _ = serve(env_id, **parameters)
    local = make_ours(env_id, **parameters)
    actions = random_actions(env_id, 40)
    local.reset(seed=5)
    begun = follow(local, actions[:10])
    ended = follow(local, actions[10:])

    locale.setlocale(locale.LC_ALL, german)
    assert locale.format_string("%.1f", 0.5) == "0,5"
    remote = make_remote(env_id, server, **parameters)
    remote.reset(seed=5)
    assert follow(remote, actions[:10]) == begun
    record = remote.unwrapped.get_state()
    assert follow(remote, actions[10:]) == ended
    remote.unwrapped.set_state(through_pickle(record))
    assert follow(remote, actions[10:]) == ended
