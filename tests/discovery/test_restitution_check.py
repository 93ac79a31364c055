"""Restitution against approach speed is seen beside a few slow contacts that a fit has wrong."""

import numpy as np
import pytest

from vrdp_prob.discovery.checks.bodies import _restitution_check
from vrdp_prob.discovery.checks.own_values import Rebounds

PAIRS, WRONG = 26, 4
"""Contacts that are right, and slow ones that are not."""


def rebounds(exponent: float, seed: int) -> Rebounds:
    """Restitutions of pairs that fall from 0.5 m/s on, and of slow pairs that are anything."""
    generator = np.random.default_rng(seed)
    speed = np.concatenate([generator.uniform(0.25, 2.3, PAIRS), np.geomspace(0.015, 0.08, WRONG)])
    sd = np.full(PAIRS + WRONG, 0.03)
    logarithm = np.log(0.77) - exponent * np.log1p(speed / 0.5) + sd * generator.standard_normal(len(speed))
    logarithm[PAIRS:] += 0.7 * generator.standard_normal(WRONG)
    return Rebounds(logarithm, np.diag(sd**2), sd, speed, np.eye(len(speed)))


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_fall_of_restitution_is_seen_beside_slow_contacts_that_are_wrong(seed: int) -> None:
    (check,) = _restitution_check(rebounds(1.0, seed))
    assert check.p_value < 1e-3
    assert check.statistic < -0.4
    assert "falls with the approach speed" in check.sentence


def test_where_nothing_falls_slow_contacts_that_are_wrong_hardly_ever_raise_an_alarm() -> None:
    """At the level of a verdict, 0.005 over thirty checks; of the logarithm of the speed one in six would."""
    found = [check for seed in range(40) for check in _restitution_check(rebounds(0.0, seed))]
    # One in fifty does (200 other seeds); four or more of 40 then have a probability of 1 %.
    assert sum(check.p_value < 0.005 / 30 for check in found) < 4
    assert any("would have shown" in check.sentence for check in found)


def test_where_nobody_met_nothing_is_asked() -> None:
    nothing = Rebounds(np.zeros(0), np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros((0, 0)))
    assert not list(_restitution_check(nothing))
