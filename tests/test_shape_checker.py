"""Shapes in annotations are looked at when tests run, in the first calls of a function and now and then after these."""

import jaxtyping
import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError
from shape_checker import ALWAYS, SOMETIMES, check

from vrdp_prob.inference.draws.samples import Gaussian


def test_arrays_of_other_shapes_are_refused_by_the_package() -> None:
    def often() -> None:
        for _ in range(SOMETIMES):
            Gaussian(np.zeros(2), np.eye(3))

    with pytest.raises(TypeCheckError):
        often()


def test_later_calls_are_checked_now_and_then() -> None:
    def total(first: Float[np.ndarray, "number"], second: Float[np.ndarray, "number"]) -> float:
        return float(first.sum() + second.sum())

    checked = jaxtyping.jaxtyped(typechecker=check)(total)
    right, refused = np.ones(2), []
    for call in range(1, 4 * SOMETIMES + 1):
        try:
            checked(right, np.ones(3))
        except TypeCheckError:
            refused.append(call)
    assert refused == [*range(1, ALWAYS + 1), *(SOMETIMES * turn for turn in range(1, 5))]
