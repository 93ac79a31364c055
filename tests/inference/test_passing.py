"""Cubes that pass something so closely that only their yaw keeps them from meeting it."""

import numpy as np
import pytest

from tests.inference.prior_scenes import prior_scene
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.inference.search.passing import close_passes
from vrdp_prob.models.unknowns import structure_of
from vrdp_prob.scene import Body, Shape, Tracks, Wall

RADIUS = 0.2
REACH = np.sqrt(2) * RADIUS
TIMES = np.arange(5) / 5


def passing(distance: float, shape: Shape, *, entered: int = 0, walls: tuple[Wall, ...] = ()) -> Tracks:
    """A body of a shape that passes a resting disc along a straight line, midway between two frames."""
    positions = np.zeros((len(TIMES), 2, 2))
    positions[:, 0, 0] = np.linspace(-1.5, 2.0, len(TIMES))
    positions[:, 0, 1] = distance
    positions[:entered, 1] = np.nan
    bodies = (Body("0", shape, RADIUS), Body("1", Shape.CYLINDER, RADIUS))
    return Tracks.from_arrays("passing", bodies, TIMES, positions, walls=walls)


def close(tracks: Tracks) -> frozenset[int]:
    return close_passes(tracks, np.nan_to_num(tracks.positions)[None])


@pytest.mark.parametrize(("gap", "expected"), [(-0.005, {0}), (0.005, set())])
def test_a_cube_passes_closely_where_its_corners_reach(gap: float, expected: set[int]) -> None:
    assert close(passing(RADIUS + REACH + gap, Shape.CUBE)) == expected


def test_a_disc_has_no_yaw_that_could_matter() -> None:
    assert close(passing(2 * RADIUS + 0.005, Shape.CYLINDER)) == frozenset()


def test_a_body_that_is_not_there_yet_is_not_passed() -> None:
    near = RADIUS + REACH - 0.005
    assert close(passing(near, Shape.CUBE, entered=3)) == frozenset()
    assert close(passing(near, Shape.CUBE, entered=1)) == {0}


@pytest.mark.parametrize(("end", "expected"), [(-1.4, {0}), (-2.0, set())])
def test_a_wall_is_passed_as_far_as_it_goes(end: float, expected: set[int]) -> None:
    wall = Wall(-3.0, 1.0, end, 1.0)
    assert close(passing(1.0 - REACH + 0.01, Shape.CUBE, walls=(wall,))) == expected


def test_worlds_that_failed_say_nothing() -> None:
    tracks = passing(RADIUS + REACH - 0.005, Shape.CUBE)
    assert close_passes(tracks, np.full((1, *tracks.positions.shape), np.nan)) == frozenset()


def test_a_near_miss_is_not_taken_for_a_misfit() -> None:
    """With a yaw at its default the cube of this scene would graze the sphere that it passes."""
    scene = prior_scene(5763)
    assert scene is not None
    assert not scene.scene.contacts
    fit = fit_map(scene.tracks, default_model(), np.random.default_rng(0))
    assert fit.likelihood.model_error is None
    assert not fit.contacts
    (cube,) = (index for index, body in enumerate(scene.tracks.bodies) if body.shape is Shape.CUBE)
    assert {("angle", cube), ("spin", cube)} <= set(fit.likelihood.coordinates.places)
    assert structure_of(fit.likelihood.coordinates).passing == {cube}
    residuals = (scene.tracks.positions - fit.rollout.trajectory[0, ..., :2].numpy())[scene.tracks.seen]
    assert residuals.std() < 1.05 * scene.noise
