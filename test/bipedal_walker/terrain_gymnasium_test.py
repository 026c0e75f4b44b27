"""Terrain, clouds and push against the Gymnasium that is installed, in every double."""

import gymnasium_reference
import numpy as np
import pytest

LARGE_SEEDS = np.random.default_rng(2).integers(0, 2**64, 200, np.uint64)


@pytest.mark.parametrize("hardcore", [False, True])
def test_every_double_is_equal(rollout, hardcore):
    seeds = [*range(1000, 2200), *map(int, LARGE_SEEDS)]  # 0 .. 999 are recorded
    differing = [
        seed
        for seed in seeds
        if not gymnasium_reference.equal_bits(
            rollout.terrain(hardcore, seed), gymnasium_reference.terrain(hardcore, seed)
        )
    ]
    assert differing == []


def test_another_seed_or_variant_is_another_terrain(rollout):
    """What the comparison above can tell apart."""
    plain = rollout.terrain(False, 5)
    assert not gymnasium_reference.equal_bits(plain, gymnasium_reference.terrain(False, 6))
    assert not gymnasium_reference.equal_bits(plain, gymnasium_reference.terrain(True, 5))
