"""What nobody stated the material of is no material: it is neither one of the stated ones nor like any of them."""

from unittest.mock import Mock

import numpy as np
import pytest

from vrdp_prob.discovery.checks import bodies as body_checks
from vrdp_prob.discovery.checks.own_values import BodyFrictions
from vrdp_prob.discovery.residuals.free_flight_patterns import told_apart
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.scene import Body, Shape

UNSTATED = 0.4
"""Logarithm of what bodies of unstated material rub by, over what the others do."""
METAL, RUBBER, OTHER = range(3)


def frictions(rubber: float, *, seed: int) -> BodyFrictions:
    """Six bodies of each of two materials, and ten of none that is stated, which rub by more."""
    generator = np.random.default_rng(seed)
    kinds = np.repeat([METAL, RUBBER, OTHER], [6, 6, 10])
    bodies = tuple(
        Body(f"{number}", Shape.CYLINDER, material={METAL: "metal", RUBBER: "rubber"}.get(kind))
        for number, kind in enumerate(kinds.tolist())
    )
    sd = np.full(len(kinds), 0.05)
    logarithm = np.array([0.0, rubber, UNSTATED])[kinds] + 0.1 * generator.standard_normal(len(kinds))
    unweighed, groups = np.full(len(kinds), np.nan), np.zeros((len(kinds), 0))
    return BodyFrictions(bodies, logarithm, np.diag(sd**2), sd, unweighed, groups)


def material_check(own: BodyFrictions, monkeypatch: pytest.MonkeyPatch) -> float:
    """Probability by chance of the check of materials."""
    monkeypatch.setattr(BodyFrictions, "of", lambda *_given: own)
    (found,) = body_checks._friction_checks(Mock(spec=SharedFit), [])
    assert found.name == body_checks.friction_against("material")
    return found.p_value


def test_bodies_of_unstated_material_raise_no_alarm_about_those_of_two_that_are_alike(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = [material_check(frictions(0.0, seed=seed), monkeypatch) for seed in range(60)]
    # Six in a thousand by chance of more than 4 of 60 at 2 %.
    assert sum(p_value < 0.02 for p_value in found) <= 4


def test_two_materials_that_differ_are_told_apart_beside_bodies_of_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert material_check(frictions(0.4, seed=1), monkeypatch) < 1e-3


@pytest.mark.parametrize(
    ("stated", "apart"),
    [
        (["rubber", "metal", "rubber"], ("rubber",)),
        (["rubber", None, "metal"], ("metal", "rubber")),
        ([None, "metal"], ("metal",)),
        ([None, None], ()),
        (["metal", "metal"], ()),
    ],
)
def test_a_pattern_of_a_material_is_that_of_no_other_bodies(stated: list[str | None], apart: tuple[str, ...]) -> None:
    bodies = [Body(f"{number}", Shape.CYLINDER, material=one) for number, one in enumerate(stated)]
    assert told_apart(bodies) == apart
