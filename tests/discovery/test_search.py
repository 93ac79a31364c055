"""In which order the search tries causes."""

from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.candidates.surfaces import Placed
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection import refits, search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.ascent import ImpossibleStartError
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


def _refit(cause: str, gained: float, *, patches: bool = False) -> Mock:
    """A refit, with what it gains in each of three videos, and whether its cause patches several of them."""
    refit = create_autospec(Trial, instance=True)
    refit.causes, refit.log_density, refit.log_prior = tuple(cause.split("+")), np.full(3, gained), 0.0
    refit.fit = Mock(videos=(0, 1, 2))
    refit.beyond = lambda base: tuple(one for one in refit.causes if one not in base.causes)
    refit.patches.return_value, refit.may_vanish.return_value = patches, False
    refit.loses_videos_of.return_value, refit.fallen_from.return_value = False, []
    return refit


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    """No refit here has tracks to look at, nor fits of videos that could be explained or not."""
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [])
    monkeypatch.setattr(refits, "trusted", lambda _fits: np.ones(4, dtype=bool))
    monkeypatch.setattr(search, "explained", lambda _fits: True)


def _searcher(needed: float = 0.0) -> search._Searcher:
    return search._Searcher(_refits(needed))


def _refits(needed: float = 0.0) -> refits.Refits:
    return refits.Refits((), seed=0, needed=needed, advance=lambda _count: None)


