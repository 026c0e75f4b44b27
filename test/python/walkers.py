"""Makes this package's environments and Gymnasium's, plays them and compares the outcomes."""

from __future__ import annotations

import contextlib
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import threading
import time

import gymnasium
import numpy as np
import pytest
import walker_sim  # registers the ids

ASSETS = pathlib.Path(__file__).resolve().parents[2] / "assets"
IDS = (
    *("BipedalWalker-v3", "BipedalWalkerHardcore-v3"),
    *("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"),
)
ROBOTS = IDS[2:]  # on MuJoCo
MODES = ("next_step", "same_step", "disabled")


@contextlib.contextmanager
def ctrl_c(delay=0.5):
    """Sends SIGINT after a delay, and requires the block to end within 10 s: docs promise half a
    second on an idle machine. Most calls in it would take minutes."""
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    # A shell that starts the tests in the background makes them ignore SIGINT.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(delay, send)
    timer.start()
    try:
        yield
        assert sent and time.monotonic() < sent[0] + 10
    finally:
        timer.cancel()
        timer.join()
        signal.signal(signal.SIGINT, before)


def make_ours(environment_id, **parameters):
    return gymnasium.make(f"walker_sim/{environment_id}", **parameters)


def make_many(environment_id, num_envs, **options):
    return gymnasium.make_vec(f"walker_sim/{environment_id}", num_envs, **options)


def make_sync(name, num_envs, mode="next_step", **parameters):
    """Makes Gymnasium's vector environment of single ones."""
    return gymnasium.vector.SyncVectorEnv(
        [lambda: gymnasium.make(name, **parameters)] * num_envs,
        autoreset_mode=gymnasium.vector.AutoresetMode[mode.upper()],
    )


def make_theirs(environment_id, **parameters):
    """Makes Gymnasium's environment. Skips the test if Gymnasium lacks the id or the engine."""
    try:
        return gymnasium.make(environment_id, **parameters)
    except (gymnasium.error.UnregisteredEnv, gymnasium.error.DependencyNotInstalled) as error:
        pytest.skip(str(error))


def make_reference(environment_id):
    """Like `make_theirs`, but skips the test if Gymnasium's bits differ from the reference."""
    if int(np.__version__.split(".")[0]) < 2:
        pytest.skip("under NumPy 1 Gymnasium computes the cost of an action in double precision")
    return make_theirs(environment_id)


def changed_model(folder, old, new, name="walker2d_v5.xml"):
    """Writes a changed copy of one of the package's models. Returns its path."""
    text = (ASSETS / name).read_text()
    assert old in text
    path = folder / "changed.xml"
    path.write_text(text.replace(old, new))
    return str(path)


def diverging(folder):
    """Returns parameters of a Walker2d-v5 whose simulation diverges when its motors are used."""
    model = changed_model(folder, 'gear="100"', 'gear="1e14"')
    return {"xml_file": model, "terminate_when_unhealthy": False}


OVERFLOW = "MuJoCo: Stack overflow"


def overflowing(folder):
    """Returns parameters of a Walker2d-v5 whose MuJoCo stack overflows at the resets with some
    seeds, and at some steps."""
    model = changed_model(folder, 'nstack="8000"', 'nstack="520"')
    return {"xml_file": model, "terminate_when_unhealthy": False, "reset_noise_scale": 3.0}


def play(environment, seed, policy, **options):
    """Plays an episode. Returns its return, length, terminated and truncated, and the last info."""
    observation, info = environment.reset(seed=seed, options=options)
    episode_return, length, ended = 0.0, 0, False
    while not ended:
        action = np.asarray(policy(observation), np.float32)
        observation, reward, terminated, truncated, info = environment.step(action)
        episode_return += float(reward)
        length += 1
        ended = terminated or truncated
    return (episode_return, length, terminated, truncated), info


def actions_of(path, observations):
    """Returns the actions of a BipedalWalker's policy file."""
    policy = walker_sim._core.Policy(str(path))
    policy.check("BipedalWalker-v3", {})
    actions = np.empty((len(observations), 4))
    policy.act(observations, actions)
    return actions


def returns_of(fields):
    """Returns the returns of a summary, or of a grid's cell, in the order of the seeds."""
    return [outcome["return"] for outcome in fields["outcomes"]]


def through_pickle(value):
    return pickle.loads(pickle.dumps(value))


def restored(environment):
    """Returns a new WalkerEnv with the state of another environment."""
    original = environment.unwrapped
    new = walker_sim.WalkerEnv(original.env_id, **original.keywords)
    new.set_state(through_pickle(original.get_state()))
    return new


