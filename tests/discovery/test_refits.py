"""Which causes are tried on a model, and in which order."""

from unittest.mock import Mock

import numpy as np
import pytest

from tests.discovery.stand_ins import refit_with, refits_with, without_tracks
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection import extensions, leavings, refits
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


@pytest.fixture(autouse=True)
def tracks_show_no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    without_tracks(monkeypatch)


@pytest.mark.parametrize(
    ("least", "lacking", "name"),
    [(2.0, 200.0, "tilt"), (70.0, 200.0, None), (2.0, 400.0, None)],
    ids=["enough", "too little", "a trifle of what lacks"],
)
def test_the_first_of_two_is_what_brings_most_but_for_kicks_where_all_else_is_noise(
    least: float, lacking: float, name: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, drag, kicks = (
        refit_with(*one) for one in (("", 0.0), ("tilt", -1.0), ("drag", 0.5), ("kicks", 0.2))
    )
    for one, brought in ((nothing, 0.0), (tilt, 60.0), (drag, 20.0), (kicks, 90.0)):
        one.brought.return_value = brought
    nothing.lacking = lacking
    monkeypatch.setattr(extensions, "mends_any_course", lambda cause: cause == "kicks")
    monkeypatch.setattr(refits, "happens_once", lambda cause: cause == "kicks")
    found = refits_with(needed=least).provisional(nothing, [drag, kicks, tilt])
    assert found is (tilt if name else None)


@pytest.mark.parametrize(("brought", "taken"), [(95.0, "drag"), (60.0, "lost frames")], ids=["nearly as much", "less"])
def test_a_law_that_brings_nearly_as_much_as_lost_frames_comes_before_these(
    brought: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames are held where they seem to be lost for want of a law."""
    nothing, drag, frames = (refit_with(*one) for one in (("", 0.0), ("drag", 0.5), ("lost frames", 1.0)))
    nothing.lacking, drag.brought.return_value, frames.brought.return_value = 50.0, brought, 100.0
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(refits, "happens_once", lambda cause: cause == "lost frames")
    found = refits_with(needed=2.0).provisional(nothing, [drag, frames])
    assert found is not None
    assert found.causes == (taken,)


@pytest.mark.parametrize(("loses_most", "taken"), [(True, "drag"), (False, "tilt")])
def test_a_law_is_none_to_go_on_from_that_loses_most_videos_which_were_explained(
    loses_most: bool, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, tilt, drag = (refit_with(*one) for one in (("", 0.0), ("tilt", 1.0), ("drag", 0.5)))
    for one, brought in ((nothing, 0.0), (tilt, 60.0), (drag, 20.0)):
        one.brought.return_value, one.lacking = brought, 50.0
    tilt.loses_most_of.return_value = loses_most
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(refits, "happens_once", lambda _cause: False)
    found = refits_with(needed=2.0).provisional(nothing, [drag, tilt])
    assert found is not None
    assert found.causes == (taken,)


@pytest.mark.parametrize(
    ("turns", "doubted", "alone"),
    [(6, False, True), (2, False, False), (6, True, False)],
    ids=["plain", "of few turns", "doubted"],
)
def test_where_walls_that_tracks_show_are_plain_nothing_else_is_tried(
    turns: int, *, doubted: bool, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, walls, drag = refit_with("", 0.0), refit_with("wall+second_wall", 20.0), refit_with("drag", 5.0)
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [Mock(seen=Mock(turns=turns))])
    monkeypatch.setattr(Extensions, "with_surfaces", lambda _self, _trial, _placed: walls)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=[]))
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: doubted)
    assert refits_with(needed=6.0).of(plain) == ([walls] if alone else [walls, drag])


@pytest.mark.parametrize(
    ("lost", "still_lost", "leaves_nothing", "is_enough"),
    [([], [], True, True), ([1], [], False, True), ([1], [1], False, False), ([], [], False, False)],
    ids=["leaves nothing", "finds lost videos", "does not", "none was lost"],
)
def test_beside_a_disc_that_tracks_show_and_that_does_what_no_law_does_only_what_else_was_met_is_tried(
    lost: list[int], still_lost: list[int], *, leaves_nothing: bool, is_enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing, disc, kicked, wall, drag = (
        refit_with(*one) for one in (("", 0.0), ("disc", 20.0), ("kicks", 9.0), ("wall", 8.0), ("drag", 5.0))
    )
    kicks = Mock(spec=CauseScore, effect=ExternalImpulse(), sites=["somewhere"])
    nothing.fit.fits, disc.fit.fits = lost, still_lost
    monkeypatch.setattr(refits, "lost_videos", lambda fits: fits)
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [Mock(seen=Mock(turns=2))])
    monkeypatch.setattr(Extensions, "with_surfaces", lambda _self, _trial, _placed: disc)
    monkeypatch.setattr(Extensions, "made_of", lambda _self, _trial, scores: [kicked] if scores == [kicks] else [])
    monkeypatch.setattr(refits.Refits, "_hidden", lambda _self, _trial, _found, _kicks: [wall])
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [drag])
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, found: leaves_nothing and found == [disc])
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=[kicks]))
    assert refits_with(needed=6.0).of(nothing) == ([disc, kicked, wall] if is_enough else [disc, drag])


@pytest.mark.parametrize(("turns", "on"), [(6, True), (2, False)], ids=["plain", "of few turns"])
def test_walls_that_tracks_show_plainly_are_gone_on_from_whatever_they_leave(
    turns: int, *, on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a slope a floor explains little by itself."""
    nothing, floor = refit_with("", 0.0), refit_with("wall", 20.0)
    nothing.lacking, floor.brought.return_value = 5000.0, 400.0
    shown = Mock(seen=Mock(turns=turns), effect="wall")
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [shown])
    monkeypatch.setattr(Extensions, "with_surfaces", lambda _self, _trial, _placed: floor)
    monkeypatch.setattr(refits.Refits, "_new", lambda _self, _trial: [])
    monkeypatch.setattr(refits.Refits, "doubted", lambda *_given: True)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Mock(scores=[]))
    monkeypatch.setattr(extensions, "mends_any_course", lambda _cause: False)
    monkeypatch.setattr(refits, "happens_once", lambda _cause: False)
    made = refits_with(needed=6.0)
    assert made.provisional(nothing, made.of(nothing)) is (floor if on else None)


