"""What speaks against a cause that was found."""

from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from tests.discovery.fitted import SMALL, fitted
from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.discovery import discover as module
from vrdp_prob.discovery import outcome
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.contacts import REBOUND_AT_WALLS, RUBBING, RUBBING_AT_WALLS
from vrdp_prob.discovery.checks.kicks import KICK
from vrdp_prob.discovery.describe import describe
from vrdp_prob.discovery.finding import Check, Verdict
from vrdp_prob.discovery.residuals.contact_patterns import AT_WALLS
from vrdp_prob.discovery.selection import doubts as doubts_module
from vrdp_prob.discovery.selection import leavings as leavings_module
from vrdp_prob.discovery.selection.doubts import (
    OWN_CHECKS,
    TURNED_ONCE,
    Doubt,
    Without,
    causes_with_own_check_failing,
    details_left,
    doubts,
    unasked_turns,
    with_doubts,
)
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.discovery.words import title
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import SecondHiddenObstacle
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.speed_dependent_restitution import SpeedDependentRestitution
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.model_file import known_effects


@pytest.fixture(scope="module")
def trial() -> Trial:
    return Trial((), fitted("surface_tilt", 5.0, seed=2, setting=SMALL)[1])


def left(name: str, p_value: float) -> list[Check]:
    return [Check(name, 1.0, p_value, False, "")]


@pytest.mark.parametrize(
    ("cause", "checks"),
    [
        (SpeedDependentRestitution(), []),
        (SpeedDependentRestitution(), left(REBOUND, 0.02)),
        (SpeedDependentRestitution(), left("push against place", 1e-9)),
        (SurfaceTilt(), left(REBOUND, 1e-9)),
    ],
)
def test_nothing_speaks_against_a_cause_that_leaves_nothing_of_its_own(
    trial: Trial, cause: Effect, checks: list[Check]
) -> None:
    assert list(doubts(trial, cause, checks)) == []


def test_what_is_left_of_the_very_thing_that_a_cause_does_speaks_against_it(trial: Trial) -> None:
    (doubt,) = doubts(trial, SpeedDependentRestitution(), left(REBOUND, 5e-4))
    assert doubt.credible == pytest.approx(0.05)
    assert REBOUND in doubt.sentence


def test_of_several_checks_of_a_cause_the_worst_counts_as_often_as_there_are_some(trial: Trial) -> None:
    (doubt,) = doubts(trial, SpeedDependentRestitution(), [*left(REBOUND, 0.5), *left(REBOUND_AT_WALLS, 5e-4)])
    assert doubt.credible == pytest.approx(0.1)
    assert REBOUND_AT_WALLS in doubt.sentence
    assert not list(doubts(trial, SpeedDependentRestitution(), [*left(REBOUND, 0.5), *left(REBOUND_AT_WALLS, 6e-3)]))


def test_a_kick_that_leaves_sudden_changes_is_not_the_only_one_or_none(trial: Trial) -> None:
    (doubt,) = doubts(trial, ExternalImpulse(), left(KICK, 1e-4))
    assert doubt.credible == pytest.approx(0.01)
    assert "or it happened more often than was found" in doubt.sentence


@pytest.mark.parametrize(
    ("cause", "before", "after", "is_doubted"),
    [
        (ContactFriction(), {RUBBING: 1e-97}, {RUBBING: 2e-4}, False),
        (ContactFriction(), {RUBBING: 1e-20}, {RUBBING: 2e-4}, True),
        (ContactFriction(), {}, {RUBBING: 2e-4}, True),
        (ContactFriction(), {RUBBING: 0.0}, {RUBBING: 0.0}, True),
        (
            ContactFriction(),
            {RUBBING: 1e-97, RUBBING_AT_WALLS: 1e-6},
            {RUBBING: 2e-4, RUBBING_AT_WALLS: 1e-6},
            True,
        ),
        (ContactFriction(), {RUBBING: 1e-97, RUBBING_AT_WALLS: 0.3}, {RUBBING: 2e-4, RUBBING_AT_WALLS: 0.3}, False),
        (ExternalImpulse(), {KICK: 1e-97}, {KICK: 2e-4}, True),
    ],
    ids=["nearly all", "a good part", "nothing before", "as before", "not at walls", "none at walls", "another kick"],
)
def test_what_is_left_of_what_a_cause_nearly_explains_is_details_of_its_law(
    trial: Trial, cause: Effect, before: dict[str, float], after: dict[str, float], *, is_doubted: bool
) -> None:
    """A strength that differs from body to body, say; but what happens once may have happened again."""
    found, without = ([one for pair in some.items() for one in left(*pair)] for some in (after, before))
    assert bool(list(doubts(trial, cause, found, without=lambda: Without(without)))) is is_doubted
    assert len(list(details_left([cause], found))) == 1


