"""NumPy 2's type promotion under NumPy 1, on which the bits of Gymnasium's rewards depend."""

import contextlib

import numpy as np


@contextlib.contextmanager
def promotion_of_numpy_2():
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        yield
        return
    before = np._get_promotion_state()
    np._set_promotion_state("weak")
    try:
        yield
    finally:
        np._set_promotion_state(before)
