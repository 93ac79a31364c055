"""Bodies that noise puts a little into a wall, or each other, as they are released: no descent leads out of that."""

import numpy as np
import pytest
import torch

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.search.release_places import released_apart
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks, Wall

FLOOR = Wall(-3.0, 0.0, 3.0, 0.0, 0.8)
NOISE = 0.001


def released(
    shape: Shape, places: list[list[float]], *walls: Wall, radii: tuple[float | None, ...] = (0.2, 0.2)
) -> tuple[Likelihood, np.ndarray]:
    """Likelihood of bodies of some radii (m) that drift away from some places (m), and the world that begins there."""
    times = np.arange(10) / 25
    positions = np.array(places) + times[:, None, None] * np.array([0.5, 0.5])
    bodies = tuple(Body(str(k), shape, radius) for k, radius in zip(range(len(places)), radii, strict=False))
    tracks = Tracks.from_arrays("released", bodies, times, positions, walls=walls)
    everything = frozenset(range(len(places)))
    meeting = frozenset(body for body in everything if bodies[body].radius is not None)
    coordinates = unknowns(tracks, default_model(), Structure(moving=everything, colliding=meeting))
    start = coordinates.prior_mean.copy()
    for body, (x, y) in enumerate(places):
        start[[coordinates.places["x", body], coordinates.places["y", body]]] = x, y
    return Likelihood(tracks, default_model(), coordinates), start


def possible(likelihood: Likelihood, start: np.ndarray) -> bool:
    return bool(likelihood.rollout(torch.from_numpy(start[None])).fine.all())


@pytest.mark.parametrize(
    ("shape", "places", "walls"),
    [
        (Shape.SPHERE, [[0.0, 0.197]], [FLOOR]),
        (Shape.CUBE, [[0.0, 0.197]], [FLOOR]),
        (Shape.CYLINDER, [[0.0, 1.0], [0.398, 1.0]], []),
        (Shape.SPHERE, [[0.0, 0.198], [0.398, 0.198]], [FLOOR]),
        (Shape.SPHERE, [[-2.8, 0.197]], [FLOOR, Wall(-3.0, 0.0, -3.0, 2.0, 0.8)]),
    ],
)
def test_a_world_begins_possible(shape: Shape, places: list[list[float]], walls: list[Wall]) -> None:
    likelihood, start = released(shape, places, *walls)
    assert not possible(likelihood, start)
    moved = released_apart(likelihood, start, NOISE)
    assert possible(likelihood, moved)
    assert np.abs(moved - start).max() < 0.005


def test_bodies_that_are_apart_stay_where_they_are() -> None:
    likelihood, start = released(Shape.SPHERE, [[0.0, 0.21], [0.5, 0.3]], FLOOR)
    np.testing.assert_array_equal(released_apart(likelihood, start, NOISE), start)


def test_bodies_whose_radius_is_not_stated_meet_nothing() -> None:
    likelihood, start = released(Shape.SPHERE, [[0.0, 0.197], [0.1, 0.3]], FLOOR, radii=(0.2, None))
    moved = released_apart(likelihood, start, NOISE)
    changed = np.flatnonzero(moved != start)
    assert [likelihood.coordinates.entries[place].owner for place in changed] == [0]


def test_bodies_that_are_far_within_a_wall_stay_there() -> None:
    likelihood, start = released(Shape.SPHERE, [[0.0, 0.19]], FLOOR)
    np.testing.assert_array_equal(released_apart(likelihood, start, NOISE), start)


def test_a_body_that_begins_at_a_wall_is_fitted() -> None:
    scene = Scene(
        (Shape.CYLINDER,) * 2,
        np.array([[-1.5, 0.2], [0.0, 0.7]]),
        np.array([[1.8, 0.6], [0.0, 0.0]]),
        np.ones(2),
        np.full(2, 0.8),
        np.full(2, 0.2),
        np.full(2, 0.05),
    )
    seen = observe(scene, noise=0.005, frames=40, seed=3)
    positions = seen.positions.copy()
    positions[0, 0] = [-1.5, 0.192]
    tracks = Tracks.from_arrays("at the wall", seen.bodies, seen.times, positions, walls=(FLOOR,))
    fit = fit_map(tracks, default_model(), np.random.default_rng(0), model_error=False)
    assert not fit.misfit.large
