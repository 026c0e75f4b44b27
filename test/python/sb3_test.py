"""walker_sim.sb3.VecEnv has the bits, types and infos of Stable-Baselines3's DummyVecEnv.

Its BipedalWalker is Gymnasium's, so ours uses reuse_world: Gymnasium keeps the Box2D world between
episodes. sb3_promises_test.py has the bits of all ids.
"""

import copy
import pickle
import sys
import types
import warnings

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium_reference import equal_bits
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecMonitor,
    VecVideoRecorder,
)
from walker_sim.sb3 import VecEnv
from walkers import OVERFLOW, overflowing
from worlds_test import ALL

NUM_ENVS = 5
SEED = 11
# Some episodes terminate before, some do not.
LIMITS = {"BipedalWalker-v3": 90, "Walker2d-v5": 12}

pytestmark = pytest.mark.usefixtures("promotion")


def make_ours(env_id, num_envs=NUM_ENVS, **keywords):
    same = {"reuse_world": True} if env_id == "BipedalWalker-v3" else {}
    return VecEnv(env_id, num_envs, max_episode_steps=LIMITS[env_id], **same, **keywords)


def make_reference(env_id, num_envs=NUM_ENVS):
    """Wraps Gymnasium's BipedalWalkers, but this package's Walker2d: Gymnasium's needs another
    MuJoCo."""
    name = env_id if env_id == "BipedalWalker-v3" else f"walker_sim/{env_id}"
    make = lambda: gymnasium.make(name, max_episode_steps=LIMITS[env_id])  # noqa: E731
    return DummyVecEnv([make] * num_envs)


def actions_for(environments, num_steps):
    """Shape (steps, n, action size); some are beyond the bounds."""
    random = np.random.default_rng(SEED)
    shape = (num_steps, environments.num_envs, *environments.action_space.shape)
    return random.uniform(-1.2, 1.2, shape).astype(np.float32)


def assert_equal(ours, theirs):
    if isinstance(theirs, dict):
        assert ours.keys() == theirs.keys()
        for key in theirs:
            assert_equal(ours[key], theirs[key])
    elif isinstance(theirs, list):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs):
            assert_equal(one, other)
    elif isinstance(theirs, np.ndarray):
        assert ours.dtype == theirs.dtype
        assert equal_bits(ours, theirs)
    else:
        assert isinstance(ours, bool) == isinstance(theirs, (bool, np.bool_))
        assert equal_bits(ours, theirs)


def test_the_rows_of_failed_resets(tmp_path):
    environments = VecEnv("Walker2d-v5", 20, max_episode_steps=3, **overflowing(tmp_path))
    environments.seed(0)
    observations = environments.reset()
    words = [info.get("error") for info in environments.reset_infos]
    assert {*words} == {None, OVERFLOW}
    failed = np.array([bool(word) for word in words])
    assert (~observations.any(axis=1)).tolist() == failed.tolist()
    observations, rewards, dones, infos = environments.step(np.zeros((20, 6), np.float32))
    failed_again, begun = failed & dones, failed & ~dones
    assert not rewards[failed].any()
    assert failed_again.any() and not observations[failed_again].any()
    for walker in np.flatnonzero(failed_again):
        assert not infos[walker]["terminal_observation"].any()
    assert begun.any() and observations[begun].any(axis=1).all()
    assert not any("error" in infos[walker] for walker in np.flatnonzero(begun))


def assert_same_course(ours, reference, num_steps):
    """Returns the numbers of terminated and of truncated episodes."""
    counts = [0, 0]
    assert_equal(ours.reset(), reference.reset())
    for actions in actions_for(ours, num_steps):
        results = ours.step(actions)
        expected = reference.step(actions)
        assert_equal(list(results), list(expected))
        assert_equal(ours.reset_infos, reference.reset_infos)
        for is_done, info in zip(results[2], results[3]):
            if is_done:
                counts[info["TimeLimit.truncated"]] += 1
    return counts


def test_equals_dummy_vec_env():
    ours, reference = make_ours("BipedalWalker-v3"), make_reference("BipedalWalker-v3")
    assert ours.observation_space == reference.observation_space
    assert ours.action_space == reference.action_space
    assert ours.num_envs == reference.num_envs
    assert ours.render_mode is reference.render_mode is None
    assert ours.seed(SEED) == reference.seed(SEED)
    counts = assert_same_course(ours, reference, 300)
    assert min(counts) > 0, "both ends of an episode must have been seen"
    # A seed applies to one reset; the next reset continues the generators.
    assert_same_course(ours, reference, 10)
    ours.close()
    reference.close()


