"""In which order the search tries causes."""

from collections.abc import Sequence
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import refit_with, refits_with, start_with, without_tracks
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import comparison, courses, forward, lesser_models, refits
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.comparison import Comparison
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.forward import ForwardSelection, Step
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wall import Wall


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    without_tracks(monkeypatch)


def _selection(needed: float = 0.0) -> ForwardSelection:
    return ForwardSelection(refits_with(needed))


def _asked(monkeypatch: pytest.MonkeyPatch) -> list[Trial]:
    """The models on which causes are tried, as they come; none is."""
    asked: list[Trial] = []

    def tried(self: ForwardSelection, trial: Trial) -> Step:
        asked.append(trial)
        return self.untried(trial)

    monkeypatch.setattr(ForwardSelection, "tried", tried)
    return asked


@pytest.mark.parametrize(("in_doubt", "order"), [(False, ["tilt", "drag", "kicks"]), (True, ["kicks", "tilt", "drag"])])
def test_kicks_come_last_unless_the_best_other_cause_is_in_doubt(
    in_doubt: bool, order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kicks, tilt, drag = refit_with("kicks", 30.0, patches=True), refit_with("tilt", 20.0), refit_with("drag", 10.0)
    asked: list[Trial] = []

    def doubted(_self: object, trial: Trial, _lesser: object, _divisor: np.ndarray) -> bool:
        asked.append(trial)
        return in_doubt

    monkeypatch.setattr(refits.Refits, "doubted", doubted)
    found = _selection()._in_order(refit_with("nothing", 0.0), [drag, kicks, tilt])
    assert [one.causes[0] for one in found] == order
    assert asked == [tilt]


def test_kicks_alone_are_ordered_by_merit() -> None:
    kicks, weaker = refit_with("kicks", 30.0, patches=True), refit_with("kicks", 5.0, patches=True)
    assert _selection()._in_order(refit_with("nothing", 0.0), [weaker, kicks]) == [kicks, weaker]


@pytest.mark.parametrize(
    ("both", "in_doubt", "is_found"),
    [(8.0, False, True), (8.0, True, False), (0.5, False, False)],
    ids=["both stand out", "too few videos speak for both", "both bring too little"],
)
def test_two_causes_are_found_of_which_neither_stands_out_beside_chance(
    both: float, in_doubt: bool, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, second = refit_with("", 0.0), refit_with("tilt", -1.0), refit_with("tilt+drag", both)
    monkeypatch.setattr(refits.Refits, "with_lost", lambda _self, trial: [second] if trial is tilt else [])
    monkeypatch.setattr(ForwardSelection, "_in_order", lambda _self, _trial, found: found)
    monkeypatch.setattr(Leavings, "of", Mock())
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: in_doubt)
    assert _selection(needed=2.0)._pair(nothing, tilt) == ((tilt, second) if is_found else None)


@pytest.mark.parametrize(("paired", "best"), [(True, "tilt"), (False, "friction")])
def test_fits_from_the_beginning_are_tried_where_no_two_causes_are_established(
    *, paired: bool, best: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cause may have lost videos in its refit from the model without it, and explain all of them by itself."""
    nothing, tilt, both = refit_with("", 0.0), refit_with("tilt", 1.0), refit_with("tilt+drag", 8.0)
    anew = refit_with("friction", 50.0)
    monkeypatch.setattr(refits.Refits, "of", lambda _self, _trial: [tilt])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, _found: False)
    monkeypatch.setattr(refits.Refits, "provisional", lambda _self, _trial, _found: tilt)
    monkeypatch.setattr(refits.Refits, "leaves_unexplained", lambda _self, _trial, _first: False)
    monkeypatch.setattr(refits.Refits, "with_lost_found", lambda _self, _trial, first: first)
    monkeypatch.setattr(refits.Refits, "with_lost", lambda _self, _trial: [tilt, anew])
    monkeypatch.setattr(ForwardSelection, "_pair", lambda _self, _trial, first: (first, both) if paired else None)
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: False)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    step = _selection(needed=2.0).tried(nothing)
    assert step.tried[0].causes == (best,)
    assert step.pair == ((tilt, both) if paired else None)


@pytest.mark.parametrize("leaves", [True, False], ids=["explains no lost video", "explains them"])
def test_lost_videos_are_searched_with_every_cause_before_one_that_explains_none_of_them_is_gone_on_from(
    *, leaves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, jitter, slip = refit_with("", 0.0), refit_with("jitter", 5.0), refit_with("slip", 50.0)
    gone_on_from: list[str] = []

    def with_lost_found(_self: object, _trial: Trial, first: Trial) -> Trial:
        gone_on_from.append(str(first.causes[0]))
        return first

    monkeypatch.setattr(refits.Refits, "of", lambda _self, _trial: [jitter])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: slip in found)
    monkeypatch.setattr(refits.Refits, "provisional", lambda _self, _trial, _found: jitter)
    monkeypatch.setattr(refits.Refits, "leaves_unexplained", lambda _self, _trial, _first: leaves)
    monkeypatch.setattr(refits.Refits, "with_lost_found", with_lost_found)
    monkeypatch.setattr(refits.Refits, "with_lost", lambda _self, _trial: [slip, jitter])
    monkeypatch.setattr(ForwardSelection, "_pair", lambda *_given: None)
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: False)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    assert _selection(needed=2.0).tried(nothing).tried == (slip, jitter)
    assert gone_on_from == ([] if leaves else ["jitter"])


@pytest.mark.parametrize(
    ("kicked", "both", "taken"),
    [(3.0, 8.0, "tilt"), (3.0, 3.1, "kicks"), (None, 8.0, "tilt"), (3.0, None, "kicks"), (None, None, None)],
    ids=["two explain more", "two explain no more", "kicks are in doubt", "no two are established", "nothing"],
)
def test_an_established_pair_goes_before_kicks_that_explain_less(
    kicked: float | None, both: float | None, taken: str | None
) -> None:
    winner = None if kicked is None else refit_with("kicks", kicked)
    pair = None if both is None else (refit_with("tilt", 1.0), refit_with("tilt+drag", both))
    found = _selection(needed=2.0).or_first_of(pair, winner)
    assert (found and found.causes[0]) == taken


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
    _judge_by_gain(monkeypatch)
    base, found = _selection(needed=2.0).chosen(nothing, Step(nothing, Mock(spec=Left), (winner,)))
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
    _judge_by_gain(monkeypatch)
    base, winner = _selection(needed=2.0).chosen(tilt, Step(tilt, Mock(spec=Left), (kicked,)))
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
    _judge_by_gain(monkeypatch)
    assert _selection(needed=2.0).chosen(base, Step(base, Mock(spec=Left), (winner,))) == (base, winner)
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
    _judge_by_gain(monkeypatch)
    found, taken = _selection(needed=5.0).chosen(before, Step(before, Mock(spec=Left), (winner,)))
    assert found is mended
    assert taken is None
    without.mended.assert_called_once_with([1], seed=0, thorough=True)


def _judge_by_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    def doubted(_self: object, trial: Trial, lesser: Trial, _divisor: object) -> bool:
        return bool((trial.log_density - lesser.log_density).sum() < 2.0)

    monkeypatch.setattr(Leavings, "of", Mock())
    monkeypatch.setattr(refits.Refits, "doubted", doubted)


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
    _judge_by_gain(monkeypatch)
    base, found = _selection(needed=2.0).chosen(before, Step(before, Mock(spec=Left), (winner,)))
    assert base is both
    assert (found and found.causes[0]) == taken


def test_of_several_walls_at_once_none_is_a_merit_of_a_better_course(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model to go on from is that without any of them."""
    tilt, walls = refit_with("tilt", 0.0), refit_with("tilt+wall+second_wall", 50.0)
    walls.without.return_value = refit_with("tilt", 0.5)
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    _judge_by_gain(monkeypatch)
    step = Step(tilt, Mock(spec=Left), (walls,))
    assert _selection(needed=2.0).chosen(tilt, step) == (tilt, walls)
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
    asked = _asked(monkeypatch)
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: chosen[trial])
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, trial, *_causes: left_out[trial])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, steps, limit = _selection(needed=6.0).models(plain)
    assert chain == ([mended] if needs_it else [mended, again])
    assert asked == [plain, friction, both, *chain]
    assert len(steps) == len(chain)
    assert not limit


