"""Contacts that last, and radii that are wrong: what tells them apart."""

from collections.abc import Mapping

import pytest

from tests.discovery.soft_contacts import videos
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.checks.contacts import DISTANCE
from vrdp_prob.discovery.checks.contacts import DURATION as DURATIONS
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Check, Verdict
from vrdp_prob.discovery.residuals.contact_patterns import AT_CONTACTS
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError

DURATION = DURATIONS[AT_CONTACTS]
SHORT = 0.003
"""Duration in s of a contact that no video shows."""


def checked(duration: float, *, growth: float = 1.0) -> Mapping[str, Check]:
    """Checks by their names."""
    fit = fit_together(videos(duration, seed=1, growth=growth), model=default_model(), model_error=False)
    return {check.name: check for check in run_checks(fit, seed=0)}


def test_contacts_that_last_are_told_with_their_duration() -> None:
    found = checked(0.06)[DURATION]
    assert found.significant
    assert found.statistic == pytest.approx(0.06, abs=0.015)
    assert found.sentence.startswith("At contacts bodies touch for 0.0")


def test_contacts_of_wrong_radii_do_not_last() -> None:
    found = checked(SHORT, growth=1.08)
    assert found[DISTANCE].significant
    assert found[DURATION].p_value > 0.01


def test_short_contacts_of_right_radii_show_neither() -> None:
    found = checked(SHORT)
    assert min(found[DISTANCE].p_value, found[DURATION].p_value) > 0.01
    assert "would have shown" in found[DURATION].sentence


@pytest.mark.slow
def test_contacts_that_last_are_not_called_a_wrong_radius() -> None:
    finding = discover(videos(0.06, seed=1), catalogue=[ContactRadiusError()], processes=1)
    assert finding.verdict is Verdict.UNKNOWN
    assert not finding.named
    assert any(DURATION in note for note in finding.notes)


@pytest.mark.slow
def test_a_wrong_radius_is_named_where_contacts_are_short() -> None:
    finding = discover(videos(SHORT, seed=1, growth=1.08), catalogue=[ContactRadiusError()], processes=1)
    assert [cause.name for cause in finding.named] == ["contact_radius_error"]
    assert finding.named[0].parameters["radius_error"].mean == pytest.approx(0.08, abs=0.02)
