"""Which videos are searched anew for another course of events, and which such course is kept."""

from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import judge_by_gain, refit_with, refits_with, selection_with, without_tracks
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection import courses, refits
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.forward import ForwardSelection
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels


def test_a_video_is_searched_again_only_where_the_last_search_has_found_something_or_it_has_fallen_since(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tilt, followed, better = refit_with("tilt", 5.0), refit_with("two videos followed", 7.0), refit_with("all did", 9.0)
    tilt.fit = better.fit = Mock(fits=[""] * 4)
    tilt.mended.return_value, followed.mended.return_value, better.mended.return_value = followed, better, better
    tilt.fallen_from.return_value = [2]
    followed.fallen_from.side_effect = lambda other: [3] if other is tilt else []
    better.fallen_from.return_value = []
    monkeypatch.setattr(courses, "may_take_another_course", lambda _fit: True)
    found = Courses(seed=0)
    assert found.searched_anew(tilt, [1, 2]) is better
    for _ in range(2):
        assert found.searched_anew(better, [1, 2]) is better
    tilt.mended.assert_called_once_with([1, 2], seed=0, thorough=True)
    followed.mended.assert_called_once_with([3], seed=0)
    better.mended.assert_called_once_with([2], seed=1, thorough=True)


@pytest.mark.parametrize("is_wrong", [True, False], ids=["lost", "explained still"])
def test_a_course_for_which_another_video_loses_its_own_is_a_wrong_one(
    *, is_wrong: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tilt, other = refit_with("tilt", 5.0), refit_with("another course", 9.0)
    tilt.fit = other.fit = Mock(fits=[""] * 4)
    tilt.mended.return_value = other.mended.return_value = other
    tilt.fallen_from.return_value, other.fallen_from.return_value = [], [3]
    other.loses_videos_of.return_value = is_wrong
    monkeypatch.setattr(courses, "may_take_another_course", lambda _fit: True)
    found = Courses(seed=0)
    for _ in range(2 if is_wrong else 1):
        assert found.searched_anew(tilt, [2]) is (tilt if is_wrong else other)
    tilt.mended.assert_called_once_with([2], seed=0, thorough=True)


def check(p_value: float) -> Check:
    return Check("lost frames", 0.0, p_value, False, "")


@pytest.mark.parametrize(
    ("causes", "videos", "lost", "fails", "is_wrong", "taken"),
    [
        ("drag", 12, [], True, False, True),
        ("", 12, [], True, False, False),
        ("drag", 13, [], True, False, False),
        ("drag", 12, [4], True, False, False),
        ("drag", 12, [], False, False, False),
        ("drag", 12, [], True, True, False),
    ],
    ids=["it explains them", "no cause", "many videos", "one is lost", "no check fails", "another video is lost then"],
)
def test_all_videos_are_searched_anew_where_a_model_explains_them_and_a_check_fails(
    causes: str,
    videos: int,
    lost: list[int],
    *,
    fails: bool,
    is_wrong: bool,
    taken: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, other = refit_with(causes, 10.0), refit_with(causes, 30.0)
    found.causes, found.fit = tuple(one for one in found.causes if one), Mock(fits=[""] * videos)
    found.with_other_courses.side_effect = lambda among, *, seed: {(tuple(range(videos)), 0): other}[tuple(among), seed]
    other.loses_videos_of.side_effect = lambda before: is_wrong and before is found
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: lost)
    monkeypatch.setattr(Leavings, "checks", lambda _self, _trial: (check(0.3), check(0.002 if fails else 0.003)))
    assert refits_with().searched_where_checks_fail(found) is (other if taken else found)


def test_a_course_that_a_failing_check_has_led_to_is_gone_on_from(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but the fit of the last model is another one where the cause still has the merit."""
    plain, drag, better = refit_with("", 0.0), refit_with("drag", 50.0), refit_with("drag", 60.0)
    plain.causes = ()
    asked = []
    without_tracks(monkeypatch)
    judge_by_gain(monkeypatch)
    monkeypatch.setattr(ForwardSelection, "tried", lambda self, trial: asked.append(trial) or self.untried(trial))
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, one, _step: (one, drag if one is plain else None))
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: plain)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    monkeypatch.setattr(
        refits.Refits, "searched_where_checks_fail", lambda _self, trial: better if trial is drag else trial
    )
    chain, steps, limit = selection_with(needed=6.0).models(plain)
    assert chain == [plain, better]
    assert asked == [plain, drag, better]
    assert len(steps) == len(chain)
    assert not limit