def test_a_course_that_gains_nothing_without_the_cause_is_not_handed_back(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt = refit_with("", 0.0), refit_with("tilt", 50.0)
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: refit_with("", 1.0))
    assert _selection(needed=6.0).handed_back([plain, tilt], [_step(), _step()]) == [plain, tilt]


@pytest.mark.parametrize(("lacking", "again"), [(250.0, True), (350.0, False)])
def test_causes_are_not_looked_for_anew_for_a_course_that_brings_a_trifle_of_what_a_model_lacks(
    lacking: float, *, again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, tilt, better = refit_with("", 0.0), refit_with("tilt", 50.0), refit_with("", 10.0)  # in each of three videos
    plain.lacking = lacking
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: True)
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: better)
    found = _selection(needed=6.0).handed_back([plain, tilt], [_step(), _step()])
    assert found == ([better] if again else [plain, tilt])


@pytest.mark.parametrize(("lacking", "times"), [(250.0, 2), (350.0, 1)])
def test_causes_are_not_tried_anew_for_a_course_that_brings_a_trifle_of_what_a_model_lacks(
    lacking: float, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, better = refit_with("", 0.0), refit_with("", 10.0)
    plain.lacking, plain.causes, better.causes = lacking, (), ()
    asked = _asked(monkeypatch)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, _trial, _step: (better, None))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, _, limit = _selection(needed=6.0).models(plain)
    assert chain == [better]
    assert len(asked) == times
    assert not limit


