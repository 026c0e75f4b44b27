"""Compares our random numbers with the installed NumPy; base/random_test.cpp uses recordings."""

import draws as ours
import numpy as np
from gymnasium_reference import equal_bits

KINDS = ("random", "uniform", "integers")
DRAWS = ((0,), (1, -1, 1), (1, -5, 5), (1, 0, 200), (2, 3, 5), (2, 4, 5), (2, 1, 4))
DRAWS += ((2, 0, 3221225472), (2, -7, 4294967288), (2, 5, 10))


def numpy_state(generator):
    state = generator.bit_generator.state
    words = [divmod(state["state"][name], 2**64) for name in ("state", "inc")]
    return [*words[0], *words[1], state["has_uint32"], state["uinteger"]]


def test_draws_and_states_equal_numpys():
    choice = np.random.default_rng(1)
    seeds = [*range(100), *map(int, choice.integers(0, 2**64, 200, np.uint64))]
    for seed in seeds:
        draws = [DRAWS[i] for i in choice.integers(len(DRAWS), size=60)]
        generator = np.random.default_rng(seed)
        numbers, state = ours.draw(seed, draws)
        assert equal_bits(numbers, [getattr(generator, KINDS[k])(*r) for k, *r in draws]), seed
        assert state.tolist() == numpy_state(generator), seed