@pytest.mark.parametrize(
    ("astray", "outweighing", "is_asked", "settles"),
    [
        ([2], True, True, False),
        ([2], True, True, True),
        ([0, 3], True, True, False),
        ([2], False, False, False),
        ([], True, False, False),
        ([0, 1, 2], True, False, False),
    ],
    ids=["one video", "which that explains", "half of them", "one that leaves less than all others", "none", "most"],
)
def test_what_most_videos_ask_for_comes_first_where_few_have_gone_astray(
    astray: list[int], *, outweighing: bool, is_asked: bool, settles: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial, lens, anew, bowl = (
        refit_with("", 0.0),
        refit_with("lens", 1.0),
        refit_with("lens", 500.0),
        refit_with("bowl", 0.5),
    )
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
    left = Left((kicks,), (kicks, wide, clear, faint), np.ones(4))
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
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: left)
    monkeypatch.setattr(Extensions, "made_of", made_of)
    monkeypatch.setattr(Courses, "searched_anew", searched_anew)
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, _found: settles)
    found = refits_with()
    if is_asked:
        assert found._new(trial) == [anew, bowl]
        assert made == ([[wide, clear]] if settles else [[wide, clear], [faint]])
    else:
        assert found._asked_by_most(trial) == made == []


@pytest.mark.parametrize(
    ("before", "p_value", "lost", "is_tried"),
    [(("tilt",), 0.02, [], False), (("tilt",), 1e-4, [], True), (("tilt",), 0.02, [1], True), ((), 0.02, [], True)],
    ids=["chance makes as much", "chance does not", "chance stands for a lost video", "no cause is there yet"],
)
def test_beside_a_cause_none_is_tried_where_no_score_stands_out_from_chance(
    before: tuple[str, ...], p_value: float, lost: list[int], *, is_tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = refit_with("", 0.0)
    trial.causes = before
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: lost)
    clear, beside = (Mock(spec=CauseScore, effect=Bowl(), size=30.0, p_value=one, sites=()) for one in (1e-9, p_value))
    tried: list[list[CauseScore]] = []
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((clear,), (beside,), np.ones(3)))
    monkeypatch.setattr(refits, "causes_with_own_check_failing", lambda _checks: set())
    monkeypatch.setattr(Leavings, "checks", lambda _self, _trial: ())
    monkeypatch.setattr(Extensions, "made_of", lambda _self, _trial, asked, **_beside: tried.append(asked) or [])
    assert refits_with(needed=6.0)._new(trial) == []
    assert ([clear] in tried) is is_tried


