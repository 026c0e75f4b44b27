"""Shipped policies: their cards, and equal episodes in Gymnasium's environments."""

import concurrent.futures
import pathlib
import re

import gymnasium
import numpy as np
import pytest
from gymnasium_reference import equal_bits
from walker_sim import _core
from walker_sim.commands.policies import acting, shipped_policy
from walker_sim.training.settings_file import read_settings
from walkers import ROBOTS, make_ours, play, returns_of

ROOT = pathlib.Path(__file__).parents[2]
IDS = _core.ids()
SHIPPED = [(env_id, "shipped") for env_id in IDS]
ROBUST = [(env_id, "robust") for env_id in ("BipedalWalker-v3", "Walker2d-v5", "Hopper-v5")]
MIN_MEAN_RETURN = {
    "BipedalWalker-v3": 338,
    "BipedalWalkerHardcore-v3": 308,
    "Walker2d-v4": 8250,
    "Walker2d-v5": 8400,
    "Hopper-v4": 3700,
    "Hopper-v5": 3700,
    "BipedalWalker-v3-robust": 320,
    "Walker2d-v5-robust": 7000,
    "Hopper-v5-robust": 3500,
}


def shipped(env_id):
    policy = _core.Policy(str(shipped_policy(env_id)))
    return acting(policy, policy.action_size)


@pytest.mark.parametrize(("env_id", "kind"), SHIPPED + ROBUST)
def test_file_is_small_and_names_its_settings(env_id, kind):
    path = shipped_policy(env_id, kind)
    assert path.stat().st_size < 1_000_000
    policy = _core.Policy(str(path))
    # An environment may ship the policy of its robot's other version.
    assert policy.id.partition("-")[0] == env_id.partition("-")[0]
    settings = read_settings(
        ROOT / "config/training" / f"{shipped_policy(policy.id, kind).stem}.yaml"
    )
    assert policy.notes["settings"] == settings.hash()
    assert policy.notes["seed"] == str(settings.seed)
    # A stage ends after an update, of at most 2000 steps an episode.
    stages = map(settings.stage, range(settings.num_stages))
    last_updates = sum(2000 * stage.population * stage.episodes for stage in stages)
    assert int(policy.notes["steps"]) <= settings.steps_before(settings.num_stages) + last_updates


@pytest.mark.parametrize("env_id", IDS)
def test_batches_and_single_rows_give_the_same_bits(env_id):
    """Also from two concurrent threads."""
    policy = _core.Policy(str(shipped_policy(env_id)))
    observations = np.random.default_rng(0).normal(0, 2, (101, policy.observation_size))
    alone = np.empty((len(observations), policy.action_size))
    for observation, action in zip(observations, alone):
        policy.act(observation, action)

    def act(_):
        actions = np.empty_like(alone)
        policy.act(observations, actions)
        return actions

    with concurrent.futures.ThreadPoolExecutor(2) as threads:
        assert all(equal_bits(actions, alone) for actions in threads.map(act, range(100)))
    assert equal_bits(alone, alone.astype(np.float32).astype(np.float64))


@pytest.mark.parametrize("env_id", sorted({*IDS} - {*ROBOTS}))
def test_episodes_equal_gymnasiums_to_the_bit(env_id):
    pair, policy = (make_ours(env_id), gymnasium.make(env_id)), shipped(env_id)
    for seed in (1_000_000, 7):
        observations = [environment.reset(seed=seed)[0] for environment in pair]
        assert equal_bits(*observations)
        outcomes = [(0.0, False, False)]
        while not any(outcomes[0][1:]):
            action = policy(observations[0]).astype(np.float32)
            steps = [environment.step(action) for environment in pair]
            observations, outcomes = zip(*((step[0], step[1:4]) for step in steps))
            assert equal_bits(*observations)
            assert equal_bits(*outcomes)


@pytest.mark.parametrize("env_id", ["Walker2d-v4", "Walker2d-v5"])
def test_mean_return_equals_another_mujocos(env_id):
    """Compares the mean return, because whole episodes diverge."""
    seeds = range(1_000_000, 1_000_010)
    means = [
        np.mean([play(environment, seed, shipped(env_id))[0][0] for seed in seeds])
        for environment in (make_ours(env_id), gymnasium.make(env_id))
    ]
    assert means[0] == pytest.approx(means[1], rel=0.05)


def test_walker2d_walks_over_rough_ground(evaluate):
    """As docs/worlds.md says."""
    world = ["--world", "{ground_roughness: 0.05}"]
    _, found = evaluate("Walker2d-v5", "--policy", "shipped", *world, "--seeds", "0:40")
    assert found["mean"] > 7000


@pytest.mark.parametrize(("env_id", "kind"), SHIPPED + ROBUST)
def test_returns_equal_the_cards(env_id, kind, evaluate):
    name = shipped_policy(env_id, kind).stem
    card = (ROOT / "docs/policies" / f"{name}.md").read_text()
    row = re.search(r"^\| \*\*(\S+)\*\* \| (\S+) \| (\S+) \| (\S+) \|", card, re.MULTILINE)
    _, found = evaluate(env_id, "--policy", kind, "--seeds", "1000000:1001000")
    returns = np.array(returns_of(found))
    figures = (returns.mean(), returns.std(ddof=1), returns.min(), returns.max())
    assert tuple(f"{figure:.1f}" for figure in figures) == row.groups()
    assert returns.mean() >= MIN_MEAN_RETURN[name]
