"""Compares our random numbers with the installed NumPy; base/random_test.cpp uses recordings."""

import numpy as np
import pytest
from gymnasium_reference import equal_bits

DRAWS = ("random", "uniform -1 1", "uniform -5 5", "uniform 0 200", "integers 3 5", "integers 4 5")
DRAWS += ("integers 1 4", "integers 0 3221225472", "integers -7 4294967288", "integers 5 10")


def numpy_draw(generator, draw):
    name, *arguments = draw.split()
    number = int if name == "integers" else float
    return float(getattr(generator, name)(*map(number, arguments)))


def numpy_state(generator):
    state = generator.bit_generator.state
    words = [divmod(state["state"][name], 2**64) for name in ("state", "inc")]
    return [*words[0], *words[1], state["has_uint32"], state["uinteger"]]


def test_draws_and_states_equal_numpys(rollout):
    choice = np.random.default_rng(1)
    seeds = [*range(100), *map(int, choice.integers(0, 2**64, 200, np.uint64))]
    for seed in seeds:
        draws = [DRAWS[i] for i in choice.integers(len(DRAWS), size=60)]
        generator = np.random.default_rng(seed)
        numbers, state = rollout.random(seed, draws)
        assert equal_bits(numbers, [numpy_draw(generator, draw) for draw in draws]), seed
        assert state.tolist() == numpy_state(generator), seed


@pytest.mark.parametrize("draw", ["integers 2 2", "integers 3 2", "integers 0 4294967296"])
def test_empty_and_too_large_ranges_are_rejected(rollout, draw):
    with pytest.raises(Exception, match=r"must hold 1 \.\. 2\^32 - 1 values"):
        rollout.random(1, [draw])