@pytest.mark.parametrize(
    ("before", "cause", "brought", "is_tried"),
    [
        ((), Bowl(), 1.0, True),
        ((), Bowl(), 9.0, False),
        ((), ExternalImpulse(), 9.0, True),
        (("tilt",), Bowl(), 1.0, True),
    ],
    ids=["nothing brings enough", "something does", "kicks do", "there is a cause already"],
)
def test_a_cause_whose_own_check_fails_is_tried_where_no_law_brings_enough(
    before: tuple[str, ...], cause: Effect, brought: float, *, is_tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial, other = refit_with("nothing", 0.0), refit_with("other", 1.0)
    trial.causes, other.causes = before, (cause,)
    other.brought.return_value = brought
    clear, faint = (
        Mock(spec=CauseScore, effect=effect, size=size, p_value=p_value, sites=())
        for effect, size, p_value in ((cause, 50.0, 1e-9), (MassDependentFriction(), 4.0, 0.04))
    )
    scores = (clear, faint)
    made: list[list[str]] = []

    def made_of(_self: object, _trial: Trial, asked: list[CauseScore], **_beside: object) -> list[Trial]:
        made.append([one.effect.name for one in asked])
        return [other] if made[-1] == [cause.name] else []

    failing = Check("friction of the bodies against mass", 0.07, 1e-9, True, "")
    monkeypatch.setattr(leavings, "run_checks", lambda _fit, *, seed: (failing,))
    monkeypatch.setattr(Extensions, "made_of", made_of)
    monkeypatch.setattr(refits.Refits, "settled", lambda _self, _trial, _found: True)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left(scores, scores, np.ones(3)))
    assert refits_with(needed=6.0).of(trial) == [other]
    assert (["mass_dependent_friction"] in made) is is_tried


@pytest.mark.parametrize(
    ("cause", "check", "is_tried"),
    [
        (MassDependentFriction(), "friction of the bodies against mass", True),
        (MassDependentFriction(), "friction of the bodies against material", False),
        (LensDistortion(), "distortion of positions", False),
    ],
    ids=["its check fails", "another one does", "residuals would show it"],
)
def test_beside_a_cause_one_is_tried_that_residuals_hardly_show_where_its_own_check_fails(
    cause: Effect, check: str, *, is_tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial, other = refit_with("tilt", 0.0), refit_with("tilt", 20.0)
    trial.causes, other.causes = (SurfaceTilt(),), (SurfaceTilt(), cause)
    faint = Mock(spec=CauseScore, effect=cause, size=4.0, p_value=0.5, sites=())
    failing = Check(check, 0.07, 1e-9, True, "")
    monkeypatch.setattr(refits, "lost_videos", lambda _fits: [])
    monkeypatch.setattr(leavings, "run_checks", lambda _fit, *, seed: (failing,))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((faint,), (faint,), np.ones(3)))
    monkeypatch.setattr(Extensions, "made_of", lambda _self, _trial, asked, **_beside: [other] if asked else [])
    assert refits_with(needed=6.0)._new(trial) == ([other] if is_tried else [])


@pytest.mark.parametrize(
    ("may_vanish", "is_doubted"),
    [((False,), False), ((True,), True), ((True, False), False), ((True, True), True)],
    ids=["there", "perhaps nothing", "one of two perhaps nothing", "both perhaps nothing"],
)
def test_what_may_as_well_be_nothing_is_not_established(may_vanish: tuple[bool, ...], is_doubted: bool) -> None:
    names = ["tilt", "drag"][: len(may_vanish)]
    nothing, found = refit_with("", 0.0), refit_with("+".join(names), 10.0)
    nothing.causes = ()
    found.may_vanish.side_effect = lambda cause, _divisor: may_vanish[names.index(cause)]
    assert refits_with(needed=2.0).doubted(found, nothing, np.ones(3)) is is_doubted
