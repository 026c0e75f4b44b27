"""Writes the recordings of Walker2d and Hopper in this folder: Gymnasium with MuJoCo 2.2.2.

    python3.10 -m venv recorder
    recorder/bin/pip install gymnasium==1.4.0 mujoco==2.2.2 numpy==2.2.6 imageio packaging
    PYTHONPATH=test:test/robots/mujoco recorder/bin/python test/recordings/record_mujoco.py

CPython 3.10 is the latest that MuJoCo 2.2.2 supports, and NumPy 2.2 the latest for CPython 3.10.
`bits` are the IEEE 754 bits in hexadecimal.
"""

from __future__ import annotations

import functools
import itertools
import pathlib
import re

import mujoco
import numpy as np
import recording_file
from gymnasium_reference import Plan, Session
from mujoco_reference import IDS, INFO_NAMES, KINDS, MODELS, action_size, comparable, play, robot_of
from recording_file import LARGE_SEEDS, double_bits, float_bits, hash_lines, headline

write = functools.partial(
    recording_file.write,
    script="record_mujoco.py",
    packages=("gymnasium", "mujoco", "numpy"),
)

# Every parameter changed from its default, first alone, then together.
VARIANTS = (
    {"forward_reward_weight": 2.3},
    {"ctrl_cost_weight": 0.37},
    {"healthy_reward": 1.7},
    {"healthy_reward": 0.0, "ctrl_cost_weight": 0.0},
    {"healthy_z_range": (1.1, 1.3)},
    {"healthy_z_range": (0.3, 3.0), "healthy_angle_range": (-2.0, 2.0)},
    {"healthy_angle_range": (-0.2, 0.35)},
    {"reset_noise_scale": 0.1},
    {"reset_noise_scale": 0.0},
    {"exclude_current_positions_from_observation": False},
    {"max_episode_steps": 60},
    {
        "forward_reward_weight": -0.7,
        "ctrl_cost_weight": 0.011,
        "healthy_reward": 0.9,
        "healthy_z_range": (0.7, 2.5),
        "healthy_angle_range": (-1.3, 1.2),
        "reset_noise_scale": 0.05,
        "exclude_current_positions_from_observation": False,
        "max_episode_steps": 300,
    },
)
V5_VARIANTS = (
    *({"frame_skip": 1}, {"frame_skip": 2}, {"frame_skip": 5}, {"frame_skip": 10}),
    {"frame_skip": 5, "reset_noise_scale": 0.1, "ctrl_cost_weight": 0.02},
)
OWN_VARIANTS = {
    "Walker2d": (),
    "Hopper": (
        {"healthy_state_range": (-2.0, 2.0)},
        {"healthy_state_range": (-6.5, 5.5), "healthy_angle_range": (-1.0, 1.0)},
    ),
}
# These episodes reach the time limit: the walker falls and is thrown about on the floor.
LASTING = {"terminate_when_unhealthy": False}
LASTING_VARIANTS = (
    {**LASTING},
    {**LASTING, "reset_noise_scale": 0.1, "healthy_reward": 2.5},
    {**LASTING, "exclude_current_positions_from_observation": False, "forward_reward_weight": 3.1},
)


def sessions(environment_id):
    """Yields all kinds of actions in new environments, repeated resets, parameters, and edges."""
    seeds = itertools.count()
    for kind in KINDS:
        for seed in itertools.islice(seeds, 10):
            yield Session(environment_id, {}, [Plan(kind, seed, seed)])
    for seed in LARGE_SEEDS:
        yield Session(environment_id, {}, [Plan("random", seed, seed % 1000)])
    variants = [{}, *VARIANTS, *(V5_VARIANTS if environment_id.endswith("v5") else ())]
    variants += OWN_VARIANTS[robot_of(environment_id)]
    for variant, seed in zip(variants, itertools.count(1000, 10)):
        plans = [Plan("random", seed, seed)]
        plans += [Plan(kind, None, seed + i) for i, kind in enumerate(KINDS, 1)]
        plans += [Plan("saturated", seed, seed)]
        yield Session(environment_id, variant, plans)
    for variant, seed in zip(LASTING_VARIANTS, itertools.count(2000, 10)):
        plans = [Plan("saturated", seed, seed)]
        plans += [Plan(kind, None, seed + i) for i, kind in enumerate(KINDS, 1)]
        yield Session(environment_id, variant, plans)
    yield from edge_sessions(environment_id)


def edge_sessions(environment_id):
    """Yields healthy ranges that end exactly at an episode's extreme, where it is unhealthy."""
    plan = Plan("zero", 3000, 0)
    (episode,) = play(Session(environment_id, {}, [plan]))
    heights, angles = episode.rows[1:-1, 0], episode.rows[1:-1, 1]
    for name, values, (low, high) in (
        ("healthy_z_range", heights, (0.1, 3.0)),
        ("healthy_angle_range", angles, (-3.0, 3.0)),
    ):
        for edges in ((float(values.min()), high), (low, float(values.max()))):
            for lasting in ({}, {**LASTING, "max_episode_steps": len(heights)}):
                yield Session(environment_id, {name: edges, **lasting}, [plan])


