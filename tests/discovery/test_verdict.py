"""When the causes that were found are the verdict, and when something else is left."""

from dataclasses import replace
from importlib import import_module
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from tests.discovery.findings import TILT, WIND
from vrdp_prob.discovery import outcome, stages
from vrdp_prob.discovery.finding import Check, Verdict
from vrdp_prob.discovery.selection import tried
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.scene import Tracks

discover = import_module("vrdp_prob.discovery.discover")
TILTED_TABLE = SurfaceTilt()


def _checks(failing: int, p_value: float = 1e-9) -> list[Check]:
    passing = [Check(f"passing {k}", 1.0, 0.5, False, "") for k in range(20 - failing)]
    return [*(Check(f"failing {k}", 1.0, p_value, True, "") for k in range(failing)), *passing]


def _search(causes: tuple[str, ...]) -> Search:
    found = create_autospec(Search, instance=True)
    found.best, found.base = Mock(causes=causes), Mock(causes=())
    return found


@pytest.mark.parametrize(
    ("causes", "excess", "after", "verdict"),
    [
        ((), 3.0, _checks(5), Verdict.UNKNOWN),
        ((), 0.0, _checks(0), Verdict.NONE),
        (("tilt",), 0.1, _checks(0), Verdict.NAMED),
        (("tilt",), 0.1, _checks(2), Verdict.NAMED),
        (("kicks",), 0.1, _checks(9), Verdict.UNKNOWN),
        (("curl",), 0.1, _checks(5), Verdict.UNKNOWN),
        (("curl",), 0.1, _checks(4), Verdict.NAMED),
        (("tilt",), 2.0, _checks(2), Verdict.UNKNOWN),
        (("tilt",), 2.0, _checks(2, p_value=2e-3), Verdict.NAMED),
    ],
    ids=[
        "something and no cause",
        "nothing",
        "a cause that explains all",
        "a cause that leaves little",
        "causes with which most checks fail still",
        "a cause with which nearly half of the checks fail still",
        "a cause with which a third of them do",
        "a cause that leaves most of the residuals",
        "a cause with which what fails may be chance",
    ],
)
def test_the_verdict(
    causes: tuple[str, ...],
    excess: float,
    after: list[Check],
    verdict: Verdict,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = _search(causes)
    monkeypatch.setattr(outcome, "_loses_any", lambda _trial: False)
    monkeypatch.setattr(outcome, "_excess", lambda trial: excess if trial is found.best else 3.0)
    assert outcome._verdict(found, _checks(12), after) is verdict


@pytest.mark.parametrize(("large", "verdict"), [(True, Verdict.UNKNOWN), (False, Verdict.NONE)])
def test_a_model_that_does_not_explain_a_video_is_not_said_to_lack_nothing(*, large: bool, verdict: Verdict) -> None:
    """Though no check fails: they count as chance what it leaves."""
    found = _search(())
    found.base = create_autospec(Trial, instance=True)
    found.base.fit = Mock(fits=[Mock(misfit=Mock(large=one)) for one in (False, large)])
    assert outcome._verdict(found, _checks(12), _checks(0)) is verdict


@pytest.mark.parametrize(
    ("verdict", "causes", "explains", "better_by", "taken"),
    [
        (Verdict.UNKNOWN, (), True, "courses", "anew"),
        (Verdict.UNKNOWN, (), True, "spins", "anew"),
        (Verdict.UNKNOWN, (), True, "nothing", "before"),
        (Verdict.UNKNOWN, (), False, "courses", "before"),
        (Verdict.NONE, (), True, "courses", "before"),
    ],
    ids=[
        "better courses",
        "better spins",
        "nothing better",
        "most videos are lost",
        "nothing is left",
    ],
)
def test_all_videos_are_searched_anew_where_no_cause_explains_what_is_left(
    verdict: Verdict,
    causes: tuple[str, ...],
    better_by: str,
    taken: str,
    *,
    explains: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fit, better = create_autospec(SharedFit, instance=True), create_autospec(SharedFit, instance=True)
    fit.fits, fit.with_other_courses.return_value = (), better if better_by == "courses" else fit
    better.with_other_courses.return_value = better
    before = create_autospec(outcome.Outcome, instance=True)
    before.verdict, before.found = verdict, _search(causes)
    monkeypatch.setattr(stages, "explained", lambda _fits: explains)
    monkeypatch.setattr(stages, "with_other_spins", lambda _given, *, seed: better if better_by == "spins" else fit)
    found = stages.Stages(default_model(), (), 0, None)._with_better_courses(fit, before)
    assert found is {"anew": better, "before": fit}[taken]


@pytest.mark.parametrize(
    ("straying", "taken"), [([2], "anew"), ([], "before"), ([0, 1, 2], "before")], ids=["one", "none", "most"]
)
def test_beside_causes_the_few_videos_that_stray_are_searched_anew(
    straying: list[int], taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit, better = create_autospec(SharedFit, instance=True), create_autospec(SharedFit, instance=True)
    fit.fits, fit.with_other_courses.return_value = tuple(Mock(spec=MapFit) for _ in range(4)), better
    before = create_autospec(outcome.Outcome, instance=True)
    before.verdict, before.found = Verdict.UNKNOWN, _search(("tilt",))
    before.found.best.unexplained.videos = straying
    monkeypatch.setattr(stages, "explained", lambda _fits: True)
    found = stages.Stages(default_model(), (), 0, None)._with_better_courses(fit, before)
    assert found is {"anew": better, "before": fit}[taken]
    if taken == "anew":
        fit.with_other_courses.assert_called_once_with(seed=0, among=straying)


def test_a_search_that_begins_again_on_better_courses_begins_with_what_some_videos_have_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fit, better = (create_autospec(SharedFit, instance=True) for _ in range(2))
    beginning = create_autospec(Beginning, instance=True)
    asked = []
    monkeypatch.setattr(stages.Stages, "_fit", lambda *_given: fit)
    believed = create_autospec(outcome.Outcome, instance=True)
    monkeypatch.setattr(stages.Stages, "_search", lambda _self, *given: asked.append(given))
    monkeypatch.setattr(stages.Stages, "_believed", lambda *_given: believed)
    monkeypatch.setattr(stages.Stages, "_with_better_courses", lambda *_given: better)
    causes = (TILTED_TABLE,)
    told = stages.Asked(causes, 3, 62, beginning)
    stages.Stages(default_model(), (TILTED_TABLE, Wind()), 0, None).outcome([], told)
    assert asked == [(fit, causes, beginning), (better, causes, beginning)]


@pytest.mark.parametrize("finds_better", [True, False])
def test_what_some_videos_call_for_is_no_question_of_doubts(
    *, finds_better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where nothing is found the videos are searched anew, and what is found then is asked of all, doubted or not."""
    fit, better = (create_autospec(SharedFit, instance=True) for _ in range(2))
    nothing, tilted = _search(()), _search(())
    tilted.best = Mock(causes=(TILTED_TABLE,), cause_names=frozenset({TILTED_TABLE.cause_name()}))
    nothing.best.cause_names = frozenset()
    believed = create_autospec(outcome.Outcome, instance=True)
    for one in (nothing, tilted):
        one.near = ()
    monkeypatch.setattr(stages.Stages, "_fit", lambda *_given: fit)
    monkeypatch.setattr(stages, "search", lambda given, *_given, **_named: {fit: nothing, better: tilted}[given])
    monkeypatch.setattr(stages, "outcome_of", lambda given, **_named: {nothing: believed}[given])
    monkeypatch.setattr(stages.Stages, "_with_better_courses", lambda *_given: better if finds_better else fit)
    monkeypatch.setattr(stages, "tried_causes", lambda *_given, **_named: ())
    monkeypatch.setattr(stages, "_beginning", lambda _found: None)
    asked = stages.Stages(default_model(), (TILTED_TABLE, Wind()), 0, None).asked_of_all(
        [Mock(spec=Tracks)] * 4, searched=3
    )
    assert asked.causes == ((TILTED_TABLE,) if finds_better else ())


def test_a_cause_that_may_take_the_place_of_several_is_told_once() -> None:
    other, rival = replace(WIND, named=False, probability=0.07), replace(WIND, named=False, probability=0.12)
    assert outcome._in_order([TILT, other, rival]) == [TILT, rival]
    assert outcome._in_order([TILT, replace(TILT, named=False, probability=1.0)]) == [TILT]


def test_causes_stand_named_ones_first_and_by_probability_doubted_ones_among_the_others() -> None:
    rival, doubted = (replace(WIND, name=name, named=False) for name in ("rival", "doubted"))
    rival, doubted = replace(rival, probability=0.1), replace(doubted, probability=0.6)
    sure, less = replace(TILT, name="sure", probability=0.99), replace(TILT, probability=0.85)
    assert outcome._in_order([less, sure, rival, doubted]) == [sure, less, doubted, rival]


@pytest.mark.parametrize(
    ("gain", "patches", "why"),
    [
        ((2.0, 1.0), False, "it gains too little"),
        ((30.0, 40.0), False, "too few videos speak for it"),
        ((90.0, 1.0), True, "it mends videos and explains none of them"),
    ],
)
def test_what_was_tried_is_told_with_what_it_would_have_needed(
    gain: tuple[float, float], why: str, *, patches: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = _search(())
    trials = [create_autospec(Trial, instance=True) for _ in range(3)]
    for trial, name in zip(trials, ("drag", "drag", "named before"), strict=True):
        trial.causes = (Mock(spec=Effect),)
        trial.causes[0].name = trial.causes[0].cause_name.return_value = name
        trial.causes[0].way.return_value = None
        trial.beyond.return_value = trial.causes
        trial.patches.return_value = patches
    found.refits, found.needed, found.overdispersion = Mock(made=lambda _trial: trials), 6.0, np.ones(3)
    monkeypatch.setattr(tried, "gain", lambda *_given: gain)
    monkeypatch.setattr(tried, "weights", lambda *_given, **_named: np.array([0.5, 0.5]))
    (one,) = tried.tried_causes(found, ["named before"], seed=0)
    assert (one.name, one.gain, one.gain_se, one.gain_needed, one.why) == ("drag", *gain, 6.0, why)
