"""Which videos are searched anew for another course of events, and which such course is kept."""

from unittest.mock import Mock

import pytest

from tests.discovery.stand_ins import refit_with
from vrdp_prob.discovery.selection import courses
from vrdp_prob.discovery.selection.courses import Courses


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
