"""Terrain, clouds and push against the installed Gymnasium's, every double bit by bit."""

import numpy as np
import pytest
from bipedal_walker_reference import terrain
from gymnasium_reference import equal_bits

LARGE_SEEDS = np.random.default_rng(2).integers(0, 2**64, 200, np.uint64)


@pytest.mark.parametrize("hardcore", [False, True])
def test_every_double_is_equal(rollout, hardcore):
    seeds = [*range(1000, 2200), *map(int, LARGE_SEEDS)]  # 0 .. 999 are recorded
    differing = [
        seed
        for seed in seeds
        if not equal_bits(rollout.terrain(hardcore, seed), terrain(hardcore, seed))
    ]
    assert differing == []


def test_another_seed_or_variant_is_another_terrain(rollout):
    """Negative control of the comparison above."""
    plain = rollout.terrain(False, 5)
    assert not equal_bits(plain, terrain(False, 6))
    assert not equal_bits(plain, terrain(True, 5))
