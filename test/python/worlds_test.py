"""Worlds of single walkers, through gymnasium.make. promises_test.py has their episodes' bits."""

import json
import pathlib
import re
from collections import UserList, deque

import gymnasium
import numpy as np
import pytest
import walker_sim
import yaml
from gymnasium.utils.env_checker import check_env
from walker_sim import WalkerEnv, _core
from walkers import IDS, follow, make_ours, random_actions

COMMON = {
    "gravity": (-11, -8),
    "friction_scale": (0.5, 1.5),
    "motor_strength": (0.8, 1.2),
    "mass_scale": (0.8, 1.25),
    "joint_damping": (0, 0.05),
    "push_interval": (0.1, 0.3),
    "push_impulse": (0.5, 1),
    "action_delay": (0.02, 0.06),
    "action_noise": (0, 0.1),
    "observation_delay": (0.02, 0.06),
    "dropout": (0, 0.2),
    "joint_position_noise": (0, 0.1),
    "joint_velocity_noise": (0, 0.1),
    "orientation_noise": (0, 0.1),
    "angular_velocity_noise": (0, 0.1),
    "linear_velocity_noise": 0.1,
    "lidar_range": (3, 6),
    "range_noise": (0, 0.1),
}
LEVEL = {
    "ground_roughness": (0, 2),
    "pit_gap": (0.5, 1),
    "stump_height": (0.2, 0.6),
    "stair_height": 0.3,
    "stair_steps": (1, 4),
    "obstacle_spacing": (2, 4),
    "hip_speed": (3, 5),
    "knee_speed": 6,
    "initial_push": (0, 0.5),
}
ALL = {id: {**COMMON, **(LEVEL if id.startswith("Bipedal") else {})} for id in IDS}


def play(env, environment_id, seed=4, steps=120, **options):
    """Returns the bits of a reset with the seed, and of steps with resets without."""
    observation, info = env.reset(seed=seed, **options)
    outcomes = follow(env, random_actions(environment_id, steps, seed))
    return [(observation.tobytes(), info), *outcomes]


@pytest.mark.parametrize("environment_id", IDS)
def test_the_drawn_numbers_repeat_the_bits(environment_id):
    world = ALL[environment_id]
    env = make_ours(environment_id, world=world)
    for name, value in world.items():
        assert env.unwrapped.world[name] == (value if type(value) is tuple else (value, value))
    first = play(env, environment_id, steps=60)
    drawn = first[0][1]["world"]
    assert [*drawn] == [*env.unwrapped.world] == sorted(world)
    assert {type(value) for value in drawn.values()} == {float}
    assert all(low <= drawn[name] <= high for name, (low, high) in env.unwrapped.world.items())
    second = play(make_ours(environment_id, world=drawn), environment_id, steps=60)
    count = next((i for i, outcome in enumerate(first[1:], 1) if len(outcome) == 2), len(first))
    assert count > 10
    assert second[:count] == first[:count]


@pytest.mark.parametrize("environment_id", IDS)
def test_without_a_world_nothing_is_drawn(environment_id):
    plain = play(make_ours(environment_id), environment_id)
    assert all("world" not in info for *_, info in plain)
    for world in (None, {}, "gymnasium", "{}"):
        env = make_ours(environment_id, world=world)
        assert env.unwrapped.world == {}
        assert play(env, environment_id) == plain


@pytest.mark.parametrize("name", _core.world_presets())
def test_presets(name):
    env_id = "Walker2d-v5" if name.startswith("walker2d") else "BipedalWalker-v3"
    env = make_ours(env_id, world=name)
    file = pathlib.Path(__file__).resolve().parents[2] / "config" / "worlds" / f"{name}.yaml"
    by_file = make_ours(env_id, world=file)
    assert env.unwrapped.world == by_file.unwrapped.world == _core.load_world(name)
    assert ("world" in env.reset()[1]) == (name != "gymnasium")


@pytest.mark.parametrize(
    "world",
    [
        {"gravity": -5, "push_interval": [1, 3]},
        {"gravity": np.float32(-5), "push_interval": np.array([1, 3])},
        {"gravity": (-5.0, -5), "push_interval": (np.int64(1), 3.0)},
        {"gravity": deque([-5, -5]), "push_interval": UserList([1, 3])},
        "{gravity: -5, push_interval: [1, 3]}",
    ],
    ids=str,
)
def test_all_forms_are_equal(world, tmp_path):
    expected = {"gravity": (-5.0, -5.0), "push_interval": (1.0, 3.0)}
    assert make_ours("Hopper-v5", world=world).unwrapped.world == expected
    file = tmp_path / "mine.yaml"
    file.write_text("# mine\ngravity: -5\npush_interval: [1, 3]  # s\n")
    for path in (file, str(file)):
        assert make_ours("Hopper-v5", world=path).unwrapped.world == expected


