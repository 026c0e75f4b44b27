"""get_state and set_state over ROS: server records, replayed by the same or another server; and
the calls of vector environments that work in process only."""

import gymnasium
import numpy as np
import pytest
import walker_sim
from walkers import IDS, follow, make_ours, random_actions


@pytest.mark.parametrize("environment_id", IDS)
def test_a_restored_walker_continues_equally(serve, environment_id):
    (first, _), (second, _) = serve(environment_id), serve(environment_id)
    original, other = (
        make_ours(environment_id, transport="ros", server=server) for server in (first, second)
    )
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
    environment = make_ours(
        "Hopper-v5", transport="ros", server=server, max_episode_steps=3
    ).unwrapped
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
    environment = make_ours("Hopper-v5", transport="ros", server=server).unwrapped
    with pytest.raises(walker_sim.ResetNeeded, match="get_state: there is no episode yet"):
        environment.get_state()
    environment.reset(seed=1)
    state = environment.get_state()
    another, _ = serve("Hopper-v5", healthy_reward=0.5)
    stranger = make_ours("Hopper-v5", transport="ros", server=another, healthy_reward=0.5).unwrapped
    stranger.reset(seed=1)
    with pytest.raises(walker_sim.RequestRefused, match="healthy_reward"):
        stranger.set_state(state)
    stranger.step(np.zeros(3))
    with pytest.raises(TypeError, match="must be bytes"):
        environment.set_state(("a",))


def test_calls_that_work_in_process_only(serve):
    server, _ = serve("Hopper-v5", num_envs=2)
    envs = gymnasium.make_vec("walker_sim/Hopper-v5", 2, transport="ros", server=server)
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
