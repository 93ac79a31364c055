"""Rivals of the causes that were found, and what the others make needless."""

from collections.abc import Sequence
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import (
    judge_by_gain,
    refit_with,
    refits_with,
    start_with,
    step_of,
    without_tracks,
)
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import comparison, lesser_models, refits
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.comparison import Comparison
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.forward import Step
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
    assert Comparison(refits_with())._rivals(tilt, (better,), [step_of(), step]) == ((),)
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
    steps = [met, step_of(tilted), step_of()] if wall_first else [step_of(tilted), met, step_of()]
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
    found = comparison._rivals(best, lesser, [step_of(), step_of()] if begun else steps)
    assert found[order.index(wall)] == (rival,)
    assert asked == [(best, wall, without[wall])]


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
    found, lesser, near = Comparison(refits_with()).compared(rivals[:1], [step_of()])
    assert asked == rivals[: comparison.MOST_SWAPS + 1]
    assert found is pruned
    assert lesser == ()
    assert near == ((pruned,),)


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
    judge_by_gain(monkeypatch)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(spec=Left, overdispersion=np.ones(3)))
    before = Search(nothing, bowl, (nothing,), ((tilt,),), refits_with(needed=2.0))
    found = before.with_rival(bowl.causes[0], lambda _trial: is_believed)
    assert (found.best if found else None) is (tilt if taken else None)


def test_what_brings_too_little_without_a_doubted_cause_goes_too(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, lens, both = refit_with("", 0.0), refit_with("lens", 0.5), refit_with("lens+bowl", 9.0)
    bowl = Bowl()
    nothing.causes, lens.causes, both.causes = (), (LensDistortion(),), (LensDistortion(), bowl)
    both.without.return_value, lens.continued.return_value = lens, lens
    monkeypatch.setattr(LesserModels, "left_out", lambda _self, _best, _divisor, _cause: nothing)
    judge_by_gain(monkeypatch)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(spec=Left, overdispersion=np.ones(3)))
    base = refit_with("", 0.0)
    found = Search(base, both, (lens, nothing), ((), ()), refits_with(needed=5.0)).without([bowl])
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
