"""Stable-Baselines3's make_vec_env with walker_sim.sb3.VecEnv equals DummyVecEnv to the bit."""

import re

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.wrappers import RescaleAction
from sb3_test import assert_equal
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor, load_results
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from walker_sim.sb3 import VecEnv

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

NUM_ENVS = 4
LIMITS = {"BipedalWalker-v3": 90, "Walker2d-v4": 12}


def make(kind, env_id="BipedalWalker-v3", **keywords):
    keywords.setdefault("env_kwargs", {"max_episode_steps": LIMITS[env_id]})
    keywords.setdefault("seed", 11)
    return make_vec_env(f"walker_sim/{env_id}", NUM_ENVS, vec_env_cls=kind, **keywords)


def both(*arguments, **keywords):
    return [make(kind, *arguments, **keywords) for kind in (VecEnv, DummyVecEnv)]


def without_time(info):
    if "episode" in info:
        info = {**info, "episode": {**info["episode"], "t": None}}
    return info


def step_equally(ours, theirs, actions):
    """Steps both environments, whose results must be equal. Returns our infos."""
    *given, infos = ours.step(actions)
    *expected, their_infos = theirs.step(actions)
    assert_equal(given, expected)
    assert_equal([*map(without_time, infos)], [*map(without_time, their_infos)])
    return infos


def test_equals_dummy_vec_env():
    ours, theirs = both("Walker2d-v4")
    assert isinstance(ours, VecEnv) and ours.num_envs == NUM_ENVS
    assert ours.render_mode == theirs.render_mode == "rgb_array"
    assert ours.reset().tobytes() == theirs.reset().tobytes()
    ends = [0, 0]
    for _ in range(250):
        actions = np.array([theirs.action_space.sample() for _ in range(NUM_ENVS)])
        assert actions.tobytes() == b"".join(
            ours.action_space.sample().tobytes() for _ in range(NUM_ENVS)
        )
        for info in step_equally(ours, theirs, actions):
            if "episode" in info:
                assert info["episode"]["t"] > 0
                ends[info["TimeLimit.truncated"]] += 1
    assert min(ends) > 0, "both ends of an episode must have been seen"
    for name in ("get_total_steps", "get_episode_rewards", "get_episode_lengths"):
        assert ours.env_method(name) == theirs.env_method(name)
    assert ours.env_is_wrapped(Monitor) == theirs.env_is_wrapped(Monitor) == [True] * NUM_ENVS
    assert ours.env_is_wrapped(VecNormalize) == [False] * NUM_ENVS


def test_monitors_write_their_files(tmp_path):
    for kind, name in ((VecEnv, "ours"), (DummyVecEnv, "theirs")):
        environments = make(kind, monitor_dir=str(tmp_path / name))
        environments.reset()
        for _ in range(200):
            environments.step(np.full((NUM_ENVS, 4), 0.5, np.float32))
        environments.close()
        assert len([*(tmp_path / name).iterdir()]) == NUM_ENVS
    ours, theirs = (load_results(str(tmp_path / name)) for name in ("ours", "theirs"))
    assert len(ours) > NUM_ENVS
    columns = ["r", "l"]
    assert sorted(ours[columns].values.tolist()) == sorted(theirs[columns].values.tolist())


def test_parameters_and_threads_reach_the_walkers():
    environments = make(
        VecEnv,
        env_kwargs={"hardcore": True, "width": 60, "height": 40, "max_episode_steps": 3},
        vec_env_kwargs={"num_threads": 2},
    )
    hardcore = VecEnv("BipedalWalkerHardcore-v3", NUM_ENVS)
    hardcore.seed(11)
    assert environments.reset().tobytes() == hardcore.reset().tobytes()
    assert [picture.shape for picture in environments.get_images()] == [(40, 60, 3)] * NUM_ENVS
    assert environments._walkers.num_threads == 2
    dones = [environments.step(np.zeros((NUM_ENVS, 4)))[2].all() for _ in range(3)]
    assert dones == [False, False, True]


def test_time_limits():
    """Also without a limit, and with a class instead of an id."""
    for env_kwargs, limit in ({}, 1600), ({"max_episode_steps": -1}, 0):
        environments = make(VecEnv, env_kwargs=env_kwargs)
        assert environments._walkers.specification["max_episode_steps"] == limit
    environments = make_vec_env(
        walker_sim.WalkerEnv, 2, vec_env_cls=VecEnv, env_kwargs={"env_id": "Walker2d-v5"}
    )
    assert environments._walkers.specification["max_episode_steps"] == 0
    assert environments.env_is_wrapped(Monitor) == [True, True]


