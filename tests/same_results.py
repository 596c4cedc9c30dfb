"""Comparison of results to the bit, as Gymnasium returns them."""

from __future__ import annotations

import numpy as np


def assert_same(actual, expected, at="") -> None:
    """Equal types of containers, keys, array types, shapes and bits."""
    if isinstance(expected, tuple):
        assert_same(dict(enumerate(actual)), dict(enumerate(expected)))
    elif isinstance(expected, dict):
        assert actual.keys() == expected.keys(), at
        for key in expected:
            assert_same(actual[key], expected[key], f"{at}/{key}")
    elif isinstance(expected, np.ndarray) and expected.dtype == object:
        assert actual.shape == expected.shape
        for each, other in zip(actual, expected, strict=True):
            assert_same(each, other, at)
    elif isinstance(expected, np.ndarray):
        assert (actual.dtype, actual.shape) == (expected.dtype, expected.shape), at
        np.testing.assert_array_equal(actual, expected, err_msg=at)
    else:
        assert actual == expected, at
