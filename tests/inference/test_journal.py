"""What tells one step of a run from another: all that it is given, and nothing that was worked out of it since."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pytest
import torch

from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.inference.runs.journal import _digest
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.models.physics import PhysicsModel


@dataclass(frozen=True)
class Thing:
    numbers: np.ndarray
    names: frozenset[str]

    @cached_property
    def total(self) -> float:
        return float(self.numbers.sum())

    def work(self, factor: float) -> float:
        return factor * self.total


def thing(last: float = 2.0, name: str = "b") -> Thing:
    return Thing(np.array([1.0, last]), frozenset({"a", name, "c"}))


@pytest.mark.parametrize(
    "made",
    [
        thing,
        lambda: partial(Thing.work, thing(), factor=2.0),
        lambda: thing().work,
        lambda: [thing(), {"x": (1, None, np.float64(2.0))}, torch.arange(3.0)],
        lambda: PhysicsModel.base().with_effect(Bowl()),
        lambda: hide([], seed=1, setting=Setting(videos=1, bodies=2, frames=20)).tracks[0],
    ],
)
def test_what_is_alike_is_told_alike(made: Callable[[], object]) -> None:
    assert _digest(made()) == _digest(made())


def test_what_was_worked_out_since_is_not_told() -> None:
    looked_at = thing()
    assert looked_at.total == 3.0
    assert _digest(looked_at) == _digest(thing())


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (thing(), thing(last=2.0000000001)),
        (thing(), thing(name="d")),
        (partial(Thing.work, thing(), factor=2.0), partial(Thing.work, thing(), factor=3.0)),
        (thing().work, thing(last=3.0).work),
        ([1, 2], [[1], 2]),
        (np.zeros(4), np.zeros((2, 2))),
        (np.array(["a"], dtype=object), np.array(["b"], dtype=object)),
        (torch.zeros(2), torch.ones(2)),
        (1, True),
        (Bowl(), Wind()),
        (Bowl, Wind),
    ],
)
def test_what_differs_is_told_apart(one: object, other: object) -> None:
    assert _digest(one) != _digest(other)
