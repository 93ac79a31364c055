"""Bodies that are hit before four frames have shown whether they move."""

import numpy as np
import pytest

from tests.inference.generator import Scene, observe
from tests.inference.prior_scenes import prior_scene
from vrdp_prob.inference import default_model, infer
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.scene import Shape, Tracks

HIT = 0.1
"""Time (s) of the contact: three frames come before it."""
GRAZED = 901
"""Seed of a scene in which a disc at rest is grazed at once; a small error of its place would make it pass by."""


def hit_soon(
    velocity: tuple[float, float],
    shape: Shape = Shape.CYLINDER,
    *,
    hit: float = HIT,
    noise: float = 0.01,
    seed: int = 3,
) -> Tracks:
    """A body that is hit soon by another one."""
    speeds = np.array([[2.0, 0.2], velocity])
    places = np.array([[-0.4, 0.0], [0.0, 0.05]]) - hit * speeds
    scene = Scene(
        (Shape.CYLINDER, shape),
        places,
        speeds,
        np.array([1.0, 1.5]),
        np.array([0.9, 0.9]),
        np.full(2, 0.2),
        np.full(2, 0.4),
    )
    tracks = observe(scene, noise=noise, frames=45, seed=seed)
    assert abs(scene.contacts[0][0] - hit) < 0.1 * hit + 0.01
    return tracks


def moving(fit: MapFit) -> set[int | None]:
    """Bodies with a release velocity."""
    return {entry.owner for entry in fit.likelihood.coordinates.entries if entry.field == "velocity_x"}


@pytest.mark.parametrize("shape", [Shape.CYLINDER, Shape.CUBE])
def test_a_body_at_rest_has_no_release_velocity_though_few_frames_show_it(shape: Shape) -> None:
    tracks = hit_soon((0.0, 0.0), shape)
    assert 1 in Clues.of(tracks).moving
    fit = fit_map(tracks, default_model(), np.random.default_rng(0))
    assert moving(fit) == {0}
    assert fit.believed_at_rest == {1}
    assert ("spin", 1) not in fit.likelihood.coordinates.places
    assert fit.misfit.ratio < 1.2


@pytest.mark.slow
def test_a_posterior_says_that_it_takes_a_body_to_have_been_at_rest() -> None:
    posterior = infer(hit_soon((0.0, 0.0)), sampler="laplace", seed=0, draws=100)
    assert "Object 1 was hit too soon to show motion: taken to have been at rest." in posterior.warnings
    assert (posterior.data["posterior"]["velocity"].values[..., 1, :] == 0).all()


@pytest.mark.parametrize("velocity", [(-0.8, 0.0), (0.0, 0.9)])
def test_a_body_that_moves_keeps_its_release_velocity(velocity: tuple[float, float]) -> None:
    fit = fit_map(hit_soon(velocity), default_model(), np.random.default_rng(0))
    assert moving(fit) == {0, 1}


@pytest.mark.parametrize(("noise", "seed"), [(0.03, 4), (0.025, 0)])
def test_a_world_that_fails_beside_the_best_one_is_no_evidence_of_rest(noise: float, seed: int) -> None:
    fit = fit_map(hit_soon((0.0, 0.0), noise=noise, seed=seed), default_model(), np.random.default_rng(0))
    assert 0 in moving(fit)
    assert fit.contacts == ((0, 1),)
    assert fit.misfit.ratio < 1.2


def test_worlds_that_fail_on_all_sides_do_no_harm() -> None:
    fit = fit_map(hit_soon((0.0, 0.0), hit=0.02, noise=0.03, seed=7), default_model(), np.random.default_rng(0))
    assert fit.misfit.ratio < 1.2


def test_a_body_that_is_hit_later_is_not_looked_at() -> None:
    tracks = hit_soon((0.0, 0.0), hit=0.8)
    fit = fit_map(tracks, default_model(), np.random.default_rng(0))
    assert moving(fit) == {0}
    assert not fit.believed_at_rest


def test_a_body_at_rest_that_is_grazed_is_found_at_another_place() -> None:
    scene = prior_scene(GRAZED)
    assert scene is not None
    assert not scene.scene.velocity[0].any()
    fit = fit_map(scene.tracks, default_model(), np.random.default_rng(GRAZED))
    assert moving(fit) == {1}
    assert fit.misfit.ratio < 1.2