@pytest.mark.parametrize("pair", [list, tuple])
@pytest.mark.parametrize(
    "options",
    [
        {"sort_keys": False},  # as OmegaConf.save
        {"default_flow_style": None},
        {"default_flow_style": True, "width": 20},
        {"explicit_start": True, "explicit_end": True, "indent": 4},
        {"version": (1, 1), "line_break": "\r\n"},
    ],
    ids=str,
)
def test_reads_what_yaml_writes(options, pair, tmp_path):
    interval = pair([1.5, 3])
    world = {"push_interval": interval, "gravity": -5.25, "mass_scale": {"log": interval}}
    expected = {"push_interval": (1.5, 3), "gravity": (-5.25, -5.25)}
    expected["mass_scale"] = {"log": (1.5, 3)}
    file = tmp_path / "mine.yaml"
    for text in (yaml.dump(world, **options), json.dumps(world), json.dumps(world, indent=1)):
        for encoding in ("utf-8", "utf-8-sig"):
            file.write_bytes(text.encode(encoding))
            assert _core.load_world(str(file)) == expected


def test_the_world_of_a_reset_holds_for_the_following():
    env = make_ours("Walker2d-v5", world="moon")
    assert env.reset(seed=1)[1]["world"] == {"gravity": -1.62}
    expected = play(make_ours("Walker2d-v5", world="slippery"), "Walker2d-v5")
    options = {"world": "slippery", "something": 1}
    assert play(env, "Walker2d-v5", options=options) == expected
    assert options == {"world": "slippery", "something": 1}
    assert play(env, "Walker2d-v5", options={}) == expected
    assert env.unwrapped.world == {"friction_scale": (0.1, 0.4)}
    assert "world" not in env.reset(options={"world": None})[1]
    assert "world" not in env.reset()[1]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("environment_id", IDS)
def test_check_env_passes(environment_id):
    env = make_ours(environment_id, world=ALL[environment_id])
    check_env(env.unwrapped, skip_render_check=True)


# test/episode/world_test.cpp has the others.
REFUSED = [
    ("Hopper-v5", {"gravty": 1}, "world parameter gravty = 1.0: unknown; did you mean gravity? "),
    ("Hopper-v5", {"gravity": 10**400}, "gravity = .inf: must be finite, in [-50.0, 0.0] m/s^2"),
    ("Hopper-v5", "/nowhere/a\ud800", "must be a text that UTF-8 can encode; no surrogates"),
    ("Hopper-v5", {"\ud800": 1}, "must be a text that UTF-8 can encode; no surrogates"),
]
MISTYPED = [
    (5, "world = 5: must be None, a preset's name, a YAML file's path, or a mapping of names to "),
    ([{}], "world = [{}]: must be None, a preset's name"),
    (
        {"gravity": "low"},
        "parameter gravity = 'low': must be a number, a pair (low, high), or {'log':",
    ),
    ({"gravity": (1, 2, 3)}, "world parameter gravity = (1, 2, 3): must be a number, a pair "),
    (
        {"gravity": True},
        "world parameter gravity = True: must be a number, a pair (low, high), or {'log':",
    ),
    (
        {"gravity": None},
        "world parameter gravity = None: must be a number, a pair (low, high), or {'log':",
    ),
    ({"gravity": {"log": -5}}, "gravity = {'log': -5}: must be a number, a pair (low, high), or"),
    ({5: 1}, "world parameter 5: must be a str"),
    (pathlib, "must be None, a preset's name"),
]


@pytest.mark.parametrize(
    ("environment_id", "world", "message", "error"),
    [(*case, ValueError) for case in REFUSED]
    + [("Hopper-v5", world, message, TypeError) for world, message in MISTYPED],
)
def test_a_refused_world_changes_nothing(environment_id, world, message, error):
    with pytest.raises(error, match=re.escape(message)):
        make_ours(environment_id, world=world)
    env = WalkerEnv(environment_id, world="moon")
    env.reset(seed=1)
    before = env.get_state()
    for call in (env.set_world, lambda world: env.reset(seed=5, options={"world": world})):
        with pytest.raises(error, match=re.escape(message)):
            call(world)
        assert env.get_state() == before
    assert env.np_random_seed == 1


def test_a_refused_seed_leaves_the_world():
    env = WalkerEnv("Hopper-v5", world="moon")
    env.reset(seed=1)
    before = env.get_state()
    with pytest.raises(gymnasium.error.Error, match="Seed must be greater or equal to zero"):
        env.reset(seed=-1, options={"world": "pushed"})
    assert env.get_state() == before


def test_the_world_is_a_read_only_copy():
    env = make_ours("Hopper-v5", world="moon").unwrapped
    env.world["gravity"] = (-9, -9)
    assert env.world == {"gravity": (-1.62, -1.62)}
    with pytest.raises(AttributeError):
        env.world = None
    for drawn in (env.reset()[1]["world"], env.reset()[1]["world"]):
        assert drawn.pop("gravity") == -1.62


def test_the_parameters_are_listed():
    for environment_id in IDS:
        parameters = walker_sim.world_parameters(f"walker_sim/{environment_id}")
        assert str(parameters) == str(walker_sim.world_parameters(environment_id))
        names = [parameter["name"] for parameter in parameters]
        assert {*ALL[environment_id]} <= {*names} and len({*names}) == len(names)
    assert "moon" in walker_sim.world_presets()
    with pytest.raises(ValueError, match="environment Ant-v5: unknown"):
        walker_sim.world_parameters("Ant-v5")
