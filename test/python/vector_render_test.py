"""``render`` of WalkerVectorEnv, compared with Gymnasium's vector environment."""

import re
import sys
import types

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.wrappers import vector
from walkers import IDS, assert_same, make_many, parts, random_actions, shown

pytestmark = pytest.mark.usefixtures("pygame")

NUM_ENVS = 3
WALKER = "BipedalWalker-v3"


def make(env_id, mode="rgb_array", **keywords):
    return make_many(env_id, NUM_ENVS, render_mode=mode, **keywords)


def make_sync(env_id, mode="rgb_array"):
    return make(env_id, mode, vectorization_mode="sync")


def bring(environments, num_steps=30):
    environments.reset(seed=5)
    for actions in batches(environments, num_steps):
        environments.step(actions)
    return environments


def batches(environments, count):
    env_id = environments.spec.id.split("/")[1]
    actions = random_actions(env_id, count * NUM_ENVS)
    return actions.reshape(count, NUM_ENVS, -1)


@pytest.mark.parametrize(
    ("env_id", "mode"),
    [
        *((env_id, "rgb_array") for env_id in IDS),
        ("Walker2d-v5", "depth_array"),
        ("Walker2d-v5", "rgbd_tuple"),
    ],
)
def test_pictures_equal_those_of_single_walkers(env_id, mode):
    ours, theirs = bring(make(env_id, mode)), bring(make_sync(env_id, mode))
    pictures = ours.render()
    assert_same(pictures, theirs.render())
    assert ours.render_mode == theirs.render_mode == mode
    assert type(pictures) is tuple
    assert [len(parts(one)) for one in pictures] == [2 if mode == "rgbd_tuple" else 1] * NUM_ENVS


def test_after_an_autoreset_the_new_episode_is_shown():
    """The lidar's ray identifies the step."""
    ours, theirs = (make_any(WALKER) for make_any in (make, make_sync))
    num_ends = 0
    for environments in (ours, theirs):
        environments.reset(seed=5)
    for actions in batches(ours, 150):
        ended = ours.step(actions)[2]
        theirs.step(actions)
        num_ends += ended.sum()
        if ended.any():
            for _ in range(2):
                ours.step(actions)
                theirs.step(actions)
                assert_same(ours.render(), theirs.render())
    assert num_ends > 0


def test_a_window_shows_the_first_walker(pygame):
    environments = bring(make(WALKER, "human"), 4)
    drawn = bring(make(WALKER), 4)
    assert environments.render() is None
    assert np.array_equal(shown(pygame), drawn.render()[0])
    environments.close()
    assert pygame.display.get_surface() is None


def test_a_window_before_the_first_walkers_first_reset():
    environments = make(WALKER, "human", autoreset_mode="disabled")
    environments.reset(options={"reset_mask": np.array([False, True, True])})
    environments.reset(options={"reset_mask": np.array([True, False, False])})
    environments.close()


def test_a_window_while_walkers_are_in_flight():
    environments = make(WALKER, "human", batch_size=1)
    environments.async_reset(seed=5)
    arrived = [environments.recv()[-1]["env_id"][0] for _ in range(NUM_ENVS)]
    assert sorted(arrived) == [0, 1, 2]
    environments.close()


def test_record_video(tmp_path, monkeypatch):
    """Replaces moviepy, which only writes the file."""
    monkeypatch.setitem(sys.modules, "moviepy", types.ModuleType("moviepy"))
    environments = vector.RecordVideo(
        make(WALKER), str(tmp_path), episode_trigger=lambda episode: True
    )
    assert environments.frames_per_sec == 50
    environments.reset(seed=5)
    for _ in range(3):
        environments.step(np.zeros((NUM_ENVS, 4), np.float32))
    frames = environments.recorded_frames
    assert len(frames) == 4
    assert frames[0].size == NUM_ENVS * 400 * 600 * 3
    environments.recording = False


def test_refused_calls():
    environments = make(WALKER)
    with pytest.raises(walker_sim.ResetNeeded, match=r"^render: there is no episode"):
        environments.render()
    environments.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="render: this environment"):
        environments.render()
    environments = make(WALKER, None)
    environments.reset()
    hint = re.escape(f'gymnasium.make("walker_sim/{WALKER}", render_mode="rgb_array")')
    with pytest.warns(UserWarning, match=hint):
        assert environments.render() is None
