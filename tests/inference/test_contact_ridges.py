"""Two discs that meet before the tracks tell how they came: what leads to one parting lies on a straight line."""

import dataclasses

import numpy as np
import pytest
import torch

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import default_model
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.samplers.contact_ridges import ContactRidge, contact_ridges
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian, SeveralClouds
from vrdp_prob.inference.samplers.importance import Weighted, effective_count, smoothed_weights
from vrdp_prob.inference.samplers.proposals import proposals
from vrdp_prob.inference.samplers.straightening import Rates
from vrdp_prob.scene import Shape

CONTACT = 0.05
"""Time (s) of the contact: the second frame is just before it."""
SPEEDS = np.array([[1.6, 0.3], [-1.4, -0.2]])
RADIUS = 0.2
CHANGES = [(1.2, 0.0, 0.0), (0.0, -1.2, 0.0), (0.0, 0.0, -0.5), (-0.3, 0.4, 0.3)]
"""Changes of the logarithms of both masses and of the first restitution."""


def scene(shape: Shape = Shape.CYLINDER) -> Scene:
    """Two bodies that touch at the time of the contact, askew."""
    apart = 2 * RADIUS * np.array([np.cos(0.4), np.sin(0.4)])
    places = np.array([[-0.1, 0.0], apart - [0.1, 0.0]]) - CONTACT * SPEEDS
    ones = np.ones(2)
    return Scene((shape, shape), places, SPEEDS, ones, 0.85 * ones, RADIUS * ones, 0.3 * ones)


@pytest.fixture(scope="module")
def fit() -> MapFit:
    return fit_map(observe(scene(), noise=0.008, frames=45, seed=1), default_model(), np.random.default_rng(0))


@pytest.fixture(scope="module")
def ridge(fit: MapFit) -> ContactRidge:
    (found,) = contact_ridges(fit.likelihood, fit.point)
    return found


def quantities(fit: MapFit, point: np.ndarray) -> dict[str, np.ndarray]:
    return {
        name: one[0].numpy()
        for name, one in fit.likelihood.coordinates.quantities(torch.from_numpy(point)[None]).items()
    }


def approach(fit: MapFit, change: tuple[float, float, float]) -> np.ndarray:
    """Change of the release velocities that leaves the parting of the mode, by momentum and restitution.

    Friction before the contact is left out, so it is right to a few millimetres per second.
    """
    at = quantities(fit, fit.point)
    velocity = np.stack([at["velocity_x"], at["velocity_y"]], axis=1)
    with torch.no_grad():
        events = fit.likelihood.rollout(torch.from_numpy(fit.point[None])).events
    normal = events.normal[0]

    def normal_speeds(
        mass: np.ndarray, restitution: float, *, after: np.ndarray | None = None, before: np.ndarray | None = None
    ) -> np.ndarray:
        """Speeds along the normal on one side of the contact from those on the other."""
        known = after if before is None else before
        assert known is not None
        factor = -1 / restitution if before is None else -restitution
        sums = np.array([mass @ known, factor * (known[1] - known[0])])
        return np.linalg.solve(np.array([mass, [-1.0, 1.0]]), sums)

    parting = normal_speeds(at["mass"], float(np.prod(at["restitution"])), before=velocity @ normal)
    mass = at["mass"] * np.exp(change[:2])
    came = normal_speeds(mass, float(np.prod(at["restitution"])) * np.exp(change[2]), after=parting)
    return np.asarray((came - velocity @ normal)[:, None] * normal)


def moved(fit: MapFit, change: tuple[float, float, float]) -> np.ndarray:
    """The mode with other masses and another restitution."""
    places, point = fit.likelihood.coordinates.places, fit.point.copy()
    for key, size in zip((("mass", 0), ("mass", 1), ("restitution", 0)), change, strict=True):
        point[places[key]] += size
    return point


def with_approach(fit: MapFit, point: np.ndarray, change: np.ndarray) -> np.ndarray:
    """A point with other release velocities, and places from which these lead to the same contact."""
    places, found = fit.likelihood.coordinates.places, point.copy()
    with torch.no_grad():
        time = float(fit.likelihood.rollout(torch.from_numpy(fit.point[None])).events.time[0])
    for body in (0, 1):
        for axis, (rate, place) in enumerate((("velocity_x", "x"), ("velocity_y", "y"))):
            found[places[rate, body]] += change[body, axis]
            found[places[place, body]] -= time * change[body, axis]
    return found


