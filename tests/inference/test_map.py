"""The most probable values of random videos; the whole rate is in `benchmarks/map.py`."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from jaxtyping import Float

from tests.inference.generator import states
from tests.inference.map_comparison import Comparison, compare
from tests.inference.prior_scenes import prior_scene
from tests.inference.random_scenes import Truth, collisions_of_each, random_truth
from vrdp_prob.inference import default_model, map_fit
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.encounters import CROWDED, MANY_PARTNERS, hard_to_explain
from vrdp_prob.inference.search.events import courses
from vrdp_prob.inference.search.hypothesis import distances, yaw_places
from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.inference.search.mode_search import ModeSearch, agree
from vrdp_prob.inference.search.model_error_fit import expected_model_error
from vrdp_prob.inference.search.modes import structure_at, with_all_that_meet
from vrdp_prob.inference.search.plan import CURRICULUM, GROWING, FitPlan, Optimiser
from vrdp_prob.inference.search.refinement import Refined, at_the_top, climb
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import ModelError
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.unknowns import Structure, structure_of, unknowns

SCENES, GOAL = 300, 0.99
TOLERANCE = 3 * np.sqrt(GOAL * (1 - GOAL) / SCENES)
"""Three standard deviations of a rate of 99 % among 300: 1.7 points."""


@cache
def fitted(seed: int, plan: FitPlan | None = None) -> tuple[MapFit, Comparison]:
    truth = random_truth(seed)
    fit = fit_map(truth.tracks, default_model(), np.random.default_rng(0), plan=plan)
    return fit, compare(truth, fit)


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(4, id="one contact of spheres or cylinders"),
        pytest.param(13, id="two cubes, one hit"),
        pytest.param(16, id="a hit that hardly moves a heavy body at rest"),
        pytest.param(181, id="no error of the model where noise explains the fit", marks=pytest.mark.slow),
    ],
)
def test_the_map_is_as_probable_as_the_truth(seed: int) -> None:
    fit, comparison = fitted(seed)
    assert comparison.succeeded, f"{comparison.fitted - comparison.true:.1f} nats: {comparison.cause}"
    assert fit.likelihood.model_error is None
    assert fit.converged or seed == 181
    assert fit.search.done
    assert list(fit.modes) == sorted(fit.modes, key=lambda mode: -mode.log_density)


def test_a_wrong_fit_is_not_forgiven_for_its_model_error() -> None:
    fit, comparison = fitted(4)
    likelihood, observations = fit.likelihood, fit.likelihood.observations
    ones, angles = np.ones(len(observations.frame)), np.ones(len(observations.angle))
    error = ModelError(1.0, 1.0, 1e4, 0.0, 0.3, ones, angles)  # explains any motion
    structure = structure_of(likelihood.coordinates)
    coordinates = unknowns(likelihood.tracks, likelihood.model, structure, model_error=error)
    for shift, right in ((0.0, True), (0.1, False)):
        point = likelihood.coordinates.carried(fit.point, coordinates)
        point[coordinates.places["x", 0]] += shift
        mode = replace(fit.modes[0], point=point, precision=np.eye(len(point)))
        forgiving = replace(likelihood, coordinates=coordinates, model_error=error)
        judged = compare(random_truth(4), replace(fit, likelihood=forgiving, modes=(mode,)))
        assert judged.true == pytest.approx(comparison.true)
        assert judged.succeeded is right


def test_an_error_of_which_its_own_fit_shows_nothing_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, _ = fitted(4)
    asked = []

    def once(
        likelihood: Likelihood, point: Float[np.ndarray, "dimension"], clues: Clues, misfit: Misfit
    ) -> ModelError | None:
        asked.append(likelihood.model_error)
        return likelihood.model_error or expected_model_error(likelihood, point, clues)

    monkeypatch.setattr(map_fit, "next_model_error", once)
    fit = fit_map(random_truth(4).tracks, default_model(), np.random.default_rng(0))
    assert [error is None for error in asked] == [True, False]
    assert fit.likelihood.model_error is None
    assert fit.misfit == plain.misfit
    assert fit.log_density == pytest.approx(plain.log_density)


@pytest.mark.slow
def test_alternatives_find_a_contact_that_one_start_misses() -> None:
    _, greedy = fitted(14, GROWING)
    assert not greedy.succeeded
    assert greedy.cause.startswith("collisions missed 3-4")
    _, comparison = fitted(14)
    assert comparison.succeeded


def test_a_contact_before_the_second_frame_is_found() -> None:
    scene = prior_scene(125)
    assert scene is not None
    times = scene.tracks.times
    assert [time < times[1] for time, *_ in scene.scene.contacts] == [True, False]
    true = states(scene.scene, times)
    truth = Truth(scene.scene, scene.tracks, true, scene.noise, scene.shared, scene.friction_ratio)
    comparison = compare(truth, fit_map(truth.tracks, default_model(), np.random.default_rng(0)))
    assert comparison.succeeded, comparison.cause
    assert comparison.fitted_pairs == ((1, 2), (0, 2))


def test_bodies_that_begin_to_meet_on_the_way_get_their_unknowns() -> None:
    fit, _ = fitted(4)
    likelihood, points = fit.likelihood, [mode.point for mode in fit.modes]
    complete = structure_at(likelihood, points, Structure(fit.clues.moving, frozenset()))
    assert complete.colliding
    assert with_all_that_meet(likelihood, complete, points) is None
    bare = replace(complete, colliding=frozenset())
    poorer = replace(likelihood, coordinates=unknowns(likelihood.tracks, likelihood.model, bare, likelihood.noise))
    carried = [likelihood.coordinates.carried(point, poorer.coordinates) for point in points]
    wider = with_all_that_meet(poorer, bare, carried)
    assert wider is not None
    assert wider[0].colliding <= complete.colliding
    added = set(wider[1].coordinates.places) - set(poorer.coordinates.places)
    assert added >= {(name, body) for name in ("mass", "restitution") for body in wider[0].colliding}


def test_contacts_in_quick_succession_are_hard_to_explain() -> None:
    bounces = [(1.0 + 0.1 * k, 0, 1) for k in range(CROWDED)]
    long_ago = np.zeros(8)
    assert hard_to_explain(bounces, long_ago)
    assert not hard_to_explain(bounces[1:], long_ago)
    assert not hard_to_explain([(10 * time, *pair) for time, *pair in bounces], long_ago)
    assert not hard_to_explain([(1.0 + 0.1 * k, 2 * k, 2 * k + 1) for k in range(CROWDED)], long_ago)


def test_collisions_of_a_body_are_counted_with_those_of_one_partner() -> None:
    contacts = [(1.0, 0, 1), (1.05, 0, 1), (1.1, 0, 1), (2.0, 0, 1), (3.0, 1, 2)]
    assert collisions_of_each(contacts, 4) == [2, 3, 1, 0]


def test_many_partners_of_one_body_are_hard_to_explain() -> None:
    partners = [(1.0 + k, 0, 1 + k) for k in range(MANY_PARTNERS)]
    assert hard_to_explain(partners, np.zeros(8))
    assert not hard_to_explain(partners[1:], np.zeros(8))


def test_a_contact_right_after_a_body_entered_is_hard_to_explain() -> None:
    entered = np.array([0.0, 0.8])
    assert hard_to_explain([(1.0, 0, 1)], entered)
    assert not hard_to_explain([(1.5, 0, 1)], entered)


def test_a_course_counts_a_pair_that_bounces_on_the_spot_twice() -> None:
    truth, model, bodies = random_truth(144), default_model(), frozenset(range(4))
    likelihood = Likelihood(truth.tracks, model, unknowns(truth.tracks, model, Structure(bodies, bodies)))
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(truth.point(likelihood)[None]))
    assert len(rollout.events.of_kind(RolloutEventKind.COLLISION).time) > 4
    assert courses(rollout) == [((0, 2), (1, 2), (0, 1), (0, 1))]


def test_lbfgs_reaches_the_same_maximum_in_stages() -> None:
    fit, _ = fitted(4)
    staged, comparison = fitted(4, FitPlan(Optimiser.LBFGS, free_first=True, windows=CURRICULUM.windows))
    assert comparison.succeeded
    assert staged.log_density == pytest.approx(fit.log_density, abs=0.5)


@pytest.mark.parametrize(
    ("refined", "climbed", "converged"),
    [
        pytest.param(True, (2.5, False), False, id="least squares stood still, L-BFGS climbed to its limit of steps"),
        pytest.param(True, (0.0, False), True, id="least squares stood still, L-BFGS found no way up"),
        pytest.param(False, (0.0, False), False, id="neither ended by itself"),
        pytest.param(False, (2.5, True), True, id="L-BFGS reached the top"),
    ],
)
def test_a_search_has_converged_where_its_last_part_did(
    refined: bool, climbed: tuple[float, bool], converged: bool
) -> None:
    point, (gain, reached) = np.zeros(2), climbed
    found = [Refined(point, -7.0, refined, 1), Refined(point, -9.0, True, 1)]
    tops = [Refined(point, -8.9, True, 1), Refined(point, -7.0 + gain, reached, 1)]
    assert at_the_top(found, tops) is converged


@pytest.mark.parametrize(("iterations", "converged"), [(1, False), (200, True)])
def test_a_climb_that_ends_at_its_limit_has_not_converged(iterations: int, converged: bool) -> None:
    fit, _ = fitted(4)
    start = replace(fit.modes[0], point=fit.point.copy())
    start.point[fit.likelihood.coordinates.places["x", 0]] += 0.02
    (value,) = fit.likelihood.log_density(torch.from_numpy(start.point[None])).tolist()
    climbed = climb(fit.likelihood, replace(start, log_density=value), iterations)
    assert climbed.log_density > value + 0.1
    assert climbed.converged is converged


def test_a_quarter_turn_of_a_cube_is_no_other_mode() -> None:
    fit, _ = fitted(13)
    (place, *_) = yaw_places(fit.likelihood)
    turned = fit.point.copy()
    turned[place] += np.pi / 2
    askew = fit.point.copy()
    askew[place] += 0.5
    apart = distances(fit.likelihood, fit.point, fit.precision, np.array([turned, askew]))
    assert apart[0] < 1e-3
    assert apart[1] > 3


def test_windows_end_with_the_whole_video() -> None:
    tracks = random_truth(4).tracks
    assert FitPlan().ends(tracks)[-2:] == [120, 128]
    assert CURRICULUM.ends(tracks) == [40, 80, 128]
    assert FitPlan(windows=()).ends(tracks) == [128]


def test_searches_agree_at_the_noise_that_they_leave() -> None:
    assert not agree([300.0], 310.0)
    assert agree([300.0, 340.0, 300.5], 310.0)
    assert not agree([300.0, 340.0, 302.0], 310.0)
    assert agree([15_000.0, 15_030.0], 310.0)
    assert not agree([15_000.0, 15_100.0], 310.0)
    assert not agree([np.inf, np.inf], 310.0)


def test_the_search_says_what_it_did_not_cover() -> None:
    assert not ModeSearch(done=True, attempts=2, agreed=True).sentence
    assert "not looked for" in ModeSearch(done=False, attempts=1, agreed=True).sentence
    assert "it was searched once" in ModeSearch(done=True, attempts=1, agreed=False).sentence
    assert "3 searches did not agree" in ModeSearch(done=True, attempts=3, agreed=False).sentence


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_the_rate_over_many_videos() -> None:
    found = [fitted(seed)[1].succeeded for seed in range(SCENES)]
    failed = [seed for seed, one in enumerate(found) if not one]
    assert np.mean(found) >= GOAL - TOLERANCE, f"failed: {failed}"
