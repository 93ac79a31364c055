"""What a better course of events brings is no merit of the cause beside which it was found."""

from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import asked_models, judge_by_gain, refit_with, selection_with, step_of, without_tracks
from vrdp_prob.discovery.selection import courses, forward
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.forward import ForwardSelection, Step
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    without_tracks(monkeypatch)


@pytest.mark.parametrize(
    ("without", "goes_on_from", "taken"),
    [(0.0, "", "tilt"), (5.0, "better course", "tilt"), (9.5, "better course", None)],
    ids=["the cause brings it", "cause and course bring it", "the course brings it"],
)
def test_what_a_better_course_of_events_brings_is_no_merit_of_the_cause(
    without: float, goes_on_from: str, taken: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, winner, better = refit_with("", 0.0), refit_with("tilt", 10.0), refit_with("better course", without)
    winner.without.return_value = better

    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    judge_by_gain(monkeypatch)
    base, found = selection_with(needed=2.0).chosen(nothing, Step(nothing, Mock(spec=Left), (winner,)))
    assert base.causes[0] == goes_on_from
    assert (found and found.causes[0]) == taken


@pytest.mark.parametrize(
    ("found", "goes_on_from", "taken"),
    [(9.5, "tilt searched anew", None), (0.0, "tilt", "kicks")],
    ids=["a course that kicks stood for", "no other course"],
)
def test_videos_with_kicks_are_searched_anew_without_them(
    found: float, goes_on_from: str, taken: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    tilt, kicked, anew = refit_with("tilt", 0.0), refit_with("kicks", 10.0), refit_with("tilt searched anew", found)
    kicked.without.return_value, tilt.mended.return_value, anew.mended.return_value = tilt, anew, anew
    tilt.fallen_from.return_value = anew.fallen_from.return_value = []
    kicked.acting.return_value = [0, 2]
    tilt.fit = Mock(fits=["of one course only", "", ""])
    monkeypatch.setattr(courses, "may_take_another_course", lambda fit: fit != "of one course only")
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: True)
    judge_by_gain(monkeypatch)
    base, winner = selection_with(needed=2.0).chosen(tilt, Step(tilt, Mock(spec=Left), (kicked,)))
    assert base.causes[0] == goes_on_from
    assert (winner and winner.causes[0]) == taken
    tilt.mended.assert_called_once_with([2], seed=0, thorough=True)


@pytest.mark.parametrize(("share", "searched"), [(0.6, [[1]]), (0.4, [])], ids=["most of it", "less than half"])
def test_a_video_in_which_a_cause_brings_most_is_searched_without_it(
    share: float, searched: list[list[int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    base, winner = refit_with("", 0.0), refit_with("drag", 10.0)
    winner.log_density = 30.0 * np.array([0.3, share, 0.7 - share])
    winner.without.return_value = base
    asked: list[list[int]] = []
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(Courses, "searched_anew", lambda _self, one, videos: asked.append(videos) or one)
    judge_by_gain(monkeypatch)
    assert selection_with(needed=2.0).chosen(base, Step(base, Mock(spec=Left), (winner,))) == (base, winner)
    assert asked == searched


def test_a_better_course_is_not_gone_on_from_with_a_video_that_has_lost_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Or a cause that has kept both courses would get the credit for it."""
    before, winner, without, mended = (
        refit_with("", 0.0),
        refit_with("drag", 20.0),
        refit_with("", 10.0),
        refit_with("", 19.5),
    )
    winner.without.return_value = without
    without.fallen_from.side_effect = lambda base: [1] if base is before else []
    without.mended.return_value, without.fit.fits = mended, ["explained", "lost", "explained"]
    monkeypatch.setattr(courses, "may_take_another_course", lambda _fit: True)
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    judge_by_gain(monkeypatch)
    found, taken = selection_with(needed=5.0).chosen(before, Step(before, Mock(spec=Left), (winner,)))
    assert found is mended
    assert taken is None
    without.mended.assert_called_once_with([1], seed=0, thorough=True)


@pytest.mark.parametrize(("gained", "taken"), [(9.5, None), (3.0, "drag")], ids=["it explains the gain", "hardly"])
@pytest.mark.parametrize("given_back", [True, False], ids=["lost ones are given back", "the better one is taken over"])
def test_a_better_course_of_one_video_is_no_merit_of_the_cause_without_which_others_lose_theirs(
    gained: float, taken: str | None, *, given_back: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, winner, without, both = (refit_with(*one) for one in (("", 0.0), ("drag", 10.0), ("", -50.0), ("", gained)))
    winner.without.return_value, without.fitted_density = without, np.array([20.0, -80.0, -90.0])
    if given_back:
        without.with_courses_of.side_effect = lambda other: {before: both}[other]
    else:
        before.with_courses_of.side_effect = lambda other: {without: both}[other]
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    judge_by_gain(monkeypatch)
    base, found = selection_with(needed=2.0).chosen(before, Step(before, Mock(spec=Left), (winner,)))
    assert base is both
    assert (found and found.causes[0]) == taken


def test_of_several_walls_at_once_none_is_a_merit_of_a_better_course(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model to go on from is that without any of them."""
    tilt, walls = refit_with("tilt", 0.0), refit_with("tilt+wall+second_wall", 50.0)
    walls.without.return_value = refit_with("tilt", 0.5)
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    judge_by_gain(monkeypatch)
    step = Step(tilt, Mock(spec=Left), (walls,))
    assert selection_with(needed=2.0).chosen(tilt, step) == (tilt, walls)
    walls.without.assert_called_once_with("wall", "second_wall")


@pytest.mark.parametrize("needs_it", [True, False], ids=["the course alone", "the cause, too"])
def test_a_course_found_beside_causes_is_handed_back_and_causes_are_looked_for_once_more(
    *, needs_it: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, friction, both = refit_with("", 0.0), refit_with("friction", 20.0), refit_with("friction+drag", 30.0)
    found, without_drag, mended = refit_with("friction+drag", 90.0), refit_with("friction", 80.0), refit_with("", 60.0)
    plain.causes = mended.causes = ()
    again = refit_with("friction", 81.0)
    chosen = {plain: (plain, friction), friction: (friction, both), both: (found, None)}
    chosen |= {mended: (mended, None if needs_it else again), again: (again, None)}
    left_out = {found: without_drag, without_drag: mended}
    asked = asked_models(monkeypatch)
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: chosen[trial])
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, trial, *_causes: left_out[trial])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, steps, limit = selection_with(needed=6.0).models(plain)
    assert chain == ([mended] if needs_it else [mended, again])
    assert asked == [plain, friction, both, *chain]
    assert len(steps) == len(chain)
    assert not limit


def test_a_course_that_gains_nothing_without_the_cause_is_not_handed_back(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt = refit_with("", 0.0), refit_with("tilt", 50.0)
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: refit_with("", 1.0))
    assert selection_with(needed=6.0).handed_back([plain, tilt], [step_of(), step_of()]) == [plain, tilt]


@pytest.mark.parametrize(("lacking", "again"), [(250.0, True), (350.0, False)])
def test_causes_are_not_looked_for_anew_for_a_course_that_brings_a_trifle_of_what_a_model_lacks(
    lacking: float, *, again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, tilt, better = refit_with("", 0.0), refit_with("tilt", 50.0), refit_with("", 10.0)  # in each of three videos
    plain.lacking = lacking
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: True)
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: better)
    found = selection_with(needed=6.0).handed_back([plain, tilt], [step_of(), step_of()])
    assert found == ([better] if again else [plain, tilt])


@pytest.mark.parametrize(("lacking", "times"), [(250.0, 2), (350.0, 1)])
def test_causes_are_not_tried_anew_for_a_course_that_brings_a_trifle_of_what_a_model_lacks(
    lacking: float, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, better = refit_with("", 0.0), refit_with("", 10.0)
    plain.lacking, plain.causes, better.causes = lacking, (), ()
    asked = asked_models(monkeypatch)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, _trial, _step: (better, None))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, _, limit = selection_with(needed=6.0).models(plain)
    assert chain == [better]
    assert len(asked) == times
    assert not limit


def test_a_search_ends_though_each_round_finds_a_better_course(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, *better = (refit_with("", 10.0 * number) for number in range(forward.MOST_ROUNDS + 2))
    for one in (plain, *better):
        one.lacking, one.causes = 0.0, ()
    following = dict(pairwise([plain, *better]))
    asked = asked_models(monkeypatch)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: (following[trial], None))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, _, limit = selection_with(needed=6.0).models(plain)
    assert chain == better[-1:]
    assert asked == [plain, *better[:-1]]
    assert limit == forward.COURSES_LEFT


@pytest.mark.parametrize(
    ("rival", "lost", "kicks", "remains"),
    [(20.0, [], False, True), (37.0, [], False, False), (20.0, [1], False, False), (20.0, [], True, False)],
    ids=["none can overtake the cause", "another one might", "it has lost a video", "kicks"],
)
def test_a_cause_that_is_ahead_by_more_than_the_course_brings_is_not_looked_for_again(
    rival: float, lost: list[int], *, kicks: bool, remains: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, tilt, without, better = (refit_with(*one) for one in (("", 0.0), ("tilt", 50.0), ("", 4.0), ("", 10.0)))
    without.with_courses_of.side_effect = lambda other: {plain: better}[other]
    tilt.fallen_from.return_value = lost
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: kicks)
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: without)
    tried = (refit_with("tilt", 49.0), refit_with("drag", rival))
    found = selection_with(needed=6.0).handed_back([plain, tilt], [step_of(*tried), step_of()])
    assert found == ([better, tilt] if remains else [better])


def test_what_a_better_course_leaves_is_scored_though_the_cause_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt, again, better = (refit_with(*one) for one in (("", 0.0), ("tilt", 50.0), ("tilt", 60.0), ("", 10.0)))
    chosen = {plain: (plain, tilt), tilt: (again, None), again: (again, None)}
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(ForwardSelection, "tried", ForwardSelection.untried)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: chosen[trial])
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: better)
    left = {one: Left((), (), np.full(3, float(number))) for number, one in enumerate((plain, tilt, again, better))}
    monkeypatch.setattr(Leavings, "of", lambda _self, trial: left[trial])
    chain, steps, _ = selection_with(needed=6.0).models(plain)
    assert chain == [better, again]
    assert [step.left for step in steps] == [left[better], left[again]]
