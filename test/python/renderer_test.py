"""Python binding of renderers: rejected arguments, and concurrency while rendering."""

import threading

import numpy as np
import pytest
from walker_sim import WalkerEnv, _core
from walkers import IDS, follow, make_many, random_actions, through_pickle


def begun(env_id):
    environment = WalkerEnv(env_id)
    environment.reset(seed=5)
    return environment


def capture(environment, walker=0):
    return environment._walkers._pool.capture(walker)


def drawn(renderer, captured):
    camera = renderer.camera
    rgb = np.empty((camera["height"], camera["width"], 3), np.uint8)
    renderer.render(captured, rgb, None)
    return rgb


@pytest.mark.parametrize("env_id", IDS)
def test_the_camera_is_known_before_the_first_picture(env_id):
    camera = _core.Renderer(env_id, {}, {"width": 64}).camera
    assert camera["width"] == 64
    known = {each["name"]: each["default"] for each in _core.camera_parameters_of(env_id)}
    assert camera["height"] == known["height"]
    assert (camera["near"] > 0) == env_id.startswith(("Walker2d", "Hopper"))
    assert camera["near"] <= camera["far"]


@pytest.mark.parametrize("env_id", IDS)
def test_a_picture_depends_on_its_capture_alone(env_id):
    environment = begun(env_id)
    renderer = _core.Renderer(env_id, {}, {})
    captures = [capture(environment)]
    for action in random_actions(env_id, 12):
        environment.step(action)
        captures.append(capture(environment))
    assert [captured.step for captured in captures] == [*range(13)]
    assert capture(through_pickle(environment)).step == 12
    pictures = [drawn(renderer, captured) for captured in captures]
    for before, after in zip(pictures[::4], pictures[4::4]):
        assert not np.array_equal(before, after)
    other = _core.Renderer(env_id, {}, {})
    for captured, picture in reversed([*zip(captures, pictures)]):
        for each in (renderer, other):
            assert np.array_equal(drawn(each, captured), picture)


def test_walkers_in_flight_are_not_captured():
    env_id = "BipedalWalker-v3"
    action = np.zeros((1, 4))
    envs = make_many(env_id, 2, batch_size=1, num_threads=1)
    envs.reset(seed=[1, 5])
    envs.send(action, [1])
    with pytest.raises(RuntimeError, match="environment 1"):
        capture(envs, 1)
    assert envs.recv()[-1]["env_id"] == [1]
    environment = begun(env_id)
    environment.step(action[0])
    renderer = _core.Renderer(env_id, {}, {})
    assert np.array_equal(drawn(renderer, capture(envs, 1)), drawn(renderer, capture(environment)))


def test_invalid_arguments():
    env_id = "BipedalWalker-v3"
    environment = begun(env_id)
    with pytest.raises(ValueError, match="environment 7"):
        capture(environment, 7)
    renderer = _core.Renderer(env_id, {}, {})
    captured = capture(environment)
    with pytest.raises(ValueError, match="rgb has 12 values; must have 720000"):
        renderer.render(captured, np.empty((2, 2, 3), np.uint8), None)
    with pytest.raises(TypeError, match="rgb: must be a C-contiguous array of uint8"):
        renderer.render(captured, np.empty((400, 600, 3)), None)
    with pytest.raises(ValueError, match="depth"):
        renderer.render(captured, None, np.empty((400, 600), np.float32))


@pytest.mark.parametrize("env_id", IDS)
def test_pictures_in_other_threads_change_no_trajectory(env_id):
    actions = random_actions(env_id, 200)
    alone = follow(begun(env_id), actions)
    environment = begun(env_id)
    renderer = _core.Renderer(env_id, {}, {"width": 64, "height": 48})
    has_ended, counts, failures = threading.Event(), [0, 0], []

    def draw(index):
        try:
            while not has_ended.is_set():
                drawn(renderer, capture(environment))
                counts[index] += 1
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=draw, args=[index]) for index in (0, 1)]
    for thread in threads:
        thread.start()
    watched = [follow(environment, actions)]
    while min(counts) < 3 and not failures:
        environment.reset(seed=5)
        watched.append(follow(environment, actions))
    has_ended.set()
    for thread in threads:
        thread.join()
    assert failures == []
    assert all(outcomes == alone for outcomes in watched)


def test_other_threads_run_while_a_picture_is_drawn():
    """If rendering held the GIL, no step would complete before the picture."""
    environment = begun("BipedalWalker-v3")
    renderer = _core.Renderer("BipedalWalker-v3", {}, {"width": 4096, "height": 4096})
    picture = np.empty((4096, 4096, 3), np.uint8)
    is_drawing, is_drawn = threading.Event(), threading.Event()

    def draw():
        captured = capture(environment)
        is_drawing.set()
        renderer.render(captured, picture, None)
        is_drawn.set()

    def steps_meanwhile():
        environment.reset(seed=5)
        is_drawing.clear()
        is_drawn.clear()
        thread = threading.Thread(target=draw)
        thread.start()
        is_drawing.wait()
        count = 0
        while count < 20 and not is_drawn.is_set():
            environment.step(np.zeros(4))
            count += 1
        thread.join()
        return count

    # On a busy machine, this thread may not be scheduled during some pictures.
    assert any(steps_meanwhile() == 20 for _ in range(20))