def test_equals_dummy_vec_env_in_worlds():
    everything = ALL["Walker2d-v5"]
    worlds = [None, everything, "moon", {"gravity": (-20, -5)}, {**everything, "dropout": 0.9}]
    ours, reference = make_ours("Walker2d-v5", world=worlds), make_reference("Walker2d-v5")
    for index, world in enumerate(worlds):
        reference.env_method("set_world", world, indices=index)
    assert ours.get_attr("world") == reference.get_attr("world")
    assert ours.seed(SEED) == reference.seed(SEED)
    assert min(assert_same_course(ours, reference, 100)) > 0
    for envs in (ours, reference):
        assert envs.env_method("set_world", "slippery", indices=[0, 2]) == [None, None]
    ours.set_world([None, "noisy"], indices=[1, 4])
    reference.env_method("set_world", None, indices=1)
    reference.env_method("set_world", "noisy", indices=4)
    assert_same_course(ours, reference, 30)
    for options in (
        {"world": {"gravity": (-9, -8)}},
        [{}, {"world": "moon"}, {}, {"world": None}, {}],
    ):
        for envs in (ours, reference):
            envs.set_options(options)
        assert_same_course(ours, reference, 30)


def test_a_learner_makes_the_id():
    """Stable-Baselines3 first makes the environment with a render mode; that must not fail."""
    model = PPO("MlpPolicy", "walker_sim/BipedalWalker-v3", n_steps=64, batch_size=32, device="cpu")
    model.learn(64)
    assert model.num_timesteps == 64
    assert isinstance(model.get_env().unwrapped.envs[0].unwrapped, walker_sim.WalkerEnv)


@pytest.mark.parametrize("env_id", walker_sim.ids())
def test_check_env_without_a_warning(env_id):
    environment = gymnasium.make(env_id)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment)
        check_env(environment.unwrapped)


def test_results_belong_to_the_caller():
    environments = make_ours("BipedalWalker-v3")
    first = environments.reset()
    copies = first.copy()
    results = [environments.step(actions)[0] for actions in actions_for(environments, 3)]
    assert equal_bits(first, copies)
    assert not any(np.shares_memory(first, observations) for observations in results)


def test_attributes():
    environments = make_ours("BipedalWalker-v3")
    assert environments.get_attr("render_mode") == [None] * NUM_ENVS
    assert environments.get_attr("dt", 2) == [1 / 50]
    assert environments.get_attr("spec")[0].id == "walker_sim/BipedalWalker-v3"
    assert environments.get_attr("action_space", [0, 1]) == [environments.action_space] * 2
    environments.set_attr("mark", "second", indices=1)
    environments.set_attr("mark", "other", indices=[0, 2, 3, 4])
    assert environments.get_attr("mark", [1, 0]) == ["second", "other"]
    environments.set_attr("raised", lambda base, power: base**power)
    assert environments.env_method("raised", 3, power=2, indices=[0, 4]) == [9, 9]
    assert environments.env_is_wrapped(Monitor) == [False] * NUM_ENVS
    assert environments.env_is_wrapped(Monitor, indices=[0, 1]) == [False] * 2
    for access in (environments.get_attr, environments.env_method):
        with pytest.raises(AttributeError, match="no attribute 'gravity'; must be one of"):
            access("gravity")
    with pytest.raises(AttributeError, match="hardcore cannot be set to True"):
        environments.set_attr("hardcore", True)


def test_pictures_of_dummy_vec_env(tmp_path):
    ours = make_ours("BipedalWalker-v3", 2, render_mode="rgb_array")
    make = lambda: gymnasium.make("walker_sim/BipedalWalker-v3", render_mode="rgb_array")  # noqa: E731
    reference = DummyVecEnv([make] * 2)
    assert ours.render_mode == reference.render_mode == "rgb_array"
    assert ours.metadata["render_modes"] == reference.metadata["render_modes"]
    for environments in (ours, reference):
        environments.seed(SEED)
        environments.reset()
        environments.step(np.zeros((2, 4)))
    assert_equal(list(ours.get_images()), list(reference.get_images()))
    assert_equal(ours.render(), reference.render())
    assert_equal(VecMonitor(ours).render("rgb_array"), reference.render("rgb_array"))
    with pytest.warns(UserWarning, match="no `render_mode` was passed"):
        assert VecEnv("BipedalWalker-v3").render() is None