def parameter_text(value):
    """Formats a parameter's value for src/base/parameter_text.h."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        return "[" + ",".join(map(repr, map(float, value))) + "]"
    return str(value)


def session_line(session):
    texts = [f"{name}={parameter_text(value)}" for name, value in session.parameters.items()]
    return " ".join(["session", session.environment_id, str(len(texts)), *texts])


def episode_lines(ids):
    for environment_id in ids:
        for session in sessions(environment_id):
            yield session_line(session)
            for plan, episode in zip(session.plans, play(session)):
                yield headline(plan, episode)
                yield from hash_lines(comparable(environment_id, plan.kind, episode.rows))


def full_episode_lines(ids):
    lasting = {**LASTING, "max_episode_steps": 120}
    for environment_id, parameters, kind in (
        *((environment_id, {}, kind) for environment_id in ids for kind in ("random", "balance")),
        *((environment_id, lasting, "outside") for environment_id in ids),
    ):
        plan = Plan(kind, 5, 5)
        session = Session(environment_id, parameters, [plan])
        (episode,) = play(session)
        first_flag = episode.rows.shape[1] - len(INFO_NAMES[environment_id]) - 2
        yield session_line(session)
        yield headline(plan, episode)
        for action, row in zip(
            [np.zeros(action_size(environment_id)), *episode.actions], episode.rows
        ):
            flags = [str(int(flag)) for flag in row[first_flag : first_flag + 2]]
            numbers = [map(double_bits, row[:first_flag]), flags]
            numbers.append(map(double_bits, row[first_flag + 2 :]))
            yield " ".join([*map(float_bits, action), *itertools.chain(*numbers)])


def model_lines(ids):
    """Yields the models' sizes, options, statistics and arrays, without textures and texts."""
    for environment_id in ids:
        model = mujoco.MjModel.from_xml_path(str(MODELS[environment_id]))
        yield f"model {environment_id}"
        for name in macro_names("MJMODEL_INTS"):
            yield field_line(name, getattr(model, name))
        for name in (*macro_names("MJOPTION_FLOATS"), *macro_names("MJOPTION_INTS")):
            yield field_line(f"opt.{name}", getattr(model.opt, name))
        for name in macro_names("MJOPTION_VECTORS"):
            yield field_line(f"opt.{name}", getattr(model.opt, name))
        for name in ("meaninertia", "meanmass", "meansize", "extent", "center"):
            yield field_line(f"stat.{name}", getattr(model.stat, name))
        for name in macro_names("MJMODEL_POINTERS"):
            if name not in ("names", "text_data", "tex_rgb"):
                yield field_line(name, getattr(model, name))
        for name in ("body", "joint", "geom", "actuator"):
            yield names_line(model, name)


def macro_names(macro):
    header = pathlib.Path(mujoco.__file__).parent / "include" / "mujoco" / "mjxmacro.h"
    text = header.read_text(encoding="utf-8")
    body = re.search(rf"#define {macro}\b((?:.*\\\n)*.*\n)", text)[1]
    return re.findall(r"X\( *(?:(?:int|float|char|mjtByte|mjtNum), +)?(\w+)", body)


def field_line(name, value):
    """Returns name, count and numbers: integers in decimal, others as bits of doubles."""
    values = np.atleast_1d(value).ravel()
    is_whole = values.dtype.kind in "iub"
    words = [str(int(v)) if is_whole else double_bits(v) for v in values]
    return " ".join([name, str(len(words)), *words])


def names_line(model, name):
    kind = getattr(mujoco.mjtObj, f"mjOBJ_{name.upper()}")
    count = {"body": model.nbody, "joint": model.njnt, "geom": model.ngeom, "actuator": model.nu}
    names = [mujoco.mj_id2name(model, kind, i) or "-" for i in range(count[name])]
    return " ".join([f"names.{name}", str(len(names)), *names])


def record(robot):
    ids = [environment_id for environment_id in IDS if robot_of(environment_id) == robot]
    name = robot.lower()
    write(
        f"{name}_episodes.txt",
        "session ID NUMBER_OF_PARAMETERS NAME=VALUE ...; episode KIND SEED ACTION_SEED STEPS, then"
        " for the reset and\n# each step the hash of observation, reward, terminated, truncated,"
        " info (NaN where absent; reward and\n# reward_ctrl 0 for the kind double):"
        " gymnasium_reference.hashes, low 32 bits.",
        episode_lines(ids),
    )
    write(
        f"{name}_full_episodes.txt",
        f"As {name}_episodes.txt, but for the reset and each step: action (bits of floats),"
        " observation, reward (bits),\n# terminated, truncated, info (bits).",
        full_episode_lines(ids),
    )
    write(
        f"{name}_models.txt",
        "Gymnasium's compiled models: model ID, then a field a line: name, count, values (integers"
        " in decimal,\n# others as bits of doubles, names as they are, - without one).",
        model_lines(ids),
    )


if __name__ == "__main__":
    for each in OWN_VARIANTS:
        record(each)
