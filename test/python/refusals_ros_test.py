"""Errors over ROS: mismatched servers, invalid options, actions and calls."""

import copy
import re

import gymnasium
import numpy as np
import pytest
import walker_sim  # registers the ids
from walker_sim.environment import WalkerEnv
from walkers import make_ours

BATCH = "walker_sim/BipedalWalker-v3"


def mismatch(server, *lines):
    """Pattern of the whole message. Each line is (name, server's value, client's value)."""
    texts = [f"{name} is {there} there; must be {here}" for name, there, here in lines]
    return f"^{re.escape(f'the server {server}: ' + '; '.join(texts))}$"


def make_single(server, environment_id="BipedalWalker-v3", **parameters):
    return make_ours(environment_id, transport="ros", server=server, **parameters)


# ---------------------------------------------------------------- another server


@pytest.mark.parametrize(
    ("parameters", "differences"),
    [
        (
            {"env": "BipedalWalkerHardcore-v3", "num_envs": 2},
            [("id", "BipedalWalkerHardcore-v3", "BipedalWalker-v3"), ("num_envs", 2, 1)],
        ),
        ({"mode": "free", "paused": "true"}, [("mode", "free", "lockstep")]),
    ],
)
def test_another_id_or_mode(serve, parameters, differences):
    server, _ = serve(**parameters)
    with pytest.raises(walker_sim.ServerMismatch, match=mismatch(server, *differences)):
        make_single(server)


def test_all_differences_are_listed(serve):
    server, _ = serve(
        "Walker2d-v5", num_envs=3, autoreset_mode="same_step", healthy_reward=0.5, frame_skip=2
    )
    expected = mismatch(
        server,
        ("num_envs", 3, 2),
        ("autoreset_mode", "same_step", "next_step"),
        ("frame_skip", 2, 4),
        ("healthy_reward", 0.5, 1.0),
    )
    with pytest.raises(walker_sim.ServerMismatch, match=expected):
        gymnasium.make_vec("walker_sim/Walker2d-v5", 2, transport="ros", server=server)


def test_a_single_walker_accepts_any_autoreset_mode(serve):
    server, _ = serve(autoreset_mode="same_step")
    make_single(server).reset(seed=1)


def make_from_spec(name, max_episode_steps=1600, **options):
    specification = copy.deepcopy(gymnasium.spec(name))
    specification.max_episode_steps = max_episode_steps
    return gymnasium.make(specification, **options)


def make_sync(name, **options):
    return gymnasium.make_vec(name, 1, vectorization_mode="sync", **options)


@pytest.mark.parametrize("limit", [100, 1600, 0])
def test_the_time_limit(serve, limit):
    server, _ = serve(max_episode_steps=limit)
    makers = {
        **dict.fromkeys([gymnasium.make, gymnasium.make_vec, make_sync], (100, None, -1)),
        make_from_spec: (100, None),
        WalkerEnv: (100, None, 0),
    }
    for make, choices in makers.items():
        for option in choices:
            expected = {100: 100, None: 1600}.get(option, 0)
            options = {} if option is None else {"max_episode_steps": option}
            if expected == limit:
                make(BATCH, transport="ros", server=server, **options)
                continue
            message = mismatch(server, ("max_episode_steps", limit, expected))
            with pytest.raises(walker_sim.ServerMismatch, match=message):
                make(BATCH, transport="ros", server=server, **options)


# ---------------------------------------------------------------- calls


@pytest.mark.parametrize("mode", ["single", "next_step", "disabled"])
def test_steps_are_refused_as_in_process(serve, mode):
    batch = {} if mode == "single" else {"num_envs": 3, "autoreset_mode": mode}
    server, _ = serve(max_episode_steps=2, **batch)
    make = walker_sim.WalkerVectorEnv if batch else WalkerEnv
    remote, local = pair = [
        make("BipedalWalker-v3", max_episode_steps=2, **batch, **where)
        for where in ({"transport": "ros", "server": server}, {})
    ]
    good = np.zeros(local.action_space.shape, np.float32)

    def assert_refused(error, actions=good):
        texts = []
        for environment in pair:
            with pytest.raises(error) as caught:
                environment.step(actions)
            texts.append((type(caught.value), str(caught.value)))
        assert texts[0] == texts[1]

    assert_refused(walker_sim.ResetNeeded)
    for environment in pair:
        environment.reset(seed=1)
    for value in (np.nan, np.inf, -np.inf):
        bad = good.copy()
        bad.flat[-2] = value
        assert_refused(walker_sim.InvalidAction, bad)
    assert_refused(walker_sim.InvalidAction, good[:2])
    for environment in pair:
        environment.step(good)
        environment.step(good)
    if mode == "next_step":
        remote.step(good)
    else:
        assert_refused(walker_sim.ResetNeeded)
    if mode == "disabled":
        for environment in pair:
            environment.reset(options={"reset_mask": np.array([True, False, True])})
        assert_refused(walker_sim.ResetNeeded)
    for environment in pair:
        environment.close()
        environment.close()
    assert_refused(gymnasium.error.ClosedEnvironmentError)


def test_a_seed_beyond_64_bits(serve):
    server, _ = serve()
    walker = make_single(server)
    with pytest.raises(ValueError, match=f"seed = {2**64}: must be an integer from 0 to"):
        walker.reset(seed=2**64)
    walker.reset(seed=2**64 - 1)


def test_a_refusal_by_the_server(serve):
    """Another client ends the episode; the error message is the server's."""
    server, _ = serve(max_episode_steps=1)
    options = {"transport": "ros", "server": server, "max_episode_steps": 1}
    one, other = (WalkerEnv("BipedalWalker-v3", **options) for _ in range(2))
    one.reset(seed=1)
    other.reset(seed=1)
    other.step(np.zeros(4))
    with pytest.raises(walker_sim.RequestRefused, match="the episode ended after 1 steps"):
        one.step(np.zeros(4))
    one.reset(seed=1)
    one.step(np.zeros(4))