def test_a_search_ends_though_each_round_finds_a_better_course(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, *better = (refit_with("", 10.0 * number) for number in range(forward.MOST_ROUNDS + 2))
    for one in (plain, *better):
        one.lacking, one.causes = 0.0, ()
    following = dict(pairwise([plain, *better]))
    asked = _asked(monkeypatch)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: (following[trial], None))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    chain, _, limit = _selection(needed=6.0).models(plain)
    assert chain == better[-1:]
    assert asked == [plain, *better[:-1]]
    assert limit == forward.COURSES_LEFT


def _asked_of_each(models: Sequence[Mock], monkeypatch: pytest.MonkeyPatch) -> list[Trial]:
    """The models on which causes are tried, as they come, each of which leads to the next one."""
    following = dict(pairwise(models))
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: (trial, following[trial]))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    return _asked(monkeypatch)


def test_a_search_ends_at_five_causes_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    models = [refit_with("+".join("abcde"[:count]), 10.0 * count) for count in range(forward.MOST_CAUSES + 1)]
    asked = _asked_of_each(models, monkeypatch)
    chain, steps, limit = _selection(needed=6.0).models(models[0])
    assert chain == models
    assert asked == models[:-1]
    assert len(steps) == len(chain)
    assert limit == forward.CAUSES_LEFT


def test_causes_that_come_in_one_step_count_each_and_things_of_one_cause_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two at a time, and a second wall that is none."""
    names = ("", "tilt+wall", "tilt+wall+second_wall", "tilt+wall+second_wall+drag+kick", "+".join("abcdef"))
    models = [refit_with(name, 10.0 * count) for count, name in enumerate(names)]
    for one in models:
        one.cause_names = one.cause_names - {"second_wall"}
    asked = _asked_of_each(models, monkeypatch)
    chain, _, limit = _selection(needed=6.0).models(models[0])
    assert chain == models
    assert asked == models[:-1]
    assert limit == forward.CAUSES_LEFT


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
    found = _selection(needed=6.0).handed_back([plain, tilt], [_step(*tried), _step()])
    assert found == ([better, tilt] if remains else [better])


def test_rivals_are_those_that_came_close_on_the_model_on_which_they_were_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Though that has a better course of events since, and they would bring less beside it."""
    plain, tilt, drag, better = (refit_with(*one) for one in (("", 0.0), ("tilt", 50.0), ("drag", 15.0), ("", 14.0)))
    tilt.causes, drag.causes, tilt.names = (SurfaceTilt(),), (LinearDrag(),), (SurfaceTilt.name,)
    clear = Mock(spec=CauseScore, effect=LinearDrag(), size=30.0)
    asked: list[list[CauseScore]] = []
    monkeypatch.setattr(Extensions, "made_of", lambda _self, _trial, scores: asked.append(list(scores)) or [])
    step = Step(plain, Left((clear,), (), np.ones(3)), (tilt, drag))
    assert Comparison(refits_with())._rivals(tilt, (better,), [_step(), step]) == ((),)
    assert asked == [[clear]]