@pytest.mark.parametrize("change", CHANGES)
def test_what_is_straight_before_is_the_parting_of_the_mode_after(
    fit: MapFit, ridge: ContactRidge, change: tuple[float, float, float]
) -> None:
    small = 1e-6
    slope = approach(fit, (small * change[0], small * change[1], small * change[2])) / small
    straight = with_approach(fit, moved(fit, change), slope)
    expected = with_approach(fit, moved(fit, change), approach(fit, change))
    assert ridge.bent(torch.from_numpy(straight)).numpy() == pytest.approx(expected, abs=4e-3)
    assert np.abs(straight - expected).max() > 0.02


def test_the_map_has_an_inverse_leaves_the_mode_alone_and_keeps_volumes(fit: MapFit, ridge: ContactRidge) -> None:
    points = torch.from_numpy(fit.point + 0.3 * np.random.default_rng(0).standard_normal((20, len(fit.point))))
    assert ridge.straightened(ridge.bent(points).numpy()) == pytest.approx(points.numpy(), abs=1e-12)
    centre = torch.from_numpy(fit.point)
    unit = torch.eye(len(fit.point), dtype=torch.float64)
    torch.testing.assert_close(torch.autograd.functional.jacobian(ridge.bent, centre), unit)
    for point in points[:3]:
        slope = torch.autograd.functional.jacobian(ridge.bent, point)
        assert float(torch.linalg.det(slope)) == pytest.approx(1.0)


def test_clouds_along_the_ridge_are_worth_several_times_as_many_draws(fit: MapFit, ridge: ContactRidge) -> None:
    likelihood = fit.likelihood
    rates = Rates.of(likelihood.tracks, likelihood.coordinates)
    assert ridge.helps(Gaussian.from_precision(fit.point, fit.precision), likelihood.residuals)
    worth = []
    for ridges in (None, lambda _point: [ridge]):
        start = proposals(fit.modes[:1], likelihood.residuals, rates, ridges)
        drawn = Weighted.drawn(likelihood.log_density, start, 4000, np.random.default_rng(1), lambda _worlds: None)
        worth.append(effective_count(smoothed_weights(drawn.log_ratio)[0]))
    assert worth[1] > 3 * worth[0]


def test_a_contact_that_many_frames_show_before_it_has_no_ridge() -> None:
    late = scene()
    late.position -= 0.8 * late.velocity
    fitted = fit_map(observe(late, noise=0.008, frames=45, seed=1), default_model(), np.random.default_rng(0))
    assert fitted.contacts == ((0, 1),)
    assert not contact_ridges(fitted.likelihood, fitted.point)


def test_one_place_without_hope_does_not_decide_whether_a_ridge_helps(fit: MapFit, ridge: ContactRidge) -> None:
    gaussian = Gaussian.from_precision(fit.point, fit.precision)
    places = fit.likelihood.coordinates.places

    def residuals(points: np.ndarray) -> np.ndarray:
        found = fit.likelihood.residuals(points)
        place = places["restitution", 0]
        lost = points[:, place] > fit.point[place] + 0.5 * gaussian.sd[place]
        return np.where(lost[:, None], 1e3 * points[:, places["velocity_x", 0], None], found)

    assert ridge.helps(gaussian, residuals)


def test_clouds_with_and_without_ridges_know_their_inverses(fit: MapFit, ridge: ContactRidge) -> None:
    gaussian = Gaussian.from_precision(fit.point, fit.precision)
    other = dataclasses.replace(ridge, restitution=0.5 * ridge.restitution)
    clouds = [CurvedGaussian.straight(gaussian, None, ridges) for ridges in ((), (ridge,), (ridge, other))]
    whitened = np.random.default_rng(2).standard_normal((5, len(fit.point)))
    for index, cloud in enumerate(clouds):
        assert SeveralClouds(clouds).whitened(cloud.points(whitened))[index] == pytest.approx(whitened, abs=1e-9)


def test_cubes_have_a_ridge_along_which_their_spins_follow() -> None:
    tracks = observe(scene(Shape.CUBE), noise=0.008, frames=45, seed=3, angles=True)
    fitted = fit_map(tracks, default_model(), np.random.default_rng(0))
    (found,) = contact_ridges(fitted.likelihood, fitted.point)
    spins = fitted.likelihood.coordinates.mask(["spin"])
    assert found.approach[:, spins].any()
    assert found.helps(Gaussian.from_precision(fitted.point, fitted.precision), fitted.likelihood.residuals)
