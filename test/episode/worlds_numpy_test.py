"""Repeats in NumPy what a world draws, as "How values are drawn" in docs/worlds.md describes it."""

import math
import pathlib
import re

import numpy as np
import pytest
from draws import disturbances, level, values_of_steps
from gymnasium_reference import equal_bits
from walker_sim import _core
from walkers import IDS, make_ours

PAGE = (pathlib.Path(__file__).resolve().parents[2] / "docs/worlds.md").read_text("utf-8")
SEEDS = (0, 7, 2**40 + 3)


def page_functions():
    """Runs the functions of the page's code."""
    (code,) = re.findall(r"^```python\n(def derive.*?)^episode = ", PAGE, re.M | re.S)
    names = {"np": np, "math": math}
    exec(code, names)
    return names["derive"], names["normals"]


derive, normals = page_functions()


def draw(episode, name, low, high, dt):
    generator = derive(episode, name)
    if name in ("stair_steps", "stair_steps_vary"):
        return generator.integers(int(low), int(high) + 1)
    value = generator.uniform(low, high)
    return dt * math.floor(value / dt + 0.5) if name.endswith("_delay") else value


def draw_log(generator, low, high):
    least, most = sorted(map(abs, (low, high)))
    magnitude = math.exp(generator.uniform(math.log(least), math.log(most)))
    return min(max(math.copysign(magnitude, low), low), high)


def whole_ranges(environment_id):
    """Returns the widest range of each parameter that can be had beside those of the others."""
    world = {}
    for parameter in _core.world_parameters(environment_id):
        low, high = parameter["minimum"], parameter["maximum"]
        narrower = {"push_interval": (0.1, 1000), "stair_width": (0.5, 1), "lidar_range": (0.1, 3)}
        narrower["joint_damping"] = (0, 0.2)
        world[parameter["name"]] = narrower.get(parameter["name"], (low, high))
    del world["change_interval"]
    return world


@pytest.mark.parametrize("environment_id", IDS)
def test_every_parameter(environment_id):
    env = make_ours(environment_id, world=whole_ranges(environment_id))
    for seed in (*SEEDS, None):
        if seed is None:
            env.unwrapped.np_random.integers(5)  # leaves half a word
        episode = env.unwrapped.np_random if seed is None else np.random.default_rng(seed)
        world = env.unwrapped.world
        expected = {name: draw(episode, name, *world[name], env.unwrapped.dt) for name in world}
        assert env.reset(seed=seed)[1]["world"] == expected


