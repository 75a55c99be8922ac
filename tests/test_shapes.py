"""The check of shapes in signatures, which all tests run under, sees a wrong one."""

from typing import NamedTuple

import numpy as np
import pytest
from helpers.shapes import WrongShape, with_shapes
from jaxtyping import Float

import reojax


class Pair(NamedTuple):
    left: Float[np.ndarray, "n+1"]  # noqa: F821
    right: Float[np.ndarray, " n"]


def twice(x: Float[np.ndarray, " n"], y: Float[np.ndarray, "n 3"] | None = None) -> Float[np.ndarray, " n"]:
    return np.concatenate([x, x])[: len(x) + (y is not None)]


def pair(left: object, right: object) -> Pair:
    return Pair(left, right)


def test_arguments_results_and_fields():
    good = with_shapes(twice)
    np.testing.assert_array_equal(good(np.ones(2)), np.ones(2))
    with pytest.raises(WrongShape, match=r"twice: return \(3,\), annotated .*n"):
        good(np.ones(2), np.ones((2, 3)))
    with pytest.raises(WrongShape, match=r"twice: y \(5, 3\)"):
        good(np.ones(2), np.ones((5, 3)))
    with_shapes(pair)(np.ones(3), np.ones(2))
    with pytest.raises(WrongShape, match=r"pair: left \(4,\)"):
        with_shapes(pair)(np.ones(4), np.ones(2))


def test_all_tests_run_under_it():
    assert reojax.connection.__wrapped__ is not None
