"""Episodes against the installed Gymnasium and MuJoCo: resets are equal to the bit, and the first
steps within the difference between MuJoCo versions. recordings_test.cpp has whole episodes.

MuJoCo's solver stops once an iteration improves its cost by less than a tolerance, 1e-8. If two
versions stop after different numbers of iterations, they differ by the remaining error. That is
rare while the walker flies or falls, and frequent while it stands; some steps later the difference
is a thousand times larger. A tolerance of 0 removes this source, so otherwise unchanged models must
then agree in every episode.
"""

import numpy as np
import pytest
from draws import values_of_steps
from gymnasium_reference import Plan, Session, equal_bits, play_episode
from mujoco_reference import (
    IDS,
    INFO_NAMES,
    MODELS,
    NEARLY_ALL,
    OTHER_PARAMETERS,
    Actions,
    action_size,
    make_theirs,
    own_model,
    play,
    robot_of,
)
from walker_sim import _core
from walkers import ASSETS, make_ours

STEPS = 20
NEAR = 1e-9


def play_ours(session):
    environment = make_ours(session.environment_id, **session.parameters)
    info_names = INFO_NAMES[session.environment_id]
    size = action_size(session.environment_id)
    return [
        play_episode(environment, plan, Actions(plan.kind, plan.action_seed, size), info_names)
        for plan in session.plans
    ]


def largest_differences(ours, theirs=None, change=lambda model: None):
    """Returns the largest difference of any observation, reward and info for each episode of two
    sessions with the same plans. `change` is called with the model of theirs. Asserts that resets
    and episode lengths are equal."""
    ours, theirs = (
        session._replace(parameters={"max_episode_steps": STEPS, **session.parameters})
        for session in (ours, theirs or ours)
    )
    differences = []
    for plan, our, their in zip(theirs.plans, play_ours(ours), play(theirs, change)):
        assert equal_bits(our.rows[0], their.rows[0]), plan
        assert our.rows.shape == their.rows.shape, (plan, "ended at another step")
        differences.append(np.abs(our.rows[1:] - their.rows[1:]).max())
    return np.array(differences)


def plans_of(kind, count, first=5000):
    return [Plan(kind, seed, seed) for seed in range(first, first + count)]


@pytest.mark.parametrize("model", IDS)
@pytest.mark.parametrize("kind", ["random", "saturated", "outside", "smooth", "zero"])
def test_first_steps_of_a_solver_that_converges(tmp_path, model, kind):
    sessions = []
    for name, file in (("ours", ASSETS / own_model(model)), ("theirs", MODELS[model])):
        converging = tmp_path / f"{name}.xml"
        converging.write_text(file.read_text().replace("<option ", '<option tolerance="0" ', 1))
        parameters = {"xml_file": str(converging)}
        sessions.append(Session(f"{robot_of(model)}-v5", parameters, plans_of(kind, 40)))
    assert (largest_differences(*sessions) <= NEAR).all()


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize(
    ("kind", "near", "far"),
    [
        ("random", NEAR, 1e-5),
        ("saturated", NEAR, 1e-5),
        ("outside", NEAR, 1e-5),
        ("zero", 1e-3, 1e-2),
    ],
)
def test_first_steps(environment_id, kind, near, far):
    differences = largest_differences(Session(environment_id, {}, plans_of(kind, 200)))
    assert (differences <= near).mean() >= NEARLY_ALL[robot_of(environment_id)]
    assert (differences <= far).all()


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("parameters", OTHER_PARAMETERS, ids=str)
def test_parameters(environment_id, parameters):
    plans = [Plan("random", 2**64 - 1, 1), *(Plan("saturated", None, seed) for seed in range(30))]
    session = Session(environment_id, parameters, plans)
    assert (largest_differences(session) <= NEAR).mean() >= 0.96


@pytest.mark.parametrize("environment_id", IDS)
@pytest.mark.parametrize("friction", [0.1, 1.3, 4])
def test_floor_friction_and_masses(environment_id, friction):
    """As RRLS sets them: nothing else in the model changes."""
    masses = {"torso": 0.5, "thigh": 6, "leg": 1.5, "foot": 5}
    if robot_of(environment_id) == "Walker2d":
        masses.update({"thigh_left": 2, "leg_left": 0.7, "foot_left": 0.4})
    world = {"floor_friction": friction, **{f"{body}_mass": m for body, m in masses.items()}}

    def change(model):
        model.geom("floor").friction[0] = friction
        for body, mass in masses.items():
            model.body(body).mass = mass

    plans = plans_of("random", 30)
    ours, theirs = (Session(environment_id, each, plans) for each in ({"world": world}, {}))
    assert (largest_differences(ours, theirs, change) <= NEAR).mean() >= 0.93


@pytest.mark.parametrize("environment_id", IDS)
def test_physics_that_changes(environment_id):
    ours, theirs = make_ours(environment_id), make_theirs(environment_id, {})
    world = {"change_interval": 3 * ours.unwrapped.dt, "gravity": (-15, -5), "torso_mass": (1, 8)}
    ours.unwrapped.set_world(world)
    model, size = theirs.unwrapped.model, action_size(environment_id)
    differences = []
    for seed in range(30):
        text = _core.world_text(ours.unwrapped.world)
        rows = values_of_steps(environment_id, text, seed, STEPS, len(world))
        model.opt.gravity[2], model.body("torso").mass = rows[0, 1:]
        pairs = [(ours.reset(seed=seed)[0], theirs.reset(seed=seed)[0])]
        random = np.random.default_rng(seed)
        for _, gravity, mass in rows:
            model.opt.gravity[2], model.body("torso").mass = gravity, mass
            action = random.uniform(-1, 1, size)
            (our, _, end, _, _), (their, _, also, _, _) = ours.step(action), theirs.step(action)
            pairs.append((our, their))
            assert end == also
            if end:
                break
        assert equal_bits(*pairs[0])
        differences.append(max(np.abs(our - their).max() for our, their in pairs))
    assert len(np.unique(rows, axis=0)) == 7
    assert (np.array(differences) <= NEAR).mean() >= 0.93


@pytest.mark.parametrize("environment_id", IDS[1::2])
@pytest.mark.parametrize("frame_skip", [1, 2, 5])
def test_frame_skip(environment_id, frame_skip):
    session = Session(environment_id, {"frame_skip": frame_skip}, plans_of("random", 30))
    assert (largest_differences(session) <= NEAR).mean() >= 0.96
