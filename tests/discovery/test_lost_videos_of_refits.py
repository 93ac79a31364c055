"""What becomes of videos that refits with further causes leave lost."""

from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import refit_with, refits_with, without_tracks
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import courses, extensions, refits
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt

RADIUS, LENS = ContactRadiusError.name, LensDistortion.name


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    without_tracks(monkeypatch)


@pytest.mark.parametrize(
    ("lost", "explains", "mends", "tried"),
    [
        ([2], True, True, [[RADIUS]]),
        ([2], True, False, [[RADIUS], [LENS]]),
        ([0, 1, 2], True, True, [[RADIUS], [LENS]]),
        ([2], False, True, [[RADIUS], [LENS]]),
        ([], True, True, [[RADIUS], [LENS]]),
    ],
    ids=["a lost video", "one that is not found", "most", "no video is explained", "none"],
)
def test_lost_videos_of_the_best_cause_are_searched_before_lesser_causes_are_tried(
    lost: list[int], explains: bool, mends: bool, tried: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, radius, found, lens = (
        refit_with(*one) for one in (("", 0.0), ("radius", 20.0), ("radius", 90.0), ("lens", 5.0))
    )
    nothing.causes, nothing.lacking = (), 100.0
    radius.brought.return_value = found.brought.return_value = 60.0
    radius.fit.fits = [""] * 4
    clear, faint = (
        Mock(spec=CauseScore, effect=effect, size=size, p_value=1e-9, sites=())
        for effect, size in ((ContactRadiusError(), 300.0), (LensDistortion(), 100.0))
    )
    asked: list[list[str]] = []

    def made_of(_self: object, _trial: Trial, scores: list[CauseScore], **_beside: object) -> list[Trial]:
        if scores:
            asked.append([one.effect.name for one in scores])
        return [radius if one is clear else lens for one in scores]

    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(refits, "happens_once", lambda _cause: False)
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: lost)
    monkeypatch.setattr(refits, "explained", lambda _fits: explains)
    monkeypatch.setattr(refits.Refits, "_asked_by_most", lambda _self, _trial: [])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((clear, faint), (), np.ones(3)))
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, made: found in made)
    monkeypatch.setattr(Extensions, "made_of", made_of)
    monkeypatch.setattr(Courses, "searched_anew", lambda _self, one, videos: found if mends else one)
    made = refits_with(needed=2.0)._new(nothing)
    assert asked == tried
    assert made[0] is (found if tried == [[RADIUS]] else radius)


@pytest.mark.parametrize("enough", [True, False], ids=["enough", "too little"])
@pytest.mark.parametrize(
    ("refitted", "calls", "refits_first"),
    [(True, False, True), (False, True, True), (False, False, False)],
    ids=["refitted before", "a law is called for", "not refitted"],
)
def test_lost_videos_are_searched_once_and_refits_made_only_where_that_leaves_something(
    *, refitted: bool, calls: bool, refits_first: bool, enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tilt, drag, lost = refit_with("tilt", 1.0), refit_with("drag", 5.0), refit_with("tilt+friction", 50.0)
    asked: list[Trial] = []

    def searched(_self: object, trial: Trial, _found: object) -> list[Trial]:
        asked.append(trial)
        return [lost]

    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: enough and found[:1] == [lost])
    monkeypatch.setattr(refits.Refits, "_lost", searched)
    monkeypatch.setattr(Leavings, "laws", lambda _self, _trial, _needed: [SurfaceTilt()] if calls else [])
    found = refits_with()
    if refitted:
        found.of(tilt)
    for _ in range(2):
        assert found.with_lost(tilt) == ([lost, drag] if refits_first or not enough else [lost])
    assert found.of(tilt) == found.with_lost(tilt)
    assert asked == [tilt]


def test_lost_videos_are_not_searched_where_refits_leave_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, drag = refit_with("", 0.0), refit_with("drag", 5.0)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: found == [drag])
    monkeypatch.setattr(refits.Refits, "_lost", Mock(side_effect=AssertionError))
    found = refits_with()
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
    nothing, tilt, drag = refit_with("", 0.0), refit_with("tilt", 5.0), refit_with("drag", 7.0)
    tilt.fit = Mock(fits=[""] * 4, videos=range(4))
    anew = refit_with("tilt searched anew", 9.0)
    tilt.mended.return_value, anew.mended.return_value = anew if taken != "tilt" else tilt, anew
    tilt.fallen_from.return_value = anew.fallen_from.return_value = []
    kicks = Mock(spec=CauseScore, effect=ExternalImpulse(), sites=[Mock(video=video) for video in kicked])
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: lost)
    monkeypatch.setattr(refits, "explained", lambda _fits: True)
    monkeypatch.setattr(courses, "may_take_another_course", lambda _fit: True)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=[kicks], beside_chance=[]))
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag, tilt])
    found = refits_with()
    first = found.with_lost_found(nothing, tilt)
    assert first.causes == (taken,)
    assert [call.args for call in tilt.mended.call_args_list] == ([] if asked is None else [(asked,)])
    assert [one.causes[0] for one in found.of(nothing)] == (
        ["drag", "tilt"] if taken == "tilt" else ["tilt searched anew", "drag"]
    )