def parts(picture):
    """Returns the arrays of a picture: colours, depths, or both."""
    return picture if isinstance(picture, tuple) else (picture,)


def shown(pygame):
    """Returns the picture in the window."""
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


def run_python(program, *arguments, status=0, warns=False, **variables):
    """Runs a program in a new process, whose exit status must be `status`. Returns its stdout and
    stderr."""
    done = subprocess.run(
        [sys.executable, "-W", "default" if warns else "ignore", "-c", program, *arguments],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == status, done.stderr
    return done.stdout, done.stderr


def random_actions(environment_id, count, seed=0):
    size = {"Walker2d": 6, "Hopper": 3}.get(environment_id.partition("-")[0], 4)
    return np.random.default_rng(seed).uniform(-1, 1, (count, size)).astype(np.float32)


def follow(environment, actions):
    """Takes the actions and resets without a seed when an episode ends. Returns the outcome of each
    call, with observations as bytes, comparable by ``==``."""
    outcomes = []
    for action in actions:
        observation, *outcome, info = environment.step(action)
        outcomes.append((observation.tobytes(), *outcome, info))
        if outcome[1] or outcome[2]:
            observation, info = environment.reset()
            outcomes.append((observation.tobytes(), info))
    return outcomes


def assert_same(ours, theirs, where="", near=None):
    """Asserts equal types, keys, shapes and bits of a reset's or a step's outcome.

    With `near`, numbers may differ by that much and have another precision: the type of Gymnasium's
    Walker2d reward terms depends on NumPy's type promotion.
    """
    assert type(ours) is type(theirs), (where, ours, theirs)
    if isinstance(ours, (tuple, list)):
        assert len(ours) == len(theirs), where
        for position, (one, other) in enumerate(zip(ours, theirs)):
            assert_same(one, other, (where, position), near)
    elif isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), (where, ours, theirs)
        for key, value in ours.items():
            assert_same(value, theirs[key], (where, key), near)
    elif isinstance(ours, np.ndarray):
        assert ours.shape == theirs.shape, (where, ours, theirs)
        if ours.dtype == object:
            assert_same(list(ours), list(theirs), where, near)
        elif near is not None and ours.dtype.kind == theirs.dtype.kind == "f":
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=near, err_msg=str(where))
        else:
            assert ours.dtype == theirs.dtype, (where, ours.dtype, theirs.dtype)
            assert ours.tobytes() == theirs.tobytes(), (where, ours, theirs)
    else:
        assert ours == theirs, (where, ours, theirs)


def raises(error, message):
    """Expects an error whose message contains this text."""
    return pytest.raises(error, match=re.escape(message))


def set_world(envs, world, indices=None):
    """`WalkerVectorEnv.set_world`, also for `make_sync`'s environments."""
    if not isinstance(envs, gymnasium.vector.SyncVectorEnv):
        return envs.set_world(world, indices)
    chosen = range(envs.num_envs) if indices is None else indices
    worlds = world if isinstance(world, list) else [world] * len(chosen)
    for index, one in zip(chosen, worlds):
        envs.envs[index].unwrapped.set_world(one)


def play_both(ours, theirs, num_steps, worlds=None):
    """Compares bits and infos of vector environments of at least four walkers at resets, steps,
    autoresets and masked resets. Returns the numbers of episodes that terminated and that were
    truncated.

    `worlds` maps step numbers to arguments of `set_world` before that step.
    """
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    random, ends, mask = np.random.default_rng(3), np.zeros(2, int), np.zeros(ours.num_envs, bool)
    for number in range(num_steps):
        if worlds and number in worlds:
            for envs in (ours, theirs):
                set_world(envs, *worlds[number])
        seeds = [None] * ours.num_envs
        if number % 40 == 17:  # resets two during their episodes, one with a seed
            mask[[1, 3]], seeds[3] = True, number
        if mask.any():
            results = [
                envs.reset(seed=[*seeds], options={"reset_mask": mask.copy()})
                for envs in (ours, theirs)
            ]
            assert_same(*results, (number, mask))
        actions = random.uniform(-1.5, 1.5, ours.action_space.shape).astype(np.float32)
        result = ours.step(actions)
        assert_same(result, theirs.step(actions), number)
        ends += [result[2].sum(), result[3].sum()]
        mask = result[2] | result[3]
        if ours.autoreset_mode.name != "DISABLED":
            mask[:] = False
    return ends
