"""What the checks say of videos with and without a hidden effect."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from tests.discovery.fitted import fitted
from tests.discovery.hidden import hide
from tests.discovery.measurement import Measurement
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.checks import kicks
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.checks.bodies import friction_against
from vrdp_prob.discovery.checks.flight import QUESTIONS
from vrdp_prob.discovery.checks.measurement import GENERAL
from vrdp_prob.discovery.checks.own_values import BodyFrictions, OwnValues, Rebounds
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FRICTION, FreeFlight
from vrdp_prob.discovery.residuals.free_flight_patterns import patterns, spanned
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.trials import Trial, with_own_population
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.inference.several_videos.population import own_parameters
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.parameters import RESTITUTION
from vrdp_prob.scene import Body, Shape, Tracks

LARGER = Setting(videos=4, bodies=4)
PAIRS = Setting(videos=3, bodies=2, frames=60)
VORTEX = "push against place", "acceleration across the velocity against speed"
WELL_FITTED = 1.5
"""Largest chi-square per number at which a fit counts as one that found its maximum."""


def by_name(checks: tuple[Check, ...]) -> Mapping[str, Check]:
    return {check.name: check for check in checks}


def leading(checks: tuple[Check, ...], count: int = 1) -> list[str]:
    """Names of the most significant checks of those that say what is wrong."""
    return [check.name for check in checks if check.significant and check.name not in GENERAL][:count]


def test_a_null_leaves_nothing_significant() -> None:
    _, fit = fitted(seed=1)
    checks = run_checks(fit, seed=0)
    assert not [check for check in checks if check.significant]
    assert len(checks) >= 18
    assert len(by_name(checks)) == len(checks)
    assert [check.p_value for check in checks] == sorted(check.p_value for check in checks)
    assert all(np.isfinite([check.p_value, check.statistic]).all() for check in checks)


@pytest.mark.parametrize("resistance", [0.0, pytest.param(0.02, marks=pytest.mark.slow)])
def test_a_table_that_hardly_brakes_is_no_misfit(resistance: float) -> None:
    """Friction and drag are far from what is believed of them beforehand, which is no error of the model."""
    _, fit = fitted(seed=1, setting=Setting(videos=6, bodies=1, frames=40, resistance=resistance))
    assert min(check.p_value for check in run_checks(fit, seed=0)) > 0.001


def test_the_same_seed_gives_the_same_checks() -> None:
    _, fit = fitted(seed=1)
    assert run_checks(fit, seed=3) == run_checks(fit, seed=3)


def noise_in_place(model: ResidualModel, generator: np.random.Generator) -> ResidualModel:
    """Pure noise in the place of what was measured, and of what is believed beforehand."""
    videos = tuple(
        replace(video, linear=replace(video.linear, residuals=video.drawn(1, generator)[:, 0]))
        for video in model.videos
    )
    values, vectors = np.linalg.eigh(model.linear.prior)
    pull = vectors @ (np.sqrt(np.maximum(values, 0)) * generator.standard_normal(len(values)))
    linear = replace(model.linear, videos=tuple(video.linear for video in videos), prior_gradient=pull)
    return ResidualModel(linear, videos)


def test_p_values_of_free_flight_are_uniform_under_the_fitted_model() -> None:
    _, fit = fitted(seed=1)
    generator = np.random.default_rng(0)
    names = [(question.names, question.given) for question in QUESTIONS]
    found: list[list[float]] = []
    model = ResidualModel.of(fit)
    for _ in range(40):
        flight = FreeFlight.of(noise_in_place(model, generator))
        parts = [flight.part(*one) for one in names]
        found.append([part.score.p_value for part in parts if part.score.degrees])
    assert all(kstest(column, "uniform").pvalue > 1e-3 for column in np.array(found).T)


def test_a_tilt_is_a_push_in_one_direction_of_its_size() -> None:
    data, fit = fitted("surface_tilt", seed=2, setting=PAIRS)
    checks = run_checks(fit, seed=0)
    assert leading(checks) == ["push in one direction"]
    found = by_name(checks)["push in one direction"]
    assert found.statistic == pytest.approx(9.81 * data.truth.causes[0].strength, rel=0.15)
    assert "the same everywhere" in found.sentence
    assert found.p_value < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("way", "size", "names"),
    [
        ("linear_drag", 4.0, ("acceleration along the velocity against speed",)),
        ("cubic_drag", 4.0, ("acceleration along the velocity against speed",)),
        ("grain", 4.0, ("acceleration along the velocity against the direction of motion",)),
        ("shaking", 4.0, ("push against time",)),
        ("placed_field", 4.0, ("acceleration across the velocity against place",)),
        ("pair_force", 4.0, ("acceleration against the distance to other bodies",)),
        ("vortex", 2.0, VORTEX),
        ("vortex", 4.0, VORTEX),
        ("contact_friction", 4.0, ("tangential against normal impulse",)),
        ("clock_error", 4.0, ("time stamps: lost frames",)),
    ],
)
def test_the_check_of_the_effect_is_among_those_that_lead(way: str, size: float, names: tuple[str, ...]) -> None:
    _, fit = fitted(way, size, seed=5, setting=LARGER)
    assert set(names) & set(leading(run_checks(fit, seed=0), 3))


def test_nothing_is_said_of_an_axis_across_which_bodies_hardly_move() -> None:
    along = np.linspace(0.0, 1.0, 50)
    assert spanned(np.stack([along, 1e-3 * along], axis=1)) == (0,)
    assert spanned(np.stack([along, 0.1 * along], axis=1)) == (0, 1)
    flight = FreeFlight.of(ResidualModel.of(fitted(seed=1)[1]))
    names = {one.name for one in patterns(replace(flight.scales, axes=(0,)))}
    assert {"push x x", "push y x", "along x", "along distance", "across speed x"} < names
    assert names.isdisjoint({"push x y", "push y y", "along y", "across speed y"})
    (distance,) = (one for one in patterns(replace(flight.scales, axes=(0,))) if one.name == "along distance")
    assert "y" not in distance.formula


@pytest.mark.parametrize("bodies", [1, 2])
def test_nothing_is_asked_of_masses_where_collisions_tell_none(bodies: int) -> None:
    times = np.arange(40) / 25
    places = np.arange(bodies)[None, :, None] * np.array([0.0, 1.0]) + times[:, None, None] * np.array([0.5, 0.0])
    noise = np.random.default_rng(0).normal(0, 0.002, (3, *places.shape))
    shapes = tuple(Body(str(k), Shape.CYLINDER, radius=0.1) for k in range(bodies))
    videos = [Tracks.from_arrays(f"v{k}", shapes, times, places + noise[k]) for k in range(3)]
    fit = fit_together(videos, model=default_model(), model_error=False)
    assert "friction of the bodies against mass" not in by_name(run_checks(fit, seed=0))


@pytest.mark.slow
def test_friction_that_goes_with_masses_that_nobody_stated_is_seen() -> None:
    data = hide(["mass_dependent_friction"], seed=1, effect_size=6.0, setting=Setting(videos=5, bodies=3))
    fit = fit_together(data.tracks, model=default_model(), model_error=False)
    check = by_name(run_checks(fit, seed=0))["friction of the bodies against mass"]
    (cause,) = data.truth.causes
    assert check.significant
    assert check.p_value < 1e-6
    assert abs(abs(check.statistic) - cause.strength) < 0.1


@pytest.mark.parametrize(("groups", "ratio"), [([], 6.0), ([[1, 1, 0, 0], [0, 0, 1, 0]], 2.0)])
def test_masses_are_compared_where_their_ratio_is_known(groups: list[list[int]], ratio: float) -> None:
    bodies = tuple(Body(str(k), Shape.CYLINDER, radius=0.1) for k in range(4))
    weighed_together = np.array(groups, dtype=float).reshape(len(groups), 4).T
    log_mass = np.log([1.0, 2.0, 6.0, np.nan])
    own = BodyFrictions(bodies, np.zeros(4), np.eye(4), np.ones(4), log_mass, weighed_together)
    assert own.largest_mass_ratio == pytest.approx(ratio)


@pytest.mark.slow
def test_masses_and_angles_that_are_measured_are_used() -> None:
    measurement = Measurement(masses=True, angles=True)
    _, fit = fitted("contact_friction", 4.0, seed=6, setting=LARGER, measurement=measurement)
    checks = by_name(run_checks(fit, seed=0))
    assert {"spin change at contacts", "momentum at contacts", "friction of the bodies against mass"} <= set(checks)
    assert checks["tangential against normal impulse"].significant
    assert checks["spin change at contacts"].significant
    assert checks["spin change at contacts"].statistic > 0


@pytest.mark.slow
def test_false_alarms_are_as_rare_as_stated() -> None:
    alarms, p_values = [], []
    for seed in range(200, 240):
        _, fit = fitted(seed=seed)
        if max(part.misfit.chi_square for part in fit.fits) > WELL_FITTED:
            continue
        checks = run_checks(fit, seed=0)
        alarms.append(any(check.significant for check in checks))
        p_values += [check.p_value for check in checks if check.name == "push in one direction"]
    assert min(len(alarms), len(p_values)) > 20
    # At a rate of 5 % more than 6 of 40 alarms have a probability below 1 %.
    assert sum(alarms) <= 6
    assert kstest(p_values, "uniform").pvalue > 1e-3


def test_a_kick_is_looked_for_piece_by_piece_and_nowhere_where_none_would_show(monkeypatch: pytest.MonkeyPatch) -> None:
    _, fit = fitted(seed=1)
    model = ResidualModel.of(fit).without_beliefs
    replicas = FreeFlight.of(model).beside.replicas(50, np.random.default_rng(0))
    (whole,) = kicks.kick_check(model, replicas)
    monkeypatch.setattr(kicks, "PLACES_AT_ONCE", 7)
    (pieces,) = kicks.kick_check(model, replicas)
    assert pieces.sentence == whole.sentence
    assert pieces.p_value == pytest.approx(whole.p_value, rel=1e-6)
    monkeypatch.setattr(kicks, "_shows", lambda *_: False)
    assert not list(kicks.kick_check(model, replicas))


def test_what_was_believed_of_bodies_is_no_observation() -> None:
    data, fit = fitted(seed=1)
    friction = next(one for one in own_parameters(fit.model) if one.name == FRICTION)
    alike = replace(friction, prior=replace(friction.prior, sd=0.01))
    believing = fit.under(replace(fit.model, beliefs={**fit.model.beliefs, FRICTION: alike}), model_error=False)
    plain, other = OwnValues.of(fit, FRICTION), OwnValues.of(believing, FRICTION)
    np.testing.assert_allclose(other.sd, plain.sd, rtol=0.15)
    rolls = np.array([data.tracks[video].bodies[body].shape is Shape.SPHERE for video, body in plain.bodies])
    for group in (rolls, ~rolls):  # what such bodies share may shift all of them
        assert group.sum() > 2
        assert other.values[group].std() == pytest.approx(plain.values[group].std(), rel=0.1)


def test_what_is_told_of_bodies_moves_with_what_videos_share() -> None:
    _, fit = fitted(seed=1)
    (friction,) = (one for one in fit.model.parameters if one.name == "sliding_friction")
    place = fit.joint.numbers.keys.index((friction.name, ()))
    middle = float(fit.joint.gaussian.mean[place])
    stronger = replace(friction, prior=replace(friction.prior, mean=middle + 0.05, sd=1e-4))
    moved = fit.under(replace(fit.model, beliefs={**fit.model.beliefs, friction.name: stronger}), model_error=False)
    away = fit.joint.gaussian.shared_whitened(moved.joint.gaussian.mean[None])[0]

    told = OwnValues.of(fit, FRICTION)
    change = OwnValues.of(moved, FRICTION).values - told.values
    np.testing.assert_allclose(change, told.following @ away, atol=5e-3)
    assert change.min() < -0.04  # bodies rub less than what they share says

    told = OwnValues.of(fit, RESTITUTION.name)  # which have a soft edge, and of which tracks tell products
    met = Rebounds.of(fit, [FittedContacts.of(video.motion) for video in ResidualModel.of(fit).videos])
    change = met.owners @ (OwnValues.of(moved, RESTITUTION.name).values - told.values)
    np.testing.assert_allclose(change, met.owners @ told.following @ away, atol=0.2 * np.abs(change).max())
    assert np.abs(change).max() > 1e-3


@pytest.mark.slow
def test_a_law_by_the_mass_takes_away_the_slope_that_it_has() -> None:
    _, fit = fitted("mass_dependent_friction", effect_size=6.0, seed=1, setting=Setting(videos=6, bodies=4))
    base = Trial((), with_own_population(fit), stated=fit.model.beliefs)
    (score,) = score_causes(base.fit, ResidualModel.of(base.fit), [MassDependentFriction()], seed=0)
    law = base.with_cause(score)
    assert law is not None
    name = friction_against("mass")
    assert by_name(run_checks(base.fit, seed=0))[name].p_value < 1e-6
    assert by_name(run_checks(law.continued().fit, seed=0))[name].p_value > 0.01
