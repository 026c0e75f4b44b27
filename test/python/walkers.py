"""Makes this package's environments and Gymnasium's, and plays them."""

from __future__ import annotations

import pathlib
import pickle

import gymnasium
import numpy as np
import pytest

ASSETS = pathlib.Path(__file__).resolve().parents[2] / "assets"
IDS = (
    *("BipedalWalker-v3", "BipedalWalkerHardcore-v3"),
    *("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"),
)


def make_ours(environment_id, **parameters):
    import walker_sim  # noqa: F401  # registers the ids

    return gymnasium.make(f"walker_sim/{environment_id}", **parameters)


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


def through_pickle(value):
    return pickle.loads(pickle.dumps(value))


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
