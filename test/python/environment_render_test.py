"""``render`` of a single environment, compared with Gymnasium's."""

import copy

import gymnasium
import numpy as np
import pytest
import walker_sim
from gymnasium.wrappers import AddRenderObservation, HumanRendering, RecordVideo, RenderCollection
from walker_sim import WalkerEnv, _core
from walker_sim.rendering import ALL_MODES, camera_parameters_of
from walkers import (
    IDS,
    ROBOTS,
    follow,
    make_ours,
    make_theirs,
    parts,
    random_actions,
    restored,
    run_python,
    through_pickle,
)

PAIRS = pytest.mark.parametrize("env_id", IDS)


@pytest.fixture(autouse=True)
def dummy_display(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    # Lets Gymnasium's Walker2d render without a display.
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("EGL_PLATFORM", "surfaceless")


def modes_of(env_id):
    return ALL_MODES if env_id in ROBOTS else ALL_MODES[:2]


def after_some_steps(env_id, render_mode="rgb_array", make=make_ours, **keywords):
    environment = make(env_id, render_mode=render_mode, **keywords)
    environment.reset(seed=4)
    for action in random_actions(env_id, 8):
        environment.step(action)
    return environment


@pytest.mark.parametrize(
    ("env_id", "mode"), [(env_id, mode) for env_id in IDS for mode in modes_of(env_id)[1:]]
)
def test_shapes_and_types_are_gymnasiums(env_id, mode):
    ours = after_some_steps(env_id, mode).render()
    theirs = after_some_steps(env_id, mode, make_theirs).render()
    assert type(ours) is type(theirs)
    for our, their in zip(parts(ours), parts(theirs)):
        assert our.shape == their.shape
        assert our.dtype == their.dtype
    assert parts(ours)[-1].flags.owndata
    if mode == "depth_array":  # edges may differ by one pixel
        assert np.mean(np.abs(ours - theirs) < 1e-6) > 0.999
        assert ours.min() >= 0
        assert ours.max() <= 1


@pytest.mark.parametrize("env_id", ROBOTS)
def test_a_tuple_has_both_pictures(env_id):
    rgb, depth = after_some_steps(env_id, "rgbd_tuple").render()
    assert np.array_equal(rgb, after_some_steps(env_id, "rgb_array").render())
    assert np.array_equal(depth, after_some_steps(env_id, "depth_array").render())


@PAIRS
def test_a_window_changes_no_trajectory(env_id):
    """renderer_test.py tests pictures."""
    plain = make_ours(env_id)
    watched = make_ours(env_id, render_mode="human", width=64, height=48)
    for environment in (plain, watched):
        environment.reset(seed=4)
    actions = random_actions(env_id, 150)
    assert follow(watched, actions) == follow(plain, actions)
    states = [each.unwrapped.np_random.bit_generator.state for each in (plain, watched)]
    assert states[0] == states[1]
    watched.close()


@PAIRS
@pytest.mark.parametrize("copied", [copy.deepcopy, through_pickle, restored])
def test_copies_draw_the_same(env_id, copied):
    environment = after_some_steps(env_id)
    before = copied(environment)
    picture = environment.render()
    for other in (before, copied(environment)):
        assert np.array_equal(other.render(), picture)


def test_libraries_are_loaded_at_the_first_picture():
    program = """
import gymnasium, sys, walker_sim
for env_id in walker_sim.ids():
    plain = gymnasium.make(env_id)
    plain.reset()
    plain.step(plain.action_space.sample())
    assert plain.unwrapped._pictures._renderer is None
watched = gymnasium.make("walker_sim/BipedalWalker-v3", render_mode="rgb_array")
watched.reset()
libraries = ("libcairo", "libEGL", "libGL", "libOSMesa", "libSDL")
loaded = lambda: {name for name in libraries if name in open("/proc/self/maps").read()}
assert loaded() == set(), loaded()
watched.render()
assert loaded() == {"libcairo"}, loaded()
assert "pygame" not in sys.modules
"""
    run_python(program)


@PAIRS
def test_without_a_render_mode(env_id):
    environment = make_ours(env_id)
    environment.reset()
    hint = f'render_mode is None.*gymnasium.make."walker_sim/{env_id}", render_mode="rgb_array"'
    with pytest.warns(UserWarning, match=hint):
        assert environment.render() is None


def test_without_an_episode():
    environment = WalkerEnv("BipedalWalker-v3", render_mode="rgb_array")
    with pytest.raises(walker_sim.ResetNeeded, match=r"^render: there is no episode"):
        environment.render()
    environment.reset()
    environment.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="render: the environment"):
        environment.render()
    environment.reset()
    assert environment.render().any()