@pytest.mark.parametrize(("in_doubt", "order"), [(False, ["tilt", "drag", "kicks"]), (True, ["kicks", "tilt", "drag"])])
def test_kicks_come_last_unless_the_best_other_cause_is_in_doubt(
    in_doubt: bool, order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kicks, tilt, drag = _refit("kicks", 30.0, patches=True), _refit("tilt", 20.0), _refit("drag", 10.0)
    asked: list[Trial] = []

    def doubted(_self: object, trial: Trial, _lesser: object, _divisor: np.ndarray) -> bool:
        asked.append(trial)
        return in_doubt

    monkeypatch.setattr(search._Searcher, "doubted", doubted)
    found = _searcher()._in_order(_refit("nothing", 0.0), [drag, kicks, tilt])
    assert [one.causes[0] for one in found] == order
    assert asked == [tilt]


def test_kicks_alone_are_ordered_by_merit() -> None:
    kicks, weaker = _refit("kicks", 30.0, patches=True), _refit("kicks", 5.0, patches=True)
    assert _searcher()._in_order(_refit("nothing", 0.0), [weaker, kicks]) == [kicks, weaker]


@pytest.mark.parametrize(
    ("both", "in_doubt", "is_found"),
    [(8.0, False, True), (8.0, True, False), (0.5, False, False)],
    ids=["both stand out", "too few videos speak for both", "both bring too little"],
)
def test_two_causes_are_found_of_which_neither_stands_out_beside_chance(
    both: float, in_doubt: bool, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, second = _refit("", 0.0), _refit("tilt", -1.0), _refit("tilt+drag", both)
    monkeypatch.setattr(refits.Refits, "with_lost", lambda _self, trial: [second] if trial is tilt else [])
    monkeypatch.setattr(search._Searcher, "_in_order", lambda _self, _trial, found: found)
    monkeypatch.setattr(refits.Refits, "left", Mock())
    monkeypatch.setattr(search._Searcher, "doubted", lambda *_given: in_doubt)
    assert _searcher(needed=2.0)._pair(nothing, tilt) == ((tilt, second) if is_found else None)


@pytest.mark.parametrize(
    ("least", "lacking", "name"),
    [(2.0, 200.0, "tilt"), (70.0, 200.0, None), (2.0, 400.0, None)],
    ids=["enough", "too little", "a trifle of what lacks"],
)
def test_the_first_of_two_is_what_brings_most_but_for_kicks_where_all_else_is_noise(
    least: float, lacking: float, name: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, drag, kicks = (_refit(*one) for one in (("", 0.0), ("tilt", -1.0), ("drag", 0.5), ("kicks", 0.2)))
    for one, brought in ((nothing, 0.0), (tilt, 60.0), (drag, 20.0), (kicks, 90.0)):
        one.brought.return_value = brought
    nothing.lacking = lacking
    monkeypatch.setattr(refits, "mends_any_course", lambda cause: cause == "kicks")
    found = _searcher(needed=least)._provisional(nothing, [drag, kicks, tilt])
    assert found is (tilt if name else None)


@pytest.mark.parametrize(("before", "taken"), [(True, "drag"), (False, "tilt")], ids=["most", "few"])
def test_a_law_is_none_to_go_on_from_that_loses_most_videos_which_were_explained(
    before: bool, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, drag = (_refit(*one) for one in (("", 0.0), ("tilt", 1.0), ("drag", 0.5)))
    for one, brought, explains in ((nothing, 0.0, before), (tilt, 60.0, False), (drag, 20.0, True)):
        one.brought.return_value, one.fit.fits, one.lacking = brought, explains, 50.0
    monkeypatch.setattr(refits, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(search, "explained", lambda fits: fits)
    found = _searcher(needed=2.0)._provisional(nothing, [drag, tilt])
    assert found is not None
    assert found.causes == (taken,)


@pytest.mark.parametrize(
    ("kicked", "both", "taken"),
    [(3.0, 8.0, "tilt"), (3.0, 3.1, "kicks"), (None, 8.0, "tilt"), (3.0, None, "kicks"), (None, None, None)],
    ids=["two explain more", "two explain no more", "kicks are in doubt", "no two are established", "nothing"],
)
def test_an_established_pair_goes_before_kicks_that_explain_less(
    kicked: float | None, both: float | None, taken: str | None
) -> None:
    winner = None if kicked is None else _refit("kicks", kicked)
    pair = None if both is None else (_refit("tilt", 1.0), _refit("tilt+drag", both))
    found = _searcher(needed=2.0).or_first_of(pair, winner)
    assert (found and found.causes[0]) == taken


@pytest.mark.parametrize(
    ("without", "goes_on_from", "taken"),
    [(0.0, "", "tilt"), (5.0, "better course", "tilt"), (9.5, "better course", None)],
    ids=["the cause brings it", "cause and course bring it", "the course brings it"],
)
def test_what_a_better_course_of_events_brings_is_no_merit_of_the_cause(
    without: float, goes_on_from: str, taken: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, winner, better = _refit("", 0.0), _refit("tilt", 10.0), _refit("better course", without)
    winner.without.return_value = better

    monkeypatch.setattr(search, "mends_any_course", lambda _cause: False)
    _judge_by_gain(monkeypatch)
    base, found = _searcher(needed=2.0).chosen(nothing, search.Step(Mock(spec=refits.Left), (winner,)))
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
    tilt, kicked, anew = _refit("tilt", 0.0), _refit("kicks", 10.0), _refit("tilt searched anew", found)
    kicked.without.return_value, tilt.mended.return_value, anew.mended.return_value = tilt, anew, anew
    tilt.fallen_from.return_value = anew.fallen_from.return_value = []
    kicked.acting.return_value = [0, 2]
    tilt.fit = Mock(fits=["of one course only", "", ""])
    monkeypatch.setattr(refits, "may_take_another_course", lambda fit: fit != "of one course only")
    monkeypatch.setattr(search, "mends_any_course", lambda _cause: True)
    _judge_by_gain(monkeypatch)
    base, winner = _searcher(needed=2.0).chosen(tilt, search.Step(Mock(spec=refits.Left), (kicked,)))
    assert base.causes[0] == goes_on_from
    assert (winner and winner.causes[0]) == taken
    tilt.mended.assert_called_once_with([2], seed=0, thorough=True)


def test_a_better_course_is_not_gone_on_from_with_a_video_that_has_lost_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Or a cause that has kept both courses would get the credit for it."""
    before, winner, without, mended = _refit("", 0.0), _refit("drag", 20.0), _refit("", 10.0), _refit("", 19.5)
    winner.without.return_value = without
    without.fallen_from.side_effect = lambda base: [1] if base is before else []
    without.mended.return_value, without.fit.fits = mended, ["explained", "lost", "explained"]
    monkeypatch.setattr(refits, "may_take_another_course", lambda _fit: True)
    monkeypatch.setattr(search, "mends_any_course", lambda _cause: False)
    _judge_by_gain(monkeypatch)
    found, taken = _searcher(needed=5.0).chosen(before, search.Step(Mock(spec=refits.Left), (winner,)))
    assert found is mended
    assert taken is None
    without.mended.assert_called_once_with([1], seed=0, thorough=True)


def _judge_by_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    def doubted(_self: object, trial: Trial, lesser: Trial, _divisor: object) -> bool:
        return bool((trial.log_density - lesser.log_density).sum() < 2.0)

    monkeypatch.setattr(refits.Refits, "left", Mock())
    monkeypatch.setattr(search._Searcher, "doubted", doubted)


@pytest.mark.parametrize(
    ("turns", "doubted", "alone"),
    [(6, False, True), (2, False, False), (6, True, False)],
    ids=["plain", "of few turns", "doubted"],
)
def test_where_walls_that_tracks_show_are_plain_nothing_else_is_tried(
    turns: int, *, doubted: bool, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, walls, drag = _refit("", 0.0), _refit("wall+second_wall", 20.0), _refit("drag", 5.0)
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [Mock(seen=Mock(turns=turns))])
    monkeypatch.setattr(refits.Refits, "_met", lambda _self, _trial, _placed: walls)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "left", Mock())
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: doubted)
    assert _refits(needed=6.0).of(plain) == ([walls] if alone else [walls, drag])


@pytest.mark.parametrize(
    ("stated", "explains", "leaves", "near", "taken"),
    [
        (20.0, True, False, 30.0, "stated"),
        (20.0, True, True, 30.0, "near"),
        (20.0, True, True, 10.0, "stated"),
        (20.0, False, True, 30.0, "stated"),
        (None, True, True, 30.0, "near"),
        (None, True, True, None, None),
    ],
    ids=["nothing left", "a little off", "not off", "lost anyway", "overlaps what is seen", "no world"],
)
def test_walls_that_may_be_a_little_off_are_unknown_from_the_beginning(
    stated: float | None,
    near: float | None,
    taken: str | None,
    *,
    explains: bool,
    leaves: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where those that count as stated explain the videos and leave something, or have no world."""

    def fitted(_trial: Trial, _placed: object, walls: list[object], *, seed: int) -> tuple[str, float]:
        gained = stated if walls else near
        if gained is None:
            raise ImpossibleStartError
        return ("stated" if walls else "near"), gained

    monkeypatch.setattr(refits, "fit_with_surfaces", fitted)
    monkeypatch.setattr(refits, "explained", lambda _fits: explains)
    monkeypatch.setattr(refits.Refits, "_leaves_something", lambda _self, _trial: leaves)
    trial = _refit("", 0.0)
    trial.and_causes.side_effect = lambda _causes, fit: _refit(*fit)
    found = _refits()._met(trial, [create_autospec(Placed, instance=True, effect=SurfaceTilt(), wall=Mock())])
    assert (None if found is None else found.causes[0]) == taken


def test_of_several_walls_at_once_none_is_a_merit_of_a_better_course(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model to go on from is that without any of them."""
    tilt, walls = _refit("tilt", 0.0), _refit("tilt+wall+second_wall", 50.0)
    walls.without.return_value = _refit("tilt", 0.5)
    monkeypatch.setattr(search, "mends_any_course", lambda _cause: False)
    _judge_by_gain(monkeypatch)
    step = search.Step(Mock(spec=refits.Left), (walls,))
    assert _searcher(needed=2.0).chosen(tilt, step) == (tilt, walls)
    walls.without.assert_called_once_with("wall", "second_wall")


@pytest.mark.parametrize("needs_it", [True, False], ids=["the course alone", "the cause, too"])
def test_a_course_found_beside_causes_is_handed_back_and_causes_are_looked_for_once_more(
    *, needs_it: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, friction, both = _refit("", 0.0), _refit("friction", 20.0), _refit("friction+drag", 30.0)
    found, without_drag, mended = _refit("friction+drag", 90.0), _refit("friction", 80.0), _refit("", 60.0)
    plain.causes = mended.causes = ()
    again = _refit("friction", 81.0)
    chosen = {plain: (plain, friction), friction: (friction, both), both: (found, None)}
    chosen |= {mended: (mended, None if needs_it else again), again: (again, None)}
    left_out = {found: without_drag, without_drag: mended}
    asked: list[Trial] = []

    def tried(self: search._Searcher, trial: Trial) -> search.Step:
        asked.append(trial)
        return self.untried(trial)

    monkeypatch.setattr(search._Searcher, "tried", tried)
    monkeypatch.setattr(search._Searcher, "chosen", lambda _self, trial, _step: chosen[trial])
    monkeypatch.setattr(search._Searcher, "_left_out", lambda _self, trial, *_causes: left_out[trial])
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: refits.Left((), (), np.ones(3)))
    chain, steps = _searcher(needed=6.0).forward(plain)
    assert chain == ([mended] if needs_it else [mended, again])
    assert asked == [plain, friction, both, *chain]
    assert len(steps) == len(chain)


def test_a_course_that_gains_nothing_without_the_cause_is_not_handed_back(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt = _refit("", 0.0), _refit("tilt", 50.0)
    monkeypatch.setattr(search._Searcher, "_left_out", lambda _self, _trial, *_causes: _refit("", 1.0))
    assert _searcher(needed=6.0).handed_back([plain, tilt]) == [plain, tilt]


def test_a_law_that_loses_most_videos_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, wind, drag = _refit("", 0.0), _refit("wind", 30.0), _refit("drag", 10.0)
    for one in (nothing, wind, drag):
        one.fit.fits = one is not wind
    monkeypatch.setattr(search, "explained", lambda fits: fits)
    monkeypatch.setattr(search._Searcher, "doubted", lambda *_given: False)
    assert _searcher()._in_order(nothing, [wind, drag]) == [drag, wind]


@pytest.mark.parametrize("enough", [True, False], ids=["enough", "too little"])
@pytest.mark.parametrize("refitted", [True, False], ids=["refitted before", "not refitted"])
def test_lost_videos_are_searched_once_and_refits_made_only_where_that_leaves_something(
    *, refitted: bool, enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tilt, drag, lost = _refit("tilt", 1.0), _refit("drag", 5.0), _refit("tilt+friction", 50.0)
    asked: list[Trial] = []

    def searched(_self: object, trial: Trial, _found: object) -> list[Trial]:
        asked.append(trial)
        return [lost]

    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: enough and found[:1] == [lost])
    monkeypatch.setattr(refits.Refits, "_lost", searched)
    found = _refits()
    if refitted:
        found.of(tilt)
    for _ in range(2):
        assert found.with_lost(tilt) == ([lost] if enough and not refitted else [lost, drag])
    assert found.of(tilt) == found.with_lost(tilt)
    assert asked == [tilt]


def test_lost_videos_are_not_searched_where_refits_leave_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, drag = _refit("", 0.0), _refit("drag", 5.0)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: found == [drag])
    monkeypatch.setattr(refits.Refits, "_lost", Mock(side_effect=AssertionError))
    found = _refits()
    assert found.of(plain) == found.with_lost(plain) == [drag]


@pytest.mark.parametrize(
    ("lost", "kicked", "asked", "taken"),
    [
        ([2], [], [2], "tilt searched anew"),
        ([2], [], [2], "tilt"),
        ([2], [2, 2], [2], "tilt searched anew"),
        ([], [1], [1], "tilt searched anew"),
        ([0, 1], [3], None, "tilt"),
        ([], [], None, "tilt"),
    ],
    ids=["a better course", "no better one", "a lost one is kicked", "a kicked one", "more than half", "none"],
)
def test_a_cause_has_its_few_lost_videos_searched_anew(
    lost: list[int],
    kicked: list[int],
    asked: list[int] | None,
    taken: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nothing, tilt, drag = _refit("", 0.0), _refit("tilt", 5.0), _refit("drag", 7.0)
    tilt.fit = Mock(fits=[""] * 4)
    anew = _refit("tilt searched anew", 9.0)
    tilt.mended.return_value, anew.mended.return_value = anew if taken != "tilt" else tilt, anew
    tilt.fallen_from.return_value = anew.fallen_from.return_value = []
    kicks = Mock(spec=CauseScore, effect=ExternalImpulse(), sites=[Mock(video=video) for video in kicked])
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: lost)
    monkeypatch.setattr(refits, "may_take_another_course", lambda _fit: True)
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: Mock(scores=[kicks], beside_chance=[]))
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag, tilt])
    found = _refits()
    first = found.with_lost_found(nothing, tilt)
    assert first.causes == (taken,)
    assert [call.args for call in tilt.mended.call_args_list] == ([] if asked is None else [(asked,)])
    assert [one.causes[0] for one in found.of(nothing)] == (
        ["drag", "tilt"] if taken == "tilt" else ["tilt searched anew", "drag"]
    )


@pytest.mark.parametrize(
    ("p_value", "explains", "loses", "taken"),
    [
        (1e-5, True, False, "all searched anew"),
        (1e-5, True, True, "tilt"),
        (1e-5, False, False, "tilt"),
        (0.2, True, False, "tilt"),
    ],
    ids=["something is left", "a video is lost with it", "most videos are not explained", "nothing is left"],
)
def test_where_a_cause_leaves_something_all_videos_are_searched_anew(
    p_value: float, taken: str, *, explains: bool, loses: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, anew = _refit("", 0.0), _refit("tilt", 5.0), _refit("all searched anew", 9.0)
    anew.loses_videos_of.return_value = loses
    tilt.fit = Mock(fits=[""] * 4)
    tilt.with_other_courses.return_value = anew
    left = Mock(scores=[], beside_chance=[Mock(p_value=p_value)])
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: [])
    monkeypatch.setattr(refits, "explained", lambda _fits: explains)
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: left)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [tilt])
    found = _refits()
    assert found.with_lost_found(nothing, tilt).causes == (taken,)
    assert [one.causes[0] for one in found.of(nothing)] == [taken]


def test_a_video_is_searched_again_only_where_the_last_search_has_found_something_or_it_has_fallen_since(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tilt, followed, better = _refit("tilt", 5.0), _refit("two videos followed", 7.0), _refit("all did", 9.0)
    tilt.fit = better.fit = Mock(fits=[""] * 4)
    tilt.mended.return_value, followed.mended.return_value, better.mended.return_value = followed, better, better
    tilt.fallen_from.return_value = [2]
    followed.fallen_from.side_effect = lambda other: [3] if other is tilt else []
    better.fallen_from.return_value = []
    monkeypatch.setattr(refits, "may_take_another_course", lambda _fit: True)
    found = _refits()
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
    tilt, other = _refit("tilt", 5.0), _refit("another course", 9.0)
    tilt.fit = other.fit = Mock(fits=[""] * 4)
    tilt.mended.return_value = other.mended.return_value = other
    tilt.fallen_from.return_value, other.fallen_from.return_value = [], [3]
    other.loses_videos_of.return_value = is_wrong
    monkeypatch.setattr(refits, "may_take_another_course", lambda _fit: True)
    found = _refits()
    for _ in range(2 if is_wrong else 1):
        assert found.searched_anew(tilt, [2]) is (tilt if is_wrong else other)
    tilt.mended.assert_called_once_with([2], seed=0, thorough=True)


@pytest.mark.parametrize(("brought", "followed"), [(200.0, True), (500.0, False)], ids=["less", "as promised"])
def test_the_most_promising_cause_is_followed_whatever_others_have_brought(
    brought: float, *, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refits, "mends_any_course", lambda _cause: False)
    effects = {name: Mock() for name in ("wind", "patch")}
    names = ("wind", "wind", "wind", "patch")
    wind, further, found, patch = all_ = [
        _refit(name, gained) for name, gained in zip(names, (1, 2, 9, 3), strict=True)
    ]
    for one, name, gained in zip(all_, names, (brought, 400.0, 2000.0, 1000.0), strict=True):
        effects[name].name = name
        one.causes, one.brought.return_value = (effects[name],), gained
        one.fallen_from.return_value = [1] if one is further else []
        one.fit.joint.converged = one is not wind
    wind.continued.return_value, further.mended.return_value = further, found
    nothing = _refit("", 0.0)
    nothing.with_cause = lambda score: wind if score.effect is effects["wind"] else patch
    sizes = {"wind": 900.0, "patch": 600.0}
    scores = [Mock(spec=CauseScore, effect=effects[name], size=size) for name, size in sizes.items()]
    assert _refits().made_of(nothing, scores)[0] is (found if followed else patch)


def _broken_off(promised: float) -> tuple[Mock, Mock, Mock]:
    """A model, its refit with a cause, which has lost a video and brings nothing, and what the score had promised."""
    refit, effect = _refit("cause", -1.0), Mock()
    effect.name, refit.causes, refit.fit.joint.converged = "cause", (effect,), False
    refit.brought.return_value, refit.fallen_from.return_value = -3.0, [1]
    refit.continued.return_value = refit.mended.return_value = refit
    nothing = _refit("", 0.0)
    nothing.with_cause = lambda _score: refit
    return nothing, refit, Mock(spec=CauseScore, effect=effect, size=promised)


@pytest.mark.parametrize(("promised", "followed"), [(20.0, True), (10.0, False)], ids=["enough", "too little"])
def test_a_cause_is_not_followed_that_promises_less_than_it_needs(
    promised: float, *, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refits, "mends_any_course", lambda _cause: False)
    nothing, refit, score = _broken_off(promised)
    assert _refits(needed=6.0).made_of(nothing, [score]) == [refit]
    assert refit.continued.called is followed


@pytest.mark.parametrize(
    ("astray", "outweighing", "is_asked"),
    [([2], True, True), ([0, 3], True, True), ([2], False, False), ([], True, False), ([0, 1, 2], True, False)],
    ids=["one video", "half of them", "one that leaves less than all others", "none", "most"],
)
def test_what_most_videos_ask_for_comes_first_where_few_have_gone_astray(
    astray: list[int], *, outweighing: bool, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial, lens, anew, bowl = _refit("", 0.0), _refit("lens", 1.0), _refit("lens", 500.0), _refit("bowl", 0.5)
    trial.fit.fits, anew.fit.fits = ["a", "b", "c", "d"], ["explained"]
    usual = np.ones(4, dtype=bool)
    usual[astray] = False
    kicks, wide, clear, faint = (
        Mock(spec=CauseScore, effect=effect, size=size, p_value=1e-9, sites=())
        for effect, size in (
            (ExternalImpulse(), 300.0),
            (LensDistortion(), 200.0),
            (Bowl(), 150.0),
            (SurfaceTilt(), 50.0),
        )
    )
    left = refits.Left((kicks,), (kicks, wide, clear, faint), np.ones(4))
    made: list[list[CauseScore]] = []

    def made_of(_self: object, _trial: Trial, asked: list[CauseScore], **_beside: object) -> list[Trial]:
        made.append(list(asked))
        return [lens, bowl] if wide in asked else []

    def searched_anew(_self: object, one: Trial, videos: list[int]) -> Trial:
        assert (one, list(videos)) == (lens, astray)
        return anew

    monkeypatch.setattr(refits, "trusted", lambda _fits: usual)
    monkeypatch.setattr(refits, "outweigh", lambda fits, some: outweighing and (fits, some) == (trial.fit.fits, astray))
    monkeypatch.setattr(refits, "lost_videos", lambda fits: [] if fits == ["explained"] else [2])
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: left)
    monkeypatch.setattr(refits.Refits, "made_of", made_of)
    monkeypatch.setattr(refits.Refits, "searched_anew", searched_anew)
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, _found: False)
    found = _refits()
    if is_asked:
        assert found._new(trial) == [anew, bowl]
        assert made == [[wide, clear]]
    else:
        assert found._asked_by_most(trial) == made == []


@pytest.mark.parametrize("once", [True, False], ids=["kicks", "a law"])
def test_a_refit_that_brings_nothing_is_followed_once_at_most(*, once: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refits, "mends_any_course", lambda _cause: once)
    nothing, refit, score = _broken_off(20.0)
    assert _refits(needed=6.0).made_of(nothing, [score]) == [refit]
    assert refit.mended.call_count == (0 if once else 1)


@pytest.mark.parametrize(
    ("cause", "explain"), [(ExternalImpulse(), False), (ClockError(), True)], ids=["kicks", "jumps of the clock"]
)
def test_kicks_in_several_videos_explain_none_of_them_though_they_leave_nothing(
    cause: Effect, *, explain: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, found = _refit("", 0.0), _refit("", 90.0)
    found.causes, found.acting.return_value = (cause,), [0, 2]
    monkeypatch.setattr(refits, "gain", lambda trial, _base: (90.0 if trial is found else 0.0, 1.0))
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: refits.Left((), (), np.ones(3)))
    assert _refits(needed=6.0).settled(nothing, [found]) is explain


@pytest.mark.parametrize(
    ("before", "p_value", "is_tried"),
    [(("tilt",), 0.02, False), (("tilt",), 1e-4, True), ((), 0.02, True)],
    ids=["chance makes as much", "chance does not", "no cause is there yet"],
)
def test_beside_a_cause_none_is_tried_where_no_score_stands_out_from_chance(
    before: tuple[str, ...], p_value: float, *, is_tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = _refit("", 0.0)
    trial.causes, trial.fit.fits = before, _explained(3)
    clear, beside = (Mock(spec=CauseScore, effect=Bowl(), size=30.0, p_value=one, sites=()) for one in (1e-9, p_value))
    tried: list[list[CauseScore]] = []
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: refits.Left((clear,), (beside,), np.ones(3)))
    monkeypatch.setattr(refits, "causes_with_own_check_failing", lambda _checks: set())
    monkeypatch.setattr(refits.Refits, "checks", lambda _self, _trial: ())
    monkeypatch.setattr(refits.Refits, "made_of", lambda _self, _trial, asked, **_beside: tried.append(asked) or [])
    assert _refits(needed=6.0)._new(trial) == []
    assert ([clear] in tried) is is_tried


def _explained(count: int) -> list[Mock]:
    """Fits of so many videos that leave nothing but noise."""
    return [Mock(misfit=Mock(ratio=1.0)) for _ in range(count)]


@pytest.mark.parametrize(
    ("before", "brought", "is_tried"),
    [((), 1.0, True), ((), 9.0, False), (("tilt",), 1.0, False)],
    ids=["nothing brings enough", "something does", "there is a cause already"],
)
def test_a_cause_whose_own_check_fails_is_tried_where_nothing_brings_enough(
    before: tuple[str, ...], brought: float, *, is_tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial, other = _refit("nothing", 0.0), _refit("bowl", 1.0)
    trial.causes, other.causes = before, (Bowl(),)
    other.brought.return_value = brought
    clear, faint = (
        Mock(spec=CauseScore, effect=effect, size=size, p_value=p_value, sites=())
        for effect, size, p_value in ((Bowl(), 50.0, 1e-9), (MassDependentFriction(), 4.0, 0.04))
    )
    scores = (clear, faint)
    made: list[list[str]] = []

    def made_of(_self: object, _trial: Trial, asked: list[CauseScore], **_beside: object) -> list[Trial]:
        made.append([one.effect.name for one in asked])
        return [other] if made[-1] == ["bowl"] else []

    failing = Check("friction of the bodies against mass", 0.07, 1e-9, True, "")
    monkeypatch.setattr(refits, "run_checks", lambda _fit, *, seed: (failing,))
    monkeypatch.setattr(refits.Refits, "made_of", made_of)
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, _found: True)
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: refits.Left(scores, scores, np.ones(3)))
    assert _refits(needed=6.0).of(trial) == [other]
    assert (["mass_dependent_friction"] in made) is is_tried


def test_a_cause_with_which_no_joint_world_can_begin_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def impossible(*_given: object, **_named: object) -> None:
        raise ImpossibleStartError

    monkeypatch.setattr(refits, "fit_together", impossible)
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: [0])
    monkeypatch.setattr(refits, "causes_of_lost_videos", lambda *_given, **_named: [((SurfaceTilt(),), 50.0)])
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: Mock(scores=()))
    trial = _refit("", 0.0)
    trial.choices, trial.names, trial.fit = {}, (), Mock(fits=[], model=Mock(effects=()))
    assert _refits()._lost(trial, []) == []


@pytest.mark.parametrize(
    ("may_vanish", "is_doubted"),
    [((False,), False), ((True,), True), ((True, False), False), ((True, True), True)],
    ids=["there", "perhaps nothing", "one of two perhaps nothing", "both perhaps nothing"],
)
def test_what_may_as_well_be_nothing_is_not_established(may_vanish: tuple[bool, ...], is_doubted: bool) -> None:
    names = ["tilt", "drag"][: len(may_vanish)]
    nothing, found = _refit("", 0.0), _refit("+".join(names), 10.0)
    nothing.causes = ()
    found.may_vanish.side_effect = lambda cause, _divisor: may_vanish[names.index(cause)]
    assert _refits(needed=2.0).doubted(found, nothing, np.ones(3)) is is_doubted


def test_a_cause_that_may_be_nothing_goes_though_another_one_brings_less(monkeypatch: pytest.MonkeyPatch) -> None:
    both, drag, tilt = _refit("tilt+drag", 10.0), _refit("drag", 5.0), _refit("tilt", 6.0)
    monkeypatch.setattr(search._Searcher, "doubted", lambda _self, trial, lesser, _divisor: lesser is drag)
    monkeypatch.setattr(search._Searcher, "_lesser", lambda *_given: ())
    assert _searcher()._pruned(both, (drag, tilt), np.ones(3))[0] is drag


@pytest.mark.parametrize(
    ("explains", "is_believed", "taken"),
    [(9.5, True, "tilt"), (9.5, False, None), (6.0, True, None)],
    ids=["as much", "as much, and doubted as well", "less"],
)
def test_a_rival_takes_the_place_of_a_doubted_cause_where_it_explains_as_much(
    explains: float, is_believed: bool, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, bowl, tilt = _refit("", 0.0), _refit("bowl", 10.0), _refit("tilt", explains)
    nothing.causes, bowl.causes, tilt.causes = (), (Bowl(),), (SurfaceTilt(),)
    tilt.continued.return_value = tilt
    monkeypatch.setattr(search._Searcher, "_left_out", lambda _self, _best, _cause: nothing)
    _judge_by_gain(monkeypatch)
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: Mock(spec=refits.Left, overdispersion=np.ones(3)))
    before = search.Search(nothing, bowl, (), (nothing,), ((tilt,),), _refits(needed=2.0))
    found = before.with_rival(bowl.causes[0], lambda _trial: is_believed)
    assert (found.best if found else None) is (tilt if taken else None)


def test_what_brings_too_little_without_a_doubted_cause_goes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, lens, both = _refit("", 0.0), _refit("lens", 0.5), _refit("lens+bowl", 9.0)
    bowl = Bowl()
    nothing.causes, lens.causes, both.causes = (), (LensDistortion(),), (LensDistortion(), bowl)
    both.without.return_value, lens.continued.return_value = lens, lens
    monkeypatch.setattr(search._Searcher, "_left_out", lambda _self, _best, _cause: nothing)
    _judge_by_gain(monkeypatch)
    monkeypatch.setattr(refits.Refits, "left", lambda _self, _trial: Mock(spec=refits.Left, overdispersion=np.ones(3)))
    base = _refit("", 0.0)
    found = search.Search(base, both, (), (lens, nothing), ((), ()), _refits(needed=5.0)).without([bowl])
    assert found.best is base
    assert found.lesser == ()
