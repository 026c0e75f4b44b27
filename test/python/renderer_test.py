"""Python binding of renderers: rejected arguments, and concurrency while rendering."""

import pickle
import threading

import numpy as np
import pytest
from walker_sim import _core
from walkers import IDS, random_actions

SEEDED = (1, 2, 3, 5, 0, 0)  # a generator's state


def begun(env_id, **parameters):
    environment = _core.Pool(env_id, parameters)
    begin(environment)
    return environment


def begin(environment):
    environment.set_generator_states({0: SEEDED})
    environment.reset([], *arrays(environment))


def arrays(environment):
    specification = environment.specification
    size, num_infos = len(specification["observation_low"]), len(specification["info_names"])
    return np.empty(size), np.empty(num_infos)


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
    captures = [environment.capture(0)]
    for action in random_actions(env_id, 12).astype(float):
        environment.step_single(action, *arrays(environment))
        captures.append(environment.capture(0))
    assert [captured.step for captured in captures] == [*range(13)]
    assert pickle.loads(pickle.dumps(environment)).capture(0).step == 12
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
    pool = _core.Pool(env_id, {}, 2, 1, "next_step", 1)
    pool.set_generator_states({0: SEEDED, 1: SEEDED})
    pool.reset([], np.empty((2, 24)), np.empty((2, 0)))
    pool.send(action, [1])
    with pytest.raises(RuntimeError, match="environment 1"):
        pool.capture(1)
    row = (np.empty((1, 24)), np.empty(1), np.empty(1, bool), np.empty(1, bool), np.empty((1, 0)))
    assert pool.recv(row) == [1]
    environment = begun(env_id)
    environment.step_single(action[0], *arrays(environment))
    renderer = _core.Renderer(env_id, {}, {})
    assert np.array_equal(drawn(renderer, pool.capture(1)), drawn(renderer, environment.capture(0)))


def test_invalid_arguments():
    env_id = "BipedalWalker-v3"
    with pytest.raises(ValueError, match="environment 7"):
        _core.Pool(env_id, {}, 1, 1, "next_step", 0).capture(7)
    renderer = _core.Renderer(env_id, {}, {})
    captured = begun(env_id).capture(0)
    with pytest.raises(ValueError, match="rgb has 12 values; must have 720000"):
        renderer.render(captured, np.empty((2, 2, 3), np.uint8), None)
    with pytest.raises(TypeError, match="rgb: must be a C-contiguous array of uint8"):
        renderer.render(captured, np.empty((400, 600, 3)), None)
    with pytest.raises(ValueError, match="depth"):
        renderer.render(captured, None, np.empty((400, 600), np.float32))


def walk(environment, actions):
    observations = []
    for action in actions:
        observation, info = arrays(environment)
        _, terminated, _, _ = environment.step_single(action, observation, info)
        observations.append(observation.tobytes())
        if terminated:
            break
    return observations


@pytest.mark.parametrize("env_id", IDS)
def test_pictures_in_other_threads_change_no_trajectory(env_id):
    actions = random_actions(env_id, 200).astype(float)
    alone = walk(begun(env_id), actions)
    environment = begun(env_id)
    renderer = _core.Renderer(env_id, {}, {"width": 64, "height": 48})
    has_ended, counts, failures = threading.Event(), [0, 0], []

    def draw(index):
        try:
            while not has_ended.is_set():
                drawn(renderer, environment.capture(0))
                counts[index] += 1
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=draw, args=[index]) for index in (0, 1)]
    for thread in threads:
        thread.start()
    watched = [walk(environment, actions)]
    while min(counts) < 3 and not failures:
        begin(environment)
        watched.append(walk(environment, actions))
    has_ended.set()
    for thread in threads:
        thread.join()
    assert failures == []
    assert all(walked == alone for walked in watched)


def test_other_threads_run_while_a_picture_is_drawn():
    """If rendering held the GIL, no step would complete before the picture."""
    environment = begun("BipedalWalker-v3")
    renderer = _core.Renderer("BipedalWalker-v3", {}, {"width": 4096, "height": 4096})
    picture = np.empty((4096, 4096, 3), np.uint8)
    is_drawing, is_drawn = threading.Event(), threading.Event()

    def draw():
        captured = environment.capture(0)
        is_drawing.set()
        renderer.render(captured, picture, None)
        is_drawn.set()

    def steps_meanwhile():
        begin(environment)
        is_drawing.clear()
        is_drawn.clear()
        thread = threading.Thread(target=draw)
        thread.start()
        is_drawing.wait()
        count = 0
        while count < 20 and not is_drawn.is_set():
            environment.step_single(np.zeros(4), *arrays(environment))
            count += 1
        thread.join()
        return count

    # On a busy machine, this thread may not be scheduled during some pictures.
    assert any(steps_meanwhile() == 20 for _ in range(20))