def test_the_last_state_of_an_episode_is_drawn():
    environment = make_ours("BipedalWalker-v3", render_mode="rgb_array")
    environment.reset(seed=1)
    before = environment.render()
    while not environment.step(np.ones(4))[2]:
        pass
    assert not np.array_equal(environment.render(), before)


FREE_CAMERA = {
    **{"trackbodyid": 2, "distance": 6.0, "lookat": np.array([0.5, 0.0, 1.0])},
    **{"elevation": -10.0, "azimuth": 60.0},
}
CHOICES = [
    *({"camera_id": 0}, {"camera_name": "track"}, {"camera_id": -1}),
    *({"width": 300, "height": 200}, {"default_camera_config": FREE_CAMERA}),
]


@pytest.mark.parametrize("keywords", CHOICES, ids=str)
def test_cameras_resemble_gymnasiums(keywords):
    from skimage.metrics import structural_similarity

    pictures = [
        after_some_steps("Walker2d-v5", make=make, **keywords).render()
        for make in (make_ours, make_theirs)
    ]
    assert structural_similarity(*pictures, channel_axis=2) >= 0.95


def test_default_cameras():
    """By default, pictures have Gymnasium's free camera, and windows track the robot."""
    known = {one["name"] for one in _core.camera_parameters_of("Walker2d-v5")}
    assert "camera_name" in known
    free = {"default_camera_config": {"distance": 3.0}}
    names = [
        camera_parameters_of("Walker2d-v5", mode, keywords)["camera_name"]
        for mode in ("rgb_array", "human")
        for keywords in ({}, {"camera_name": "track"}, {"camera_id": -1}, free)
    ]
    assert names == ["", "track", "", "", "track", "track", "", ""]


def test_gymnasiums_wrappers(tmp_path):
    environment = make_ours("BipedalWalker-v3", render_mode="rgb_array")
    environment = RenderCollection(environment)
    environment.reset(seed=1)
    environment.step(np.zeros(4, np.float32))
    assert [frame.shape for frame in environment.render()] == [(400, 600, 3)] * 2

    environment = AddRenderObservation(make_ours("BipedalWalker-v3", render_mode="rgb_array"))
    observation, _ = environment.reset(seed=1)
    assert environment.observation_space.contains(observation)

    environment = make_ours("BipedalWalker-v3", render_mode="rgb_array_list")
    environment.reset(seed=1)
    assert len(environment.render()) == 1

    environment = HumanRendering(make_ours("BipedalWalker-v3", render_mode="rgb_array"))
    environment.reset(seed=1)
    environment.step(np.zeros(4, np.float32))
    environment.close()

    environment = make_ours("BipedalWalker-v3", render_mode="rgb_array")
    environment = RecordVideo(environment, str(tmp_path), disable_logger=True)
    environment.reset(seed=1)
    environment.step(np.zeros(4, np.float32))
    assert len(environment.recorded_frames) == 2
    assert np.array_equal(environment.recorded_frames[1], environment.render())
    environment.close()
    assert len([*tmp_path.glob("*.mp4")]) == 1
