"""Compares the outcomes of two vector environments."""

import numpy as np


def assert_same(ours, theirs, where="", near=None):
    """Asserts equal types, keys, shapes and bits of a reset's or a step's outcome.

    With `near`, numbers may differ by that much and have another precision: the type of Gymnasium's
    Walker2d reward terms depends on NumPy's type promotion.
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
