"""Whether two vector environments gave the same."""

import numpy as np


def assert_same(ours, theirs, where="", near=None):
    """Types, keys, shapes and bits of what a reset or a step gave.

    With `near`, numbers may differ by so much, and be of another width: Gymnasium's Walker2d hands
    on whatever type NumPy gave the terms of the reward.
    """
    assert type(ours) is type(theirs), (where, ours, theirs)
    if isinstance(ours, (tuple, list)):
        assert len(ours) == len(theirs), where
        for position, (one, other) in enumerate(zip(ours, theirs)):
            assert_same(one, other, (where, position), near)
    elif isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), (where, ours, theirs)
        for key, value in ours.items():
            assert_same(value, theirs[key], (where, key), near)
    elif isinstance(ours, np.ndarray):
        assert ours.shape == theirs.shape, (where, ours, theirs)
        if ours.dtype == object:
            assert_same(list(ours), list(theirs), where, near)
        elif near is not None and ours.dtype.kind == theirs.dtype.kind == "f":
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=near, err_msg=str(where))
        else:
            assert ours.dtype == theirs.dtype, (where, ours.dtype, theirs.dtype)
            assert ours.tobytes() == theirs.tobytes(), (where, ours, theirs)
    else:
        assert ours == theirs, (where, ours, theirs)
