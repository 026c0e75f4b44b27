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


def refusal(call):
    with pytest.raises(Exception) as caught:
        call()
    return type(caught.value), str(caught.value)


def test_a_single_walker_refuses_as_in_process(serve):
    server, _ = serve(max_episode_steps=2)
    remote = WalkerEnv("BipedalWalker-v3", transport="ros", server=server, max_episode_steps=2)
    local = WalkerEnv("BipedalWalker-v3", max_episode_steps=2)

    def same(call):
        ours, theirs = refusal(lambda: call(remote)), refusal(lambda: call(local))
        assert ours == theirs
        return ours[0]

    good = np.zeros(4, np.float32)
    assert same(lambda walker: walker.step(good)) is walker_sim.ResetNeeded
    for walker in (remote, local):
        walker.reset(seed=1)
    for value in (np.nan, np.inf, -np.inf):
        bad = np.array([0, 0, value, 0], np.float32)
        assert same(lambda walker: walker.step(bad)) is walker_sim.InvalidAction  # noqa: B023
    assert same(lambda walker: walker.step(np.zeros(3))) is walker_sim.InvalidAction
    for walker in (remote, local):
        walker.step(good)
        walker.step(good)
    assert same(lambda walker: walker.step(good)) is walker_sim.ResetNeeded
    for walker in (remote, local):
        walker.close()
        walker.close()
    assert same(lambda walker: walker.step(good)) is gymnasium.error.ClosedEnvironmentError


@pytest.mark.parametrize("mode", ["next_step", "disabled"])
def test_a_batch_refuses_as_in_process(serve, mode):
    options = {"max_episode_steps": 2, "autoreset_mode": mode}
    server, _ = serve(num_envs=3, **options)
    remote = gymnasium.make_vec(BATCH, 3, transport="ros", server=server, **options)
    local = gymnasium.make_vec(BATCH, 3, **options)
    good = np.zeros((3, 4), np.float32)

    def same(call):
        ours, theirs = refusal(lambda: call(remote)), refusal(lambda: call(local))
        assert ours == theirs
        return ours[0]

    assert same(lambda walkers: walkers.step(good)) is walker_sim.ResetNeeded
    for walkers in (remote, local):
        walkers.reset(seed=1)
    bad = good.copy()
    bad[1, 2] = np.nan
    assert same(lambda walkers: walkers.step(bad)) is walker_sim.InvalidAction
    assert same(lambda walkers: walkers.step(good[:2])) is walker_sim.InvalidAction
    for walkers in (remote, local):
        walkers.step(good)
        walkers.step(good)
    if mode == "disabled":
        assert same(lambda walkers: walkers.step(good)) is walker_sim.ResetNeeded
        for walkers in (remote, local):
            walkers.reset(options={"reset_mask": np.array([True, False, True])})
        assert same(lambda walkers: walkers.step(good)) is walker_sim.ResetNeeded
    else:
        remote.step(good)
    for walkers in (remote, local):
        walkers.close()
        walkers.close()
    assert same(lambda walkers: walkers.step(good)) is gymnasium.error.ClosedEnvironmentError


def test_a_seed_beyond_64_bits(serve):
    server, _ = serve()
    walker = make_single(server)
    with pytest.raises(ValueError, match=f"seed = {2**64}: must be an integer from 0 to"):
        walker.reset(seed=2**64)
    walker.reset(seed=2**64 - 1)


def test_np_random_is_not_available(serve):
    server, _ = serve()
    walker = make_single(server).unwrapped
    walker.reset(seed=1)
    message = "np_random: over ROS there is none"
    with pytest.raises(AttributeError, match=message):
        walker.np_random  # noqa: B018
    with pytest.raises(AttributeError, match=message):
        walker.np_random = np.random.default_rng(1)


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
