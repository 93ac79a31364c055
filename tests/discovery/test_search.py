"""In which order the search tries causes, and where it ends."""

from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import asked_of_each, refit_with, selection_with, without_tracks
from vrdp_prob.discovery.selection import forward, refits
from vrdp_prob.discovery.selection.forward import ForwardSelection
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.trials import Trial


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    without_tracks(monkeypatch)


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
    found = selection_with()._in_order(refit_with("nothing", 0.0), [drag, kicks, tilt])
    assert [one.causes[0] for one in found] == order
    assert asked == [tilt]


def test_kicks_alone_are_ordered_by_merit() -> None:
    kicks, weaker = refit_with("kicks", 30.0, patches=True), refit_with("kicks", 5.0, patches=True)
    assert selection_with()._in_order(refit_with("nothing", 0.0), [weaker, kicks]) == [kicks, weaker]


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
    assert selection_with(needed=2.0)._pair(nothing, tilt) == ((tilt, second) if is_found else None)


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
    step = selection_with(needed=2.0).tried(nothing)
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
    assert selection_with(needed=2.0).tried(nothing).tried == (slip, jitter)
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
    found = selection_with(needed=2.0).or_first_of(pair, winner)
    assert (found and found.causes[0]) == taken


def test_a_search_ends_at_five_causes_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    models = [refit_with("+".join("abcde"[:count]), 10.0 * count) for count in range(forward.MOST_CAUSES + 1)]
    asked = asked_of_each(models, monkeypatch)
    chain, steps, limit = selection_with(needed=6.0).models(models[0])
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
    asked = asked_of_each(models, monkeypatch)
    chain, _, limit = selection_with(needed=6.0).models(models[0])
    assert chain == models
    assert asked == models[:-1]
    assert limit == forward.CAUSES_LEFT


def test_a_law_that_loses_most_videos_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing, wind, drag = refit_with("", 0.0), refit_with("wind", 30.0), refit_with("drag", 10.0)
    wind.loses_most_of.return_value = True
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: False)
    assert selection_with()._in_order(nothing, [wind, drag]) == [drag, wind]
