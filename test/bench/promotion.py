"""Gymnasium's rewards are those of NumPy 2, which promotes types otherwise than NumPy 1."""

import contextlib

import numpy as np


@contextlib.contextmanager
def promotion_of_numpy_2():
    """NumPy 1 promotes as NumPy 2 for as long as the context."""
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        yield
        return
    before = np._get_promotion_state()
    np._set_promotion_state("weak")
    try:
        yield
    finally:
        np._set_promotion_state(before)