@pytest.mark.parametrize("wall_first", [True, False])
@pytest.mark.parametrize("begun", [True, False], ids=["the search began with both", "found one after the other"])
def test_what_else_a_body_may_have_met_is_a_rival_of_a_wall_beside_another_cause(
    *, wall_first: bool, begun: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Walls and discs have no score: their fits begin where they were when they were tried."""
    tilt, wall, disc = SurfaceTilt(), Wall(), HiddenObstacle()
    plain, best, rival = refit_with("", 0.0), refit_with("tilt+wall", 90.0), refit_with("tilt+disc", 88.0)
    order = (wall, tilt) if wall_first else (tilt, wall)
    best.causes, best.names, rival.causes = order, tuple(one.name for one in order), (tilt, disc)
    without = {wall: refit_with("tilt", 50.0), tilt: refit_with("wall", 40.0)}
    base = plain if wall_first else without[wall]
    tried = [refit_with("", size) for size in (80.0, 78.0)]
    for one, cause in zip(tried, (wall, disc), strict=True):
        one.causes = (*base.causes, cause)
    tilted = refit_with("", 85.0)
    tilted.causes = (tilt,)
    met = Step(base, Left((), (), np.ones(3)), tuple(tried))
    steps = [met, _step(tilted), _step()] if wall_first else [_step(tilted), met, _step()]
    asked: list[tuple[Trial, Effect, Trial]] = []

    def instead(
        _self: Extensions, one: Trial, cause: Effect, lesser: Trial, starts: Sequence[CauseScore]
    ) -> list[Trial]:
        if starts:
            asked.append((one, cause, lesser))
            assert [start.effect for start in starts] == [disc]
        return [rival] if starts else []

    monkeypatch.setattr(Extensions, "instead", instead)
    monkeypatch.setattr(Extensions, "made_of", lambda *_given: [])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    beginning = Beginning(order, default_model(), {wall.name: (start_with(disc),), tilt.name: ()})
    comparison = Comparison(refits_with(), beginning if begun else None)
    lesser = tuple(without[one] for one in order)
    found = comparison._rivals(best, lesser, [_step(), _step()] if begun else steps)
    assert found[order.index(wall)] == (rival,)
    assert asked == [(best, wall, without[wall])]


def test_what_a_better_course_leaves_is_scored_though_the_cause_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt, again, better = (refit_with(*one) for one in (("", 0.0), ("tilt", 50.0), ("tilt", 60.0), ("", 10.0)))
    chosen = {plain: (plain, tilt), tilt: (again, None), again: (again, None)}
    monkeypatch.setattr(forward, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(ForwardSelection, "tried", ForwardSelection.untried)
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: chosen[trial])
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _trial, *_causes: better)
    left = {one: Left((), (), np.full(3, float(number))) for number, one in enumerate((plain, tilt, again, better))}
    monkeypatch.setattr(Leavings, "of", lambda _self, trial: left[trial])
    chain, steps, _ = _selection(needed=6.0).models(plain)
    assert chain == [better, again]
    assert [step.left for step in steps] == [left[better], left[again]]


def _step(*tried: Trial) -> Step:
    """A step in which some causes were tried."""
    return Step(refit_with("", 0.0), Left((), (), np.ones(3)), tried)


def test_what_the_last_of_several_rivals_makes_needless_goes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each rival is better than the one before it; the last takes a place, and is asked what it needs."""
    rivals = [refit_with("tilt+drag", 10.0 * count) for count in range(comparison.MOST_SWAPS + 2)]
    pruned = refit_with("drag", 10.0 * comparison.MOST_SWAPS)
    following = dict(pairwise(rivals))
    asked: list[Trial] = []

    def without_what_is_needless(
        _self: LesserModels, best: Trial, lesser: tuple[Trial, ...], _divisor: np.ndarray
    ) -> tuple[Trial, tuple[Trial, ...]]:
        asked.append(best)
        return (pruned, ()) if best is rivals[comparison.MOST_SWAPS] else (best, lesser)

    monkeypatch.setattr(LesserModels, "pruned", without_what_is_needless)
    monkeypatch.setattr(LesserModels, "without_each", lambda *_given: ())
    monkeypatch.setattr(refits.Refits, "is_nothing", lambda *_given: False)
    monkeypatch.setattr(Comparison, "_rivals", lambda _self, best, *_given: ((following.get(best, best),),))
    found, lesser, near = Comparison(refits_with()).compared(rivals[:1], [_step()])
    assert asked == rivals[: comparison.MOST_SWAPS + 1]
    assert found is pruned
    assert lesser == ()
    assert near == ((pruned,),)


def test_a_law_that_loses_most_videos_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, wind, drag = refit_with("", 0.0), refit_with("wind", 30.0), refit_with("drag", 10.0)
    wind.loses_most_of.return_value = True
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: False)
    assert _selection()._in_order(nothing, [wind, drag]) == [drag, wind]