def test_a_video(tmp_path, monkeypatch):
    """Replaces moviepy, which only encodes the frames that are checked here."""
    monkeypatch.setitem(sys.modules, "moviepy", types.ModuleType("moviepy"))
    environments = make_ours("BipedalWalker-v3", 2, render_mode="rgb_array")
    recorder = VecVideoRecorder(environments, str(tmp_path), lambda step: step == 0, 100)
    assert recorder.frames_per_sec == 50
    recorder.reset()
    for _ in range(3):
        recorder.step(np.zeros((2, 4)))
    assert [frame.shape for frame in recorder.recorded_frames] == [(800, 600, 3)] * 4
    recorder.recording = False


def test_a_window(pygame):
    environments = make_ours("BipedalWalker-v3", 2, render_mode="human", width=60, height=40)
    environments.reset()
    environments.step(np.zeros((2, 4)))
    assert environments.render() is None
    assert pygame.display.get_surface().get_size() == (60, 40)
    environments.close()
    assert pygame.display.get_surface() is None


def test_subproc_vec_env_takes_the_prefix():
    name = "walker_sim:walker_sim/BipedalWalker-v3"
    apart = {"vec_env_cls": SubprocVecEnv, "vec_env_kwargs": {"start_method": "spawn"}}
    envs = make_vec_env(name, 1, seed=SEED, **apart)
    observations = envs.reset()
    envs.close()
    assert equal_bits(observations, make_vec_env(name, 1, seed=SEED).reset())


def test_calls_out_of_order():
    environments = VecEnv("BipedalWalker-v3", 2)
    with pytest.raises(walker_sim.ResetNeeded):
        environments.step(np.zeros((2, 4)))
    environments.reset()
    with pytest.raises(RuntimeError, match="step_wait without actions; call step_async first"):
        environments.step_wait()
    with pytest.raises(walker_sim.InvalidAction, match=r"shape \(4, 2\); must have \(2, 4\)"):
        environments.step(np.zeros((4, 2)))
    environments.step(np.zeros((2, 4)))
    environments.close()
    environments.close()
    with pytest.raises(RuntimeError, match="this VecEnv is closed"):
        environments.reset()


def test_over_ros_as_in_process(serve):
    common = {"num_envs": NUM_ENVS, "max_episode_steps": LIMITS["Walker2d-v5"]}
    name, _ = serve("Walker2d-v5", autoreset_mode="same_step", **common)
    remote = make_ours("Walker2d-v5", transport="ros", server=name)
    ours = make_ours("Walker2d-v5")
    remote.seed(SEED)
    ours.seed(SEED)
    assert_same_course(remote, ours, 60)
    remote.close()


def test_states_by_env_method():
    environments = VecEnv("Walker2d-v5", 3)
    environments.reset()
    states = environments.env_method("get_state")
    assert states == environments.get_state()
    assert environments.env_method("get_state", indices=[2]) == states[2:]
    assert environments.env_method("set_state", states[0]) == [None] * 3
    assert environments.get_state() == states[:1] * 3


def test_copies_and_their_original_continue_equally():
    original = VecEnv("Hopper-v5", 3, max_episode_steps=25)
    original.seed(1)
    original.reset()
    actions = actions_for(original, 100)

    def play(envs, actions):
        return [list(envs.step(action)) for action in actions]

    play(original, actions[:30])
    states = original.get_state()
    twins = [copy.copy(original), copy.deepcopy(original), pickle.loads(pickle.dumps(original))]
    expected = play(twins[0], actions[30:])
    for envs in (*twins[1:], original):
        assert_equal(play(envs, actions[30:]), expected)
    twins[0].set_state(states[::-1])
    twins[0].set_state(states[:1], 1)
    assert twins[0].get_state() == [states[2], states[0], states[0]]
    with pytest.raises(ValueError, match="environment 2: the state is damaged"):
        original.set_state([states[0][:-1]], 2)
    original.close()
    with pytest.raises(RuntimeError, match="closed"):
        original.get_state()
