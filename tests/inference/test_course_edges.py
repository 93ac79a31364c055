"""Grazes, which hardly deflect: of worlds drawn at random hardly one has as light a contact as one that was seen."""

import numpy as np
import pytest
import torch
from jaxtyping import Float

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.course_edges import best_beyond_edges, made_to_meet
from vrdp_prob.inference.search.events import courses_at
from vrdp_prob.inference.search.free_flight import Approach
from vrdp_prob.inference.search.hypothesis import Hypothesis
from vrdp_prob.inference.search.least_squares import robust_cost
from vrdp_prob.scene import Shape, Tracks

FRAMES, THRESHOLD = 40, 4.0
MEETING = Approach(0, 1, 0.75)
"""When and which bodies come near each other."""


def passing(depth: float, *, noise: float = 0.002) -> Tracks:
    """A sphere that passes another one, its path so much nearer (m) than that on which they just touch."""
    scene = Scene(
        (Shape.SPHERE,) * 2,
        np.array([[-1.5, 0.4 - depth], [0.0, 0.0]]),
        np.array([[2.0, 0.0], [0.0, 0.0]]),
        np.ones(2),
        np.full(2, 0.8),
        np.full(2, 0.2),
        np.full(2, 0.02),
    )
    return observe(scene, noise=noise, frames=FRAMES, seed=1)


@pytest.fixture(scope="module")
def graze() -> MapFit:
    return fit_map(passing(0.01), default_model(), np.random.default_rng(0), model_error=False)


def moved(fit: MapFit, distance: float) -> Float[np.ndarray, "dimension"]:
    """The fit with the path of the first body farther (m) from the other one."""
    point = fit.point.copy()
    point[fit.likelihood.coordinates.places["y", 0]] += distance
    return point


def courses(fit: MapFit, points: Float[np.ndarray, "point dimension"]) -> list[tuple[tuple[int, int], ...]]:
    return courses_at(fit.likelihood, torch.from_numpy(points), FRAMES)


def cost(fit: MapFit, points: Float[np.ndarray, "point dimension"]) -> Float[np.ndarray, "point"]:
    return robust_cost(fit.likelihood.residuals(points, FRAMES), THRESHOLD)


def test_bodies_are_made_to_meet_where_they_do_not(graze: MapFit) -> None:
    places = np.arange(len(graze.point))
    missing = Hypothesis(moved(graze, 0.05), 0.0, graze.precision)
    met = made_to_meet(graze.likelihood, missing, [MEETING, MEETING], places, FRAMES)
    assert courses(graze, met) == [((0, 1),)]
    deep = Hypothesis(met[0], 0.0, graze.precision)
    assert not len(made_to_meet(graze.likelihood, deep, [MEETING], places, FRAMES))


def test_only_some_places_change(graze: MapFit) -> None:
    places = np.array([graze.likelihood.coordinates.places[name, 0] for name in ("y", "velocity_y")])
    missing = Hypothesis(moved(graze, 0.05), 0.0, graze.precision)
    (met,) = made_to_meet(graze.likelihood, missing, [MEETING], places, FRAMES)
    assert set(np.flatnonzero(met != missing.point)) == set(places.tolist())
    assert courses(graze, met[None]) == [((0, 1),)]


def test_the_way_to_a_deep_contact_leads_past_the_graze_that_was_seen(graze: MapFit) -> None:
    missing, deep = moved(graze, 0.05), moved(graze, -0.2)
    (best,) = best_beyond_edges(graze.likelihood, missing, deep[None], FRAMES, threshold=THRESHOLD)
    assert courses(graze, np.array([missing, best])) == [(), ((0, 1),)]
    at_the_graze, at_the_end = cost(graze, np.array([best, deep]))
    assert at_the_graze < at_the_end / 10


def test_without_other_courses_there_are_no_ways(graze: MapFit) -> None:
    nowhere = np.empty((0, len(graze.point)))
    assert not len(best_beyond_edges(graze.likelihood, graze.point, nowhere, FRAMES, threshold=THRESHOLD))


@pytest.mark.parametrize("depth", [0.001, 0.004, 0.02])
def test_grazes_are_explained(depth: float) -> None:
    fit = fit_map(passing(depth), default_model(), np.random.default_rng(0), model_error=False)
    assert fit.contacts == ((0, 1),)
    assert not fit.misfit.large