def test_a_cause_that_may_be_nothing_goes_though_another_one_brings_less(monkeypatch: pytest.MonkeyPatch) -> None:
    both, drag, tilt = refit_with("tilt+drag", 10.0), refit_with("drag", 5.0), refit_with("tilt", 6.0)
    monkeypatch.setattr(refits.Refits, "doubted", lambda _self, trial, lesser, _divisor: lesser is drag)
    monkeypatch.setattr(LesserModels, "without_each", lambda *_given: ())
    assert LesserModels(refits_with()).pruned(both, (drag, tilt), np.ones(3))[0] is drag


@pytest.mark.parametrize(
    ("explains", "is_believed", "taken"),
    [(9.5, True, "tilt"), (9.5, False, None), (6.0, True, None)],
    ids=["as much", "as much, and doubted as well", "less"],
)
def test_a_rival_takes_the_place_of_a_doubted_cause_where_it_explains_as_much(
    explains: float, is_believed: bool, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, bowl, tilt = refit_with("", 0.0), refit_with("bowl", 10.0), refit_with("tilt", explains)
    nothing.causes, bowl.causes, tilt.causes = (), (Bowl(),), (SurfaceTilt(),)
    tilt.continued.return_value = tilt
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _best, _divisor, _cause: nothing)
    _judge_by_gain(monkeypatch)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(spec=Left, overdispersion=np.ones(3)))
    before = Search(nothing, bowl, (), (nothing,), ((tilt,),), refits_with(needed=2.0))
    found = before.with_rival(bowl.causes[0], lambda _trial: is_believed)
    assert (found.best if found else None) is (tilt if taken else None)


def test_what_brings_too_little_without_a_doubted_cause_goes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, lens, both = refit_with("", 0.0), refit_with("lens", 0.5), refit_with("lens+bowl", 9.0)
    bowl = Bowl()
    nothing.causes, lens.causes, both.causes = (), (LensDistortion(),), (LensDistortion(), bowl)
    both.without.return_value, lens.continued.return_value = lens, lens
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _best, _divisor, _cause: nothing)
    _judge_by_gain(monkeypatch)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(spec=Left, overdispersion=np.ones(3)))
    base = refit_with("", 0.0)
    found = Search(base, both, (), (lens, nothing), ((), ()), refits_with(needed=5.0)).without([bowl])
    assert found.best is base
    assert found.lesser == ()


@pytest.mark.parametrize(
    ("brought", "may_vanish", "is_searched"),
    [(900.0, False, False), (900.0, True, True), (5.0, False, True)],
    ids=["plainly", "by courses of events", "little"],
)
def test_a_model_without_a_cause_is_searched_where_it_may_do_as_well(
    brought: float, *, may_vanish: bool, is_searched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a cause brings that may as well vanish are courses of events, which the model without it may find, too."""
    best, without, found = refit_with("tilt+drag", brought), refit_with("drag", 0.0), refit_with("drag", brought)
    best.may_vanish.return_value = may_vanish
    best.without.return_value, without.mended.return_value = without, found
    without.continued.return_value, found.continued.return_value = without, found
    without.fit.fits = ["a", "b", "c"]
    monkeypatch.setattr(lesser_models, "doubtful", lambda _fits: [1])
    assert LesserModels(refits_with(needed=2.0)).left_out(best, np.ones(3), SurfaceTilt()) is (
        found if is_searched else without
    )
    assert [call.args for call in without.mended.call_args_list] == ([([1],)] if is_searched else [])