@pytest.mark.parametrize("environment_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_physics_that_changes(environment_id):
    gravity, friction, steps = (-20, -2), (0.3, 3), 40
    env = make_ours(environment_id)
    world = {
        "change_interval": (2 * env.unwrapped.dt, 9 * env.unwrapped.dt),
        "dropout": (0, 0.5),
        "friction_scale": friction,
        "gravity": {"log": gravity},
    }
    env.unwrapped.set_world(world)
    for seed in SEEDS:
        episode = np.random.default_rng(seed)
        interval = derive(episode, "change_interval").uniform(*world["change_interval"])
        dropout = derive(episode, "dropout").uniform(0, 0.5)
        period = math.floor(interval / env.unwrapped.dt + 0.5)
        changing = {**world, "change_interval": interval, "dropout": dropout}
        assert env.reset(seed=seed)[1]["world"] == changing
        falling, rubbing = derive(episode, "gravity"), derive(episode, "friction_scale")
        rows = values_of_steps(
            environment_id, _core.world_text(env.unwrapped.world), seed, steps, 4
        )
        for step in range(steps):
            if step % period == 0:
                drawn = [rubbing.uniform(*friction), draw_log(falling, *gravity)]
            assert equal_bits(rows[step], [interval, dropout, *drawn])


def course(generator, world, environment_id):
    """Returns the points of the ground and the corners of the boxes, as the page describes them."""
    is_bipedal = environment_id.startswith("Bipedal")
    column, columns, start = (14 / 30, 200, 400 / 120) if is_bipedal else (0.2, 500, 0.0)
    roughness = world.get("ground_roughness", 1 if is_bipedal else 0)
    kinds = [kind for kind in ("stump", "stair", "pit") if any(n.startswith(kind) for n in world)]
    ground, boxes = [], []
    y, v = start, 0.0

    def up(columns):
        return math.ceil(columns - 1e-6)

    def box(x, bottom, width, height):
        top = bottom + height
        boxes.append([(x, bottom), (x + width, bottom), (x + width, top), (x, top)])

    def stretch(count):
        nonlocal y, v
        for place in range(count):
            i = len(ground)
            if place:
                v = 0.8 * v + 0.01 * np.sign(start - y)
                if i > 20:
                    v += generator.uniform(-1, 1) / 30
                y += roughness * (column / (14 / 30)) * v
            ground.append((i * column, y))
            if len(ground) == columns:
                return

    def points(heights):
        for height in heights:
            ground.append((len(ground) * column, height))

    def stump():
        width, height = (world.get(f"stump_{name}", column) for name in ("width", "height"))
        box(len(ground) * column, y + world.get("stump_float", 0), width, height)
        points([y] * up(width / column))

    def stair():
        nonlocal y
        width, rise = world.get("stair_width", 4 * column), world.get("stair_height", column)
        steps = int(world.get("stair_steps", 3))
        sign = 1 if generator.random() > 0.5 else -1
        if world.get("stair_steps_vary"):
            steps = generator.integers(0, steps + 1)
        tops = [y + sign * s * rise for s in range(steps)]
        for s, top in enumerate(tops):
            box(len(ground) * column + s * width, top - rise, width, rise)
        heights = [y]
        for j in range(1, up(steps * width / column) + 1):
            top = tops[min(math.floor((j - 1) * column / width + 1e-6), steps - 1)]
            heights.append(top if sign > 0 else top - rise)
        points(heights)
        y = heights[-1]

    def pit():
        left, outer = len(ground) * column, world["pit_gap"] + 2 * column
        for x in (left, left + outer - column):
            box(x, y - 4 * column, column, 4 * column)
        count = up(outer / column) + 1
        points([y, *[y - 4 * column] * (count - 2)])
        ground.append((left + outer, y))

    def next_count():
        if "obstacle_spacing" in world:
            return max(1, math.floor(world["obstacle_spacing"] / column + 0.5))
        return generator.integers(5, 10)

    stretch(20)
    while len(ground) < columns:
        count = next_count()
        if kinds:
            kind = kinds[generator.integers(1, 1 + len(kinds)) - 1]
            {"stump": stump, "stair": stair, "pit": pit}[kind]()
            if len(ground) >= columns:
                break
            count = next_count()
        stretch(count)
    return np.array(ground[:columns]), np.array(boxes).reshape(-1, 4, 2)


LEVELS = {
    "rough": {"ground_roughness": (0.5, 3)},
    "stumps": {"stump_width": (0.3, 2), "stump_float": (0, 1)},
    "stairs": {"stair_steps": (1, 6), "stair_width": (0.5, 1.1), "stair_height": (0.05, 0.6)},
    "flights": {"stair_steps": (1, 4), "stair_steps_vary": 1, "stair_width": 0.7},
    "pits": {"pit_gap": (0.1, 3), "obstacle_spacing": (0.7, 5), "ground_roughness": 0.5},
    "all": {"pit_gap": (0.1, 3), "stump_height": (0.1, 1), "stair_height": 0.2},
}


@pytest.mark.parametrize("name", LEVELS)
@pytest.mark.parametrize("environment_id", ["BipedalWalker-v3", "Walker2d-v5", "Hopper-v5"])
def test_every_level(environment_id, name):
    env = make_ours(environment_id, world=LEVELS[name])
    text = "{" + ", ".join(f"{k}: {list(v)}" for k, v in env.unwrapped.world.items()) + "}"
    for seed in range(20):
        episode = np.random.default_rng(seed)
        world = {
            key: draw(episode, key, low, high, 1) if low < high else low
            for key, (low, high) in env.unwrapped.world.items()
        }
        ground, boxes = course(episode, world, environment_id)
        our_ground, our_boxes = level(environment_id, text, seed)
        assert np.allclose(ground, our_ground, rtol=0, atol=1e-9), (seed, world)
        assert boxes.shape == our_boxes.shape
        assert np.allclose(boxes, our_boxes, rtol=0, atol=1e-9), (seed, world)


@pytest.mark.parametrize("environment_id", ["BipedalWalker-v3", "Walker2d-v5"])
def test_pushes_and_errors_of_actions(environment_id):
    env = make_ours(environment_id)
    size, period, dt = env.action_space.shape[0], 3, env.unwrapped.dt
    trunk = "hull" if environment_id.startswith("Bipedal") else "torso"
    world = (
        f"{{push_interval: {period * dt}, push_impulse: 2, action_noise: 0.25, "
        f"{trunk}_force_x: -3, {trunk}_force_z: 1.5}}"
    )
    for seed in SEEDS:
        episode = np.random.default_rng(seed)
        pushing, acting = derive(episode, "push"), derive(episode, "action")
        pushes, errors = disturbances(environment_id, world, seed, 40, size)
        for step in range(1, 41):
            angle = pushing.uniform(0, 2 * math.pi) if step % period == 0 else None
            drawn = [0, 0] if angle is None else [2 * math.cos(angle), 2 * math.sin(angle)]
            push = [-3 * dt + drawn[0], 1.5 * dt + drawn[1]]
            assert equal_bits(pushes[step - 1], push)
            assert equal_bits(errors[step - 1], 0.25 * np.array(normals(acting, size)))


# Columns of the observation in the order of the errors, and factors of the errors in them. None is
# not compared, because it depends on other errors too.
RANGE = 3.0
OBSERVED = {
    "BipedalWalker-v3": (
        [4, 6, 9, 11, 5, 7, 10, 12, 0, 1, None, None, *range(14, 24)],
        [1, 1, 1, 1, 1 / 4, 1 / 6, 1 / 4, 1 / 6, -1, -2 / 50, 0, 0, *[1 / RANGE] * 10],
    ),
    "Walker2d-v5": (
        [*range(2, 8), *range(11, 17), 1, 10, 8, 9, *range(17, 27)],
        [1] * 16 + [1 / RANGE] * 10,
    ),
    "Walker2d-v4": ([*range(2, 8), *range(11, 17), 1, 10, 8, 9], [1] * 16),  # without a lidar
}


@pytest.mark.parametrize("environment_id", OBSERVED)
def test_errors_of_sensors(environment_id):
    deviations = {
        "joint_position_noise": 0.01,
        "joint_velocity_noise": 0.02,
        "orientation_noise": 0.03,
        "angular_velocity_noise": 0.04,
        "linear_velocity_noise": 0.05,
        "range_noise": 0.06,
    }
    options = {"world": {"lidar_range": RANGE}}
    if environment_id == "Walker2d-v5":
        options["include_lidar_in_observation"] = True
    plain = make_ours(environment_id, **options)
    noisy = make_ours(environment_id, **options)
    noisy.unwrapped.set_world({"lidar_range": RANGE, "dropout": 0.3, **deviations})
    columns, factors = OBSERVED[environment_id]
    joints = plain.action_space.shape[0]
    counts = (joints, joints, 1, 1, 2, 10)
    scale = np.repeat([*deviations.values()], counts)
    sensing = derive(np.random.default_rng(5), "sensing")
    truth, observed = (env.reset(seed=5)[0].astype(float) for env in (plain, noisy))
    repeated, last = 0, None
    for step in range(30):
        is_bipedal = environment_id == "BipedalWalker-v3"
        errors = normals(sensing, 2 * joints + (14 if is_bipedal else 4))
        if environment_id == "Walker2d-v5":
            errors += normals(derive(sensing, "ranges"), 10)
        if step and sensing.random() < 0.3:
            assert equal_bits(observed, last)
            repeated += 1
        else:
            for column, error, factor in zip(columns, scale[: len(errors)] * errors, factors):
                if column is None or (factor == 1 / RANGE and truth[column] == 1):
                    continue  # a ray that hits nothing has no error
                value = truth[column] + factor * error
                if factor == 1 / RANGE:
                    value = min(max(value, 0), 1)
                assert observed[column] == pytest.approx(value, abs=1e-6), (step, column)
        last = observed
        action = np.zeros(joints, np.float32)
        truth, observed = (env.step(action)[0].astype(float) for env in (plain, noisy))
    assert 3 < repeated < 15