def test_functions_without_a_monitor():
    def make_one():
        return gymnasium.make("walker_sim/Walker2d-v5", max_episode_steps=7)

    assert VecEnv(make_one for _ in range(2)).num_envs == 2
    ours, theirs = VecEnv([make_one] * 3), DummyVecEnv([make_one] * 3)
    for environments in (ours, theirs):
        environments.seed(1)
    assert ours.reset().tobytes() == theirs.reset().tobytes()
    assert ours.env_is_wrapped(Monitor) == [False] * 3
    for _ in range(20):
        step_equally(ours, theirs, np.full((3, 6), 0.4, np.float32))


def test_refused_functions():
    def of(name, **keywords):
        return lambda: gymnasium.make(name, **keywords)

    bounds = {"min_action": np.float32(-2), "max_action": np.float32(2)}
    walker = of("walker_sim/BipedalWalker-v3")
    cases = [
        (TypeError, "RescaleAction: walkers that are stepped together cannot have this wrapper",
         lambda: make(VecEnv, wrapper_class=RescaleAction, wrapper_kwargs=bounds)),
        (TypeError, "CartPoleEnv: must be a walker of walker_sim",
         lambda: make_vec_env("CartPole-v1", vec_env_cls=VecEnv)),
        (ValueError, "environment 1: BipedalWalker-v3 with {'hardcore': True, ",
         lambda: VecEnv([walker, of("walker_sim/BipedalWalker-v3", hardcore=True)])),
        (ValueError, "environment 1: Hopper-v5 with ",
         lambda: VecEnv([walker, of("walker_sim/Hopper-v5")])),
        (ValueError, "1 of 2 walkers have a Monitor; must be all",
         lambda: VecEnv([walker, lambda: Monitor(walker())])),
        (ValueError, "environment []: must be an id, or functions, one for each walker",
         lambda: VecEnv([])),
        (ValueError, "hardcore = True: determined by the functions that make the walkers",
         lambda: VecEnv([walker], hardcore=True)),
        (ValueError, "num_envs = 3: determined by the functions that make the walkers",
         lambda: VecEnv([walker], 3)),
        (ValueError, "server = '/other': determined by the functions that make the walkers",
         lambda: VecEnv([walker], server="/other")),
        (TypeError, "environment 7: must be an id, or functions", lambda: VecEnv(7)),
        (TypeError, "environment ['Hopper-v5']: must be an id, or functions",
         lambda: VecEnv(["Hopper-v5"])),
    ]  # fmt: skip
    for error, words, call in cases:
        with pytest.raises(error, match=re.escape(words)):
            call()


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"num_envs": 0}, ValueError, "num_envs = 0: must be at least 1"),
        ({"num_threads": -1}, ValueError, "num_threads = -1: must be at least 0"),
        ({"render_mode": "depth_array"}, ValueError, "must be None or one of human, rgb_array"),
        ({"max_episode_steps": -5}, ValueError, "max_episode_steps = -5"),
        ({"num_thread": 1}, ValueError, "num_thread = 1: unknown; did you mean num_threads?"),
        ({"batch_size": 1}, ValueError, "parameter batch_size = 1: unknown"),
    ],
)
def test_keywords(given, error, words):
    with pytest.raises(error, match=re.escape(words)):
        VecEnv(**{"env_id": "Walker2d-v5", **given})
    environments = VecEnv("walker_sim/BipedalWalker-v3", np.int64(2), max_episode_steps=-1)
    assert environments.reset().shape == (2, 24)


def test_indices_of_states():
    environments = VecEnv("BipedalWalker-v3", 2)
    environments.reset()
    states = environments.get_state(1)
    assert len(states) == 1
    for indices, error, message in [
        (-1, ValueError, r"environment -1: must be in \[0, 1\]"),
        ([0.5], TypeError, r"indices = \[0.5\]: must be a sequence of integers"),
    ]:
        for call in (environments.get_state, lambda given: environments.set_state(states, given)):
            with pytest.raises(error, match=message):
                call(indices)
