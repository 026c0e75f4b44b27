"""Whether two vector environments gave the same."""

import numpy as np


def assert_same(ours, theirs, where=""):
    """Types, keys, shapes and bits of what a reset or a step gave; NaN equals NaN.

    Numbers of Gymnasium's infos may have another type: its Walker2d hands on whatever NumPy made of
    the reward's terms.
    """
    assert type(ours) is type(theirs), (where, ours, theirs)
    if isinstance(ours, (tuple, list)):
        assert len(ours) == len(theirs), where
        for position, (one, other) in enumerate(zip(ours, theirs)):
            assert_same(one, other, (where, position))
    elif isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), (where, ours, theirs)
        for key, value in ours.items():
            assert_same(value, theirs[key], (where, key))
    elif isinstance(ours, np.ndarray):
        assert ours.dtype == theirs.dtype and ours.shape == theirs.shape, (where, ours, theirs)
        if ours.dtype == object:
            assert_same(list(ours), list(theirs), where)
        else:
            assert ours.tobytes() == theirs.tobytes(), (where, ours, theirs)
    else:
        assert ours == theirs, (where, ours, theirs)
