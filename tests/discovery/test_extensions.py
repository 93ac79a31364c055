"""How far fits with further causes are followed, and from where they begin."""

from unittest.mock import Mock, create_autospec

import pytest

from tests.discovery.stand_ins import refit_with
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.candidates.surfaces import Placed
from vrdp_prob.discovery.selection import extensions
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


def extensions_with(needed: float = 0.0) -> Extensions:
    return Extensions(Leavings((), seed=0), needed=needed, advance=lambda _count: None)


@pytest.fixture(autouse=True)
def something_explains_the_videos(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extensions, "explained", lambda _fits: True)


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

    monkeypatch.setattr(extensions, "fit_with_surfaces", fitted)
    monkeypatch.setattr(extensions, "explained", lambda _fits: explains)
    monkeypatch.setattr(Leavings, "something", lambda _self, _trial: leaves)
    trial = refit_with("", 0.0)
    trial.and_causes.side_effect = lambda _causes, fit: refit_with(*fit)
    found = extensions_with().with_surfaces(
        trial, [create_autospec(Placed, instance=True, effect=SurfaceTilt(), wall=Mock())]
    )
    assert (None if found is None else found.causes[0]) == taken


@pytest.mark.parametrize(("brought", "followed"), [(200.0, True), (500.0, False)], ids=["less", "as promised"])
def test_the_most_promising_cause_is_followed_whatever_others_have_brought(
    brought: float, *, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    effects = {name: Mock() for name in ("wind", "patch")}
    names = ("wind", "wind", "wind", "patch")
    wind, further, found, patch = all_ = [
        refit_with(name, gained) for name, gained in zip(names, (1, 2, 9, 3), strict=True)
    ]
    for one, name, gained in zip(all_, names, (brought, 400.0, 2000.0, 1000.0), strict=True):
        effects[name].name = name
        one.causes, one.brought.return_value = (effects[name],), gained
        one.fallen_from.return_value = [1] if one is further else []
        one.fit.joint.converged = one is not wind
    wind.continued.return_value, further.mended.return_value = further, found
    nothing = refit_with("", 0.0)
    nothing.with_cause = lambda score: wind if score.effect is effects["wind"] else patch
    sizes = {"wind": 900.0, "patch": 600.0}
    scores = [Mock(spec=CauseScore, effect=effects[name], size=size) for name, size in sizes.items()]
    assert extensions_with().made_of(nothing, scores)[0] is (found if followed else patch)


def _broken_off(promised: float) -> tuple[Mock, Mock, Mock]:
    """A model, its refit with a cause, which has lost a video and brings nothing, and what the score had promised."""
    refit, effect = refit_with("cause", -1.0), Mock()
    effect.name, refit.causes, refit.fit.joint.converged = "cause", (effect,), False
    refit.brought.return_value, refit.fallen_from.return_value = -3.0, [1]
    refit.continued.return_value = refit.mended.return_value = refit
    nothing = refit_with("", 0.0)
    nothing.with_cause = lambda _score: refit
    return nothing, refit, Mock(spec=CauseScore, effect=effect, size=promised)


@pytest.mark.parametrize(("promised", "followed"), [(20.0, True), (10.0, False)], ids=["enough", "too little"])
def test_a_cause_is_not_followed_that_promises_less_than_it_needs(
    promised: float, *, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    nothing, refit, score = _broken_off(promised)
    assert extensions_with(needed=6.0).made_of(nothing, [score]) == [refit]
    assert refit.continued.called is followed


def test_a_law_that_falls_short_is_freed_of_videos_that_hold_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    nothing, refit, score = _broken_off(20.0)
    mended, freed = refit_with("cause", 0.0), refit_with("cause", 30.0)
    for one, gained in ((mended, -3.0), (freed, 90.0)):
        one.causes, one.brought.return_value, one.fit.joint.converged = refit.causes, gained, True
    refit.mended.return_value = mended
    mended.freed.side_effect = lambda base, *, seed: freed if (base, seed) == (nothing, 0) else refit
    assert extensions_with(needed=6.0).made_of(nothing, [score]) == [freed]


def test_refits_that_may_win_are_followed_to_the_end_freed_and_begun_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    nothing, effects = refit_with("", 0.0), {name: Mock() for name in ("wind", "patch")}
    wind, further, freed, larger, patch = (
        refit_with(name, gained) for name, gained in (("w", 1), ("w", 2), ("w", 9), ("w", 9.5), ("p", 1))
    )
    for one, name, gained in (
        (wind, "wind", 50.0),
        (further, "wind", 60.0),
        (freed, "wind", 90.0),
        (larger, "wind", 95.0),
        (patch, "patch", 9.0),
    ):
        effects[name].name = name
        one.causes, one.brought.return_value, one.fit.joint.converged = (effects[name],), gained, one is not wind
    wind.continued.return_value, further.freed.side_effect = further, lambda _base, *, seed: freed
    nothing.with_cause = lambda score: wind if score.effect is effects["wind"] else patch
    scores = [Mock(spec=CauseScore, effect=effect, size=10.0) for effect in effects.values()]
    freed.begun_elsewhere.side_effect = lambda base, score: larger if (base, score) == (nothing, scores[0]) else freed
    assert extensions_with().made_of(nothing, scores) == [larger, patch]
    assert not patch.freed.called


@pytest.mark.parametrize(
    ("explains", "promised", "is_followed"),
    [(False, 40.0, True), (True, 40.0, False), (False, 20.0, False)],
    ids=["nothing explains the videos", "something does", "it promises far less"],
)
def test_where_nothing_explains_the_videos_refits_that_broke_off_are_followed_if_they_promise_as_much(
    explains: bool, promised: float, *, is_followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drag broke off at a third of what a bowl had brought, on the way to more."""
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(extensions, "explained", lambda _fits: explains)
    nothing, effects = refit_with("", 0.0), {name: Mock() for name in ("bowl", "drag")}
    bowl, drag, arrived = (refit_with(name, merit) for name, merit in (("bowl", 2), ("drag", 1), ("drag", 9)))
    for one, name, gained in ((bowl, "bowl", 88.0), (drag, "drag", 34.0), (arrived, "drag", 89.0)):
        effects[name].name = name
        one.causes, one.brought.return_value, one.fit.joint.converged = (effects[name],), gained, one is not drag
    bowl.continued.return_value = bowl
    bowl.freed.side_effect = lambda _base, *, seed: bowl
    drag.continued.return_value = arrived
    arrived.freed.side_effect = lambda _base, *, seed: arrived
    nothing.with_cause = lambda score: drag if score.effect is effects["drag"] else bowl
    sizes = {"bowl": 50.0, "drag": promised}
    scores = [Mock(spec=CauseScore, effect=effects[name], size=size) for name, size in sizes.items()]
    assert extensions_with().made_of(nothing, scores)[0] is (arrived if is_followed else bowl)


@pytest.mark.parametrize("once", [True, False], ids=["kicks", "a law"])
def test_a_refit_that_brings_nothing_is_followed_once_at_most(*, once: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: once)
    nothing, refit, score = _broken_off(20.0)
    assert extensions_with(needed=6.0).made_of(nothing, [score]) == [refit]
    assert refit.mended.call_count == (0 if once else 1)