@pytest.mark.parametrize(
    ("p_value", "promised", "few", "explains", "loses", "taken"),
    [
        (1e-5, 30.0, [3], True, False, "searched anew"),
        (1e-5, 30.0, [3, 1], True, False, "searched anew"),
        (1e-5, 30.0, [3, 1, 0], True, False, "tilt"),
        (1e-50, 300.0, [3], True, False, "tilt"),
        (1e-5, 30.0, [3], True, True, "tilt"),
        (1e-5, 30.0, [3], False, False, "tilt"),
        (0.2, 5.0, [3], True, False, "tilt"),
    ],
    ids=[
        "something is left in one",
        "something is left in two",
        "something is left in most",
        "a law is called for",
        "a video is lost with it",
        "most videos are not explained",
        "nothing is left",
    ],
)
def test_where_a_cause_leaves_something_the_few_videos_that_call_for_it_are_searched_anew(
    p_value: float,
    promised: float,
    few: list[int],
    taken: str,
    *,
    explains: bool,
    loses: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nothing, tilt, anew = refit_with("", 0.0), refit_with("tilt", 5.0), refit_with("searched anew", 9.0)
    anew.loses_videos_of.return_value = loses
    tilt.fit = Mock(fits=[""] * 4, videos=[""] * 4)
    tilt.with_other_courses.return_value = anew
    calling = Mock(effect=SurfaceTilt(), p_value=p_value, size=2 * promised)
    calling.few_videos.return_value = few
    left = Mock(scores=[], beside_chance=[calling])
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: [])
    monkeypatch.setattr(refits, "explained", lambda _fits: explains)
    monkeypatch.setattr(refits.Refits, "_from_the_beginning", lambda _self, _trial, one: one)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: left)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [tilt])
    found = refits_with(needed=2.0)
    assert found.with_lost_found(nothing, tilt).causes == (taken,)
    assert [one.causes[0] for one in found.of(nothing)] == [taken]
    if taken == "searched anew":
        tilt.with_other_courses.assert_called_once_with(few, seed=found.seed)


@pytest.mark.parametrize(
    ("explains_worst", "brought", "taken"),
    [(True, 900.0, "radius begun anew"), (True, 50.0, "radius"), (True, None, "radius"), (False, None, "radius")],
    ids=["explains the worst video", "brings less", "has no world in common", "explains none"],
)
def test_a_cause_that_leaves_most_videos_lost_is_fitted_from_the_beginning(
    brought: float | None, taken: str, *, explains_worst: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, radius, anew = refit_with("", 0.0), refit_with("radius", 5.0), refit_with("radius begun anew", 9.0)
    nothing.choices, radius.fit = {}, Mock(fits=[""] * 4)
    radius.brought.return_value, anew.brought.return_value = 100.0, brought
    began = Mock(return_value=None if brought is None else anew)
    searched = Mock(return_value=[(("radius",), 80.0)] if explains_worst else [])
    monkeypatch.setattr(refits, "lost_videos", lambda fits: [2, 0, 1] if fits is radius.fit.fits else [])
    monkeypatch.setattr(refits, "explained", lambda fits: fits is not radius.fit.fits)
    monkeypatch.setattr(refits, "causes_of_lost_videos", searched)
    monkeypatch.setattr(Extensions, "from_the_beginning", lambda _self, *asked: began(*asked))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=[], beside_chance=[]))
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [radius])
    found = refits_with()
    assert found.with_lost_found(nothing, radius).causes == (taken,)
    assert [one.causes[0] for one in found.of(nothing)] == [taken]
    assert searched.call_args.args[1:3] == ([2], ("radius",))
    assert began.called == explains_worst


