"""Contacts that last, and radii that are wrong: what tells them apart."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.soft_contacts import videos
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.checks.contacts import DISTANCE, _lasting_instead
from vrdp_prob.discovery.checks.contacts import DURATION as DURATIONS
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Check, Verdict
from vrdp_prob.discovery.residuals.contact_patterns import AT_CONTACTS
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.selection.doubts import rivals_outside
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError

DURATION = DURATIONS[AT_CONTACTS]
CHECK = Check(DISTANCE, 0.0, 0.0, True, "")
SHORT = 0.003
"""Duration in s of a contact that no video shows."""


def checked(duration: float, *, growth: float = 1.0) -> Mapping[str, Check]:
    """Checks by their names."""
    fit = fit_together(videos(duration, seed=1, growth=growth), model=default_model(), model_error=False)
    return {check.name: check for check in run_checks(fit, seed=0)}


@pytest.fixture(scope="module")
def soft() -> Mapping[str, Check]:
    """Checks where contacts last."""
    return checked(0.06)


def test_contacts_that_last_are_told_with_their_duration(soft: Mapping[str, Check]) -> None:
    found = soft[DURATION]
    assert found.significant
    assert found.statistic == pytest.approx(0.06, abs=0.015)
    assert found.sentence.startswith("At contacts bodies touch for 0.0")


def test_contacts_that_last_are_told_beside_the_distance_that_they_look_like(soft: Mapping[str, Check]) -> None:
    assert soft[DISTANCE].significant
    assert soft[DISTANCE].rival.endswith("s explain it better.")


@pytest.mark.parametrize(
    ("distance", "duration", "told"),
    [
        (40.0, 40.0, "with a probability of 50 %"),
        (40.0, 43.0, "with a probability of 82 %"),
        (40.0, 60.0, "explain it better"),
        (60.0, 40.0, ""),
        (1.0, 1.0, ""),
    ],
)
def test_a_distance_and_a_duration_share_the_probability_where_videos_do_not_tell(
    distance: float, duration: float, told: str
) -> None:
    rival = _lasting_instead(*(_score(chi_square) for chi_square in (distance, duration)))
    assert (told in rival) if told else not rival
    check = replace(CHECK, rival=rival)
    assert rivals_outside(["contact_radius_error"], [check]) == ([rival] if rival else [])
    assert rivals_outside(["surface_tilt"], [check]) == []


def test_contacts_that_would_last_less_than_no_time_explain_nothing() -> None:
    assert _lasting_instead(_score(40.0), _score(40.0, sign=-1.0)) == ""


def _score(chi_square: float, *, sign: float = 1.0) -> Score:
    """What residuals say of one strength, of unit standard deviation."""
    return Score(np.array([sign * np.sqrt(chi_square)]), np.eye(1))


@pytest.mark.slow
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
    assert DURATION in {check.name for check in finding.checks if check.significant}
    assert finding.description is not None
    assert any(one.startswith("At contacts bodies touch for 0.0") for one in finding.description.sentences)
    share = next(
        one for one in finding.description.sentences if one.endswith("of what is unexplained begins at contacts.")
    )
    assert float(share.split()[0]) > 50


@pytest.mark.slow
def test_a_wrong_radius_is_named_where_contacts_are_short() -> None:
    finding = discover(videos(SHORT, seed=1, growth=1.08), catalogue=[ContactRadiusError()], processes=1)
    assert [cause.name for cause in finding.named] == ["contact_radius_error"]
    assert finding.named[0].parameters["radius_error"].mean == pytest.approx(0.08, abs=0.02)
