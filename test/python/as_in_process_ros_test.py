"""Over ROS as in process: pictures, saved states, check_env, another locale."""

import locale
import re
import subprocess

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.utils.env_checker import check_env
from walker_sim import WalkerEnv
from walkers import IDS, assert_same, follow, make_many, make_ours, random_actions, through_pickle


def make_remote(environment_id, server, **parameters):
    return make_ours(environment_id, transport="ros", server=server, **parameters)


# ---------------------------------------------------------------- pictures

MODES = [
    *((env_id, "rgb_array") for env_id in IDS),
    ("Walker2d-v5", "depth_array"),
    ("Walker2d-v5", "rgbd_tuple"),
]


@pytest.mark.parametrize(("env_id", "mode"), MODES)
def test_one_walker(serve, env_id, mode):
    server, _ = serve(env_id)
    here = make_ours(env_id, render_mode=mode)
    there = make_remote(env_id, server, render_mode=mode)
    for environment in (here, there):
        environment.reset(seed=4)
    assert_same(there.render(), here.render())
    for action in random_actions(env_id, 20):
        assert_same(there.step(action), here.step(action))
        assert_same(there.render(), here.render())


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
        assert_same(*pictures)


def test_many_walkers(serve):
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


def test_refused_calls(serve):
    server, process = serve("BipedalWalker-v3")
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
    process.kill()
    process.wait()
    with pytest.raises(walker_sim.ConnectionError):
        there.render()
    there.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        there.render()


# ---------------------------------------------------------------- saved states


@pytest.mark.parametrize("environment_id", IDS)
def test_a_restored_walker_continues_equally(serve, environment_id):
    (first, _), (second, _) = serve(environment_id), serve(environment_id)
    original, other = (make_remote(environment_id, server) for server in (first, second))
    actions = random_actions(environment_id, 60)
    local = make_ours(environment_id)
    for environment in (original, local):
        environment.reset(seed=5)
        follow(environment, actions[:8])
    state = original.unwrapped.get_state()
    expected = follow(local, actions[8:])
    other.reset(seed=7)
    for environment in (original, other):
        environment.unwrapped.set_state(state)
        assert follow(environment, actions[8:]) == expected
        environment.reset(seed=1)
    original.unwrapped.close()
    original.unwrapped.set_state(state)


def test_the_end_is_restored(serve):
    server, _ = serve("Hopper-v5", max_episode_steps=3)
    environment = make_remote("Hopper-v5", server, max_episode_steps=3).unwrapped
    environment.reset(seed=1)
    for _ in range(3):
        environment.step(np.zeros(3))
    state = environment.get_state()
    environment.reset(seed=1)
    environment.set_state(state)
    with pytest.raises(walker_sim.ResetNeeded, match="ended after 3 steps"):
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


def test_an_episode_and_its_states_under_another_locale(serve, german):
    """A program may set a locale with a decimal comma, as Qt and GTK do."""
    env_id, parameters = "Walker2d-v5", {"reset_noise_scale": 0.001, "forward_reward_weight": 1.5}
    server, _ = serve(env_id, **parameters)
    local = make_ours(env_id, **parameters)
    actions = random_actions(env_id, 40)
    local.reset(seed=5)
    begun = follow(local, actions[:10])
    state = local.unwrapped.get_state()
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

    anew = make_ours(env_id, **parameters)
    anew.reset(seed=1)
    anew.unwrapped.set_state(state)
    assert anew.unwrapped.get_state() == state
    assert follow(anew, actions[10:]) == ended