@pytest.mark.parametrize(
    ("lost", "explains_worst", "leaves"),
    [([2, 0], False, True), ([2, 0], True, False), ([2], False, False), ([], False, False)],
    ids=["explains none of several", "explains the worst", "a single video", "none"],
)
def test_a_cause_leaves_videos_unexplained_where_it_does_not_explain_the_worst_of_several_that_it_loses(
    lost: list[int], *, explains_worst: bool, leaves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, jitter = refit_with("", 0.0), refit_with("jitter", 5.0)
    nothing.choices, jitter.fit = {}, Mock(fits=[""] * 4)
    searched = Mock(return_value=[(("jitter",), 80.0)] if explains_worst else [])
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: lost)
    monkeypatch.setattr(refits, "loses_single_videos", lambda _fits: len(lost) == 1)
    monkeypatch.setattr(refits, "causes_of_lost_videos", searched)
    found = refits_with()
    assert found.leaves_unexplained(nothing, jitter) is leaves
    assert found.leaves_unexplained(nothing, jitter) is leaves
    assert searched.call_count == (len(lost) > 1)
    found._shown[nothing] = list(jitter.beyond(nothing))
    assert not found.leaves_unexplained(nothing, jitter)


@pytest.mark.parametrize(
    ("cause", "explain"), [(ExternalImpulse(), False), (ClockError(), True)], ids=["kicks", "jumps of the clock"]
)
def test_kicks_in_several_videos_explain_none_of_them_though_they_leave_nothing(
    cause: Effect, *, explain: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, found = refit_with("", 0.0), refit_with("", 90.0)
    found.causes, found.acting.return_value = (cause,), [0, 2]
    monkeypatch.setattr(refits, "gain", lambda trial, _base: (90.0 if trial is found else 0.0, 1.0))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    assert refits_with(needed=6.0).settled(nothing, [found]) is explain


def test_a_cause_with_which_no_joint_world_can_begin_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def impossible(*_given: object, **_named: object) -> None:
        raise ImpossibleStartError

    monkeypatch.setattr(extensions, "fit_together", impossible)
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: [0])
    monkeypatch.setattr(refits, "causes_of_lost_videos", lambda *_given, **_named: [((SurfaceTilt(),), 50.0)])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=()))
    trial = refit_with("", 0.0)
    trial.choices, trial.names, trial.fit = {}, (), Mock(fits=[], model=Mock(effects=()))
    assert refits_with()._lost(trial, []) == []


@pytest.mark.parametrize(
    ("brought", "second", "begun"),
    [(600.0, 384.0, 1), (600.0, 566.0, 2), (500.0, 384.0, 2), (None, 384.0, 2)],
    ids=["kept", "kept, and another promises as much", "not kept", "no world in common"],
)
def test_where_one_brings_what_it_promised_no_other_that_promised_less_is_fitted_from_the_beginning(
    brought: float | None, second: float, begun: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    slip, radius = refit_with("slip", 0.0), refit_with("radius", 0.0)
    slip.brought.return_value, radius.brought.return_value = brought, 400.0
    made = Mock(side_effect=[None if brought is None else slip, radius])
    told = [((SlipToRoll(),), 572.0), ((ContactRadiusError(),), second)]
    monkeypatch.setattr(Extensions, "from_the_beginning", lambda _self, *asked: made(*asked))
    monkeypatch.setattr(refits, "lost_videos", lambda _fit: [0])
    monkeypatch.setattr(refits, "causes_of_lost_videos", lambda *_given, **_named: told)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=()))
    trial = refit_with("", 0.0)
    trial.choices, trial.names, trial.fit = {}, (), Mock(fits=[], model=Mock(effects=()))
    expected = [radius] if brought is None else [slip, radius][:begun]
    assert refits_with(needed=6.0)._lost(trial, []) == expected
    assert made.call_count == begun


@pytest.mark.parametrize(("causes", "single"), [("", True), ("", False), ("tilt", False)])
def test_a_cause_that_is_missed_in_single_videos_or_beside_others_has_to_explain_them(
    causes: str, *, single: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a law that mends the course of one video a little is fitted to all of them from the beginning."""
    searched = Mock(return_value=[])
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: [0])
    monkeypatch.setattr(refits, "loses_single_videos", lambda _fits: single)
    monkeypatch.setattr(refits, "causes_of_lost_videos", searched)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=()))
    trial = refit_with(causes, 0.0)
    trial.causes, trial.choices, trial.names = tuple(filter(None, trial.causes)), {}, ()
    trial.fit = Mock(fits=[], model=Mock(effects=()))
    refits_with()._lost(trial, [])
    assert searched.call_args.kwargs["must_explain"] is (single or bool(causes))
