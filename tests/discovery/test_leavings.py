"""What a model leaves, and whether single videos or most of them call for a cause."""

from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from vrdp_prob.discovery import stages
from vrdp_prob.discovery.candidates.first_guess import Site
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.finding import Check, Verdict
from vrdp_prob.discovery.outcome import Outcome
from vrdp_prob.discovery.selection import leavings as leavings_module
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt

ALIKE = (40.0, 42.0, 38.0, 41.0)
"""A statistic of 161: more than the 80 that a few wrong courses promise where a gain of 2 is needed, less than 200."""
ONE = (0.0, 1.0, 60.0, 2.0)
NOTHING = (0.0, 1.0, 0.5, 2.0)


def law(effect: Effect, by_video: tuple[float, ...]) -> CauseScore:
    size = sum(by_video)
    return CauseScore(effect, {}, chi_square=size, degrees=1, p_value=float(np.exp(-size / 2)), by_video=by_video)


def kick(*videos: int) -> CauseScore:
    sites = tuple(Site(video, 0, {}, 50.0, 1e-9) for video in videos)
    return CauseScore(ExternalImpulse(), {}, sites, chi_square=50.0, degrees=2, p_value=1e-9)


def leaving(scores: list[CauseScore], monkeypatch: pytest.MonkeyPatch) -> tuple[Leavings, Trial]:
    """A model of four videos that leaves what is scored so."""
    left = Left(tuple(scores), tuple(scores), np.ones(4))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: left)
    trial = create_autospec(Trial, instance=True)
    trial.fit = Mock(videos=("a", "b", "c", "d"))
    return Leavings((), 0), trial


@pytest.mark.parametrize(
    ("scores", "suspects", "is_law"),
    [
        ([law(SurfaceTilt(), ALIKE)], [], True),
        ([law(SurfaceTilt(), ONE)], [2], False),
        ([law(SurfaceTilt(), ONE), law(LinearDrag(), ALIKE)], [2], True),
        ([law(SurfaceTilt(), NOTHING)], [], False),
        ([kick(3, 1)], [3, 1], False),
        ([kick(0, 1, 2)], [], False),
        ([], [], False),
    ],
    ids=["a law", "one video", "both", "nothing", "kicks in two", "kicks in most", "no cause is asked"],
)
def test_a_wrong_course_calls_for_a_cause_in_its_video_and_a_law_in_most(
    scores: list[CauseScore], suspects: list[int], *, is_law: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    leavings, trial = leaving(scores, monkeypatch)
    assert leavings.suspects(trial) == suspects
    assert leavings.most_call_for_a_law(trial, 2.0) is is_law
    assert not leavings.most_call_for_a_law(trial, 5.0)


def test_laws_are_judged_by_videos_that_have_not_lost_their_course_and_what_happens_once_by_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial = create_autospec(Trial, instance=True)
    trial.fit = Mock(fits=(1, 2, 3), part=Mock(side_effect=tuple))
    asked: list[object] = []
    of_all, of_some = (Check(name, 1.0, 0.5, False, "") for name in ("of all", "of some"))

    def run(fit: object, *, seed: int) -> tuple[Check, ...]:
        assert seed == 0
        asked.append(fit)
        return (of_all if fit is trial.fit else of_some,)

    monkeypatch.setattr(leavings_module, "run_checks", run)
    monkeypatch.setattr(leavings_module, "trusted", lambda _fits: np.array([True, False, True]))
    leavings = Leavings((), 0)
    for _ in range(2):
        assert leavings.own(trial, SurfaceTilt()) == (of_some,)
        assert leavings.own(trial, ExternalImpulse()) == (of_all,)
    assert asked == [(0, 2), trial.fit]
    monkeypatch.setattr(leavings_module, "trusted", lambda _fits: np.ones(3, dtype=bool))
    assert Leavings((), 0).own(trial, SurfaceTilt()) == (of_all,)


@pytest.mark.parametrize(
    ("lost", "by_video", "shown", "searched"),
    [
        (True, ONE, False, True),
        (True, ALIKE, False, False),
        (True, ONE, True, False),
        (False, ONE, False, False),
    ],
    ids=["single videos are lost", "most call for a law", "tracks show a wall", "none is lost"],
)
def test_lost_videos_are_searched_before_causes_unless_something_shows_what_they_lack(
    by_video: tuple[float, ...], *, lost: bool, shown: bool, searched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    leaving([law(SurfaceTilt(), by_video)], monkeypatch)
    monkeypatch.setattr(stages, "gain_needed", lambda _causes: 2.0)
    fit, better = create_autospec(SharedFit, instance=True), create_autospec(SharedFit, instance=True)
    fit.fits, fit.videos, fit.with_lost_courses.return_value = (), ("a", "b", "c", "d"), better
    outcome = create_autospec(Outcome, instance=True)
    outcome.verdict = Verdict.NONE
    given: list[SharedFit] = []
    monkeypatch.setattr(stages, "fit_together", lambda *_given, **_how: fit)
    monkeypatch.setattr(stages, "loses_single_videos", lambda _fits: lost)
    monkeypatch.setattr(stages, "surfaces_unknown_to", lambda *_given: ["wall"] if shown else [])
    monkeypatch.setattr(stages, "frames_unknown_to", lambda *_given: [])
    found = create_autospec(Search, instance=True)
    monkeypatch.setattr(stages, "search", lambda one, *_given, **_how: given.append(one) or found)
    monkeypatch.setattr(stages, "outcome_of", lambda _found, **_how: outcome)
    assert stages.Stages(default_model(), (), 0, None).outcome([]) is outcome
    assert given == [better if searched else fit]