def test_a_cause_is_doubted_that_acts_the_other_way_about_than_its_law(
    trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A restitution that grows with the speed stands for contacts that stick where they are slow, say."""
    monkeypatch.setattr(doubts_module, "has_sign_of_law", lambda *_given: 0.004)
    (doubt,) = doubts(trial, SpeedDependentRestitution())
    assert doubt.credible == pytest.approx(0.4)
    assert "the sign that its law does not have" in doubt.sentence


def test_what_a_cause_takes_away_is_weighed_where_both_p_values_are_below_any_number(trial: Trial) -> None:
    """As of many videos, where even details of a law are beyond doubt."""
    without, details = (Check(RUBBING, 1.0, 0.0, False, "", log_p_value=nats) for nats in (-50_000.0, -2_000.0))
    assert not list(doubts(trial, ContactFriction(), [details], without=lambda: Without([without])))
    assert list(doubts(trial, ContactFriction(), [without], without=lambda: Without([details])))


def test_what_a_cause_takes_away_is_weighed_in_units_of_one_noise(trial: Trial) -> None:
    """Without a cause that moves bodies by ten times the noise, a fit believes in as much more noise."""
    without, details = (Check(RUBBING, 1.0, 0.0, False, "", log_p_value=nats) for nats in (-600.0, -200.0))
    assert list(doubts(trial, ContactFriction(), [details], without=lambda: Without([without])))
    assert not list(doubts(trial, ContactFriction(), [details], without=lambda: Without([without], noise=0.1)))


def test_a_test_of_scatter_tells_the_same_whatever_the_noise(trial: Trial) -> None:
    before, after = left(REBOUND, 1e-10), left(REBOUND, 1e-3)
    cause = SpeedDependentRestitution()
    assert list(doubts(trial, cause, after, without=lambda: Without(before, noise=0.1)))


@pytest.mark.parametrize("cause", [Wall(), SecondHiddenObstacle(), ExternalImpulse()])
def test_what_turns_one_body_once_may_be_what_nobody_asked_for(cause: Effect) -> None:
    trial = create_autospec(Trial, instance=True, causes=(SurfaceTilt(), cause))
    asked = {cause.cause_name(), "surface_tilt"}
    trial.turns.return_value = 1
    (sentence,) = unasked_turns(trial, asked)
    others = {title(name) for name in known_effects() if name in TURNED_ONCE and name != cause.cause_name()}
    assert all(f"'{other}'" in sentence for other in others)
    assert not list(unasked_turns(trial, {*asked, *TURNED_ONCE}))
    trial.turns.return_value = 2
    assert not list(unasked_turns(trial, asked))


def test_a_cause_whose_own_checks_are_mended_leaves_no_details() -> None:
    assert not list(details_left([ContactFriction(), SurfaceTilt()], [*left(RUBBING, 0.2), *left("push", 1e-9)]))


def test_own_checks_are_asked_of_the_model_without_the_very_cause_fitted_to_its_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[list[Check]] = []
    checks = {RUBBING: left(RUBBING, 1e-97), KICK: left(KICK, 1e-97)}

    def model(left_of_it: list[Check]) -> Mock:
        return create_autospec(Trial, instance=True, noise=1.0, unexplained=None, fit=Mock(left=left_of_it, fits=()))

    def lesser(name: str) -> Mock:
        one = create_autospec(Trial, instance=True)
        one.continued.return_value = model(checks[name])
        return one

    def made(fit: Mock, *, seed: int) -> tuple[Check, ...]:
        assert seed == 0
        asked.append(fit.left)
        return tuple(fit.left)

    friction, kick = ContactFriction(), ExternalImpulse()
    best = model([*left(RUBBING, 2e-4), *left(KICK, 2e-4)])
    best.causes = (friction, kick)
    found = create_autospec(Search, instance=True, best=best, lesser=(lesser(RUBBING), lesser(KICK)))
    found.refits = Mock(leavings=Leavings((), 0))
    monkeypatch.setattr(leavings_module, "run_checks", made)
    monkeypatch.setattr(leavings_module, "trusted", lambda fits: np.ones(len(fits), dtype=bool))
    for asked_of_parameters in ("surprise", "has_sign_of_law"):
        monkeypatch.setattr(doubts_module, asked_of_parameters, lambda *_given: 1.0)
    for _ in range(2):  # asked again, the fit is not made again
        assert list(outcome._doubted(found)) == [kick]
    assert asked == [best.fit.left, checks[RUBBING]]
    found.lesser[0].continued.assert_called_once_with()


def test_checks_and_causes_go_by_their_names(trial: Trial) -> None:
    names = {one.name for one in run_checks(trial.fit, seed=0)}
    assert known_effects().keys() >= OWN_CHECKS.keys()
    own = {name for some in OWN_CHECKS.values() for name in some}
    assert names >= {name for name in own if "friction of the bodies" not in name and AT_WALLS not in name}


def test_what_is_left_without_a_cause_may_clear_it(trial: Trial) -> None:
    """A fit without it that has lost its videos sees p = 1e-20; one that has found them sees what it is worth."""
    best, rough, well = trial, *(create_autospec(Trial, instance=True, noise=1.0) for _ in range(2))
    checks = {best: left(RUBBING, 7e-4), rough: left(RUBBING, 1e-20), well: left(RUBBING, 1e-50)}
    found = create_autospec(Search, instance=True, best=best, refits=Mock())
    found.refits.leavings.own = lambda model, _cause: checks[model]
    found.refits.leavings.at_the_end = lambda model: model
    assert list(doubts(trial, ContactFriction(), checks[best], without=lambda: Without(checks[rough])))
    assert outcome._leaving_details(found, [ContactFriction()], well) == [ContactFriction()]
    assert outcome._leaving_details(found, [ContactFriction()], rough) == []


@pytest.mark.slow
def test_a_doubted_cause_is_told_of_and_not_part_of_the_extended_model(monkeypatch: pytest.MonkeyPatch) -> None:
    data, _ = fitted("surface_tilt", 5.0, seed=2, setting=SMALL)
    described: list[SharedFit] = []
    monkeypatch.setattr(module, "describe", lambda fit, checks: described.append(fit) or describe(fit, checks))
    monkeypatch.setattr(outcome, "doubts", lambda *_given, **_without: [Doubt(0.1, "It is something else.")])
    finding = module.discover(data.tracks, catalogue=[SurfaceTilt()], processes=1)
    assert finding.verdict is Verdict.UNKNOWN
    assert finding.named == ()
    assert finding.extended.effects == finding.model.effects
    assert finding.checks_after == finding.checks
    (tilt,) = finding.causes
    assert tilt.name == SurfaceTilt.name
    assert tilt.probability < 0.11
    assert "It is something else." in finding.notes
    assert [fit.model.effects for fit in described] == [finding.model.effects]


@pytest.mark.slow
def test_of_two_causes_only_the_doubted_one_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    data = hide(["surface_tilt", "linear_drag"], seed=1, effect_size=6.0, setting=Setting(videos=4, bodies=2))

    def only_the_tilt(_trial: Trial, cause: Effect, _left: object = (), **_without: object) -> list[Doubt]:
        return [Doubt(0.1, "It is something else.")] if cause.name == SurfaceTilt.name else []

    monkeypatch.setattr(outcome, "doubts", only_the_tilt)
    # Where a tilt of this strength is left out, a law of no particular cause explains the drag, too (test_mimics.py).
    monkeypatch.setattr(outcome, "laws_of", lambda _checks: ())
    finding = module.discover(data.tracks, catalogue=[SurfaceTilt(), LinearDrag()], processes=1)
    assert finding.verdict is Verdict.UNKNOWN
    assert [one.name for one in finding.named] == [LinearDrag.name]
    assert [effect.name for effect in finding.extended.effects][-1] == LinearDrag.name
    assert SurfaceTilt.name not in finding.extended.text
    assert finding.upper_bounds == ()
    assert finding.notes.count("It is something else.") == 1


@pytest.mark.parametrize(
    ("doubted", "probabilities"),
    [({}, (0.6, 0.1, 0.3)), ({2: 0.1}, (0.6 / 0.73, 0.1 / 0.73, 0.03 / 0.73)), ({0: 0.1, 2: 0.1}, (0.06, 0.1, 0.03))],
    ids=["nothing is doubted", "a rival is doubted", "the best model and a rival are doubted"],
)
def test_what_a_doubted_rival_loses_the_others_have(
    doubted: dict[int, float], probabilities: tuple[float, ...]
) -> None:
    reasons = {number: [Doubt(credible, "")] for number, credible in doubted.items()}
    assert with_doubts(np.array([0.6, 0.1, 0.3]), reasons) == pytest.approx(probabilities)


def test_causes_whose_own_checks_fail() -> None:
    checks = [
        Check("friction of the bodies against mass", 0.07, 1e-9, True, ""),
        Check("friction of the bodies against material", 0.0, 0.5, False, ""),
        Check("acceleration along the velocity against speed", 3.0, 1e-9, True, ""),
    ]
    assert causes_with_own_check_failing(checks) == {"mass_dependent_friction"}
