"""A disc meets two others at nearly the same time: both orders are kept where tracks do not tell which came first."""

import numpy as np
import pytest
import torch

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import default_model, infer
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.event_orders import other_orders
from vrdp_prob.inference.search.events import first_contacts
from vrdp_prob.inference.search.plan import Optimiser
from vrdp_prob.scene import Body, Shape, Tracks

UPPER_FIRST, LOWER_FIRST = ((0, 1), (0, 2)), ((0, 2), (0, 1))
BETWEEN = 0.15
"""Difference of the log restitutions of the two discs that parts the orders; in the true one they are alike."""


def between_two(offset: float, seed: int) -> Tracks:
    """A disc that comes in between two others, its path so far (m) above the middle."""
    scene = Scene(
        (Shape.SPHERE,) * 3,
        np.array([[-1.5, offset], [0.0, 0.27], [0.0, -0.27]]),
        np.array([[2.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
        np.ones(3),
        np.full(3, 0.7),
        np.full(3, 0.2),
        np.full(3, 0.5),
    )
    return observe(scene, noise=0.01, frames=60, seed=seed)


def mirrored(tracks: Tracks) -> Tracks:
    """The same seen in a mirror, so that the upper disc is the lower one."""
    bodies = tuple(
        Body(body.id, tracks.bodies[other].shape, tracks.bodies[other].radius)
        for body, other in zip(tracks.bodies, (0, 2, 1), strict=True)
    )
    return Tracks.from_arrays("mirrored", bodies, tracks.times, tracks.positions[:, [0, 2, 1]] * [1.0, -1.0])


def fitted(tracks: Tracks) -> MapFit:
    return fit_map(tracks, default_model(), np.random.default_rng(0), model_error=False)


def orders(fit: MapFit) -> dict[tuple[tuple[int, int], ...], float]:
    """The log density of the best mode of each order of contacts."""
    with torch.no_grad():
        rollout = fit.likelihood.rollout(torch.from_numpy(np.array([mode.point for mode in fit.modes])))
    found: dict[tuple[tuple[int, int], ...], float] = {}
    for world, mode in enumerate(fit.modes):
        found.setdefault(first_contacts(rollout, world), mode.log_density)
    return found


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), 2, pytest.param(3, marks=pytest.mark.slow)])
def test_both_orders_are_modes_and_a_mirror_swaps_them(seed: int) -> None:
    tracks = between_two(0.0, seed)
    found, other = orders(fitted(tracks)), orders(fitted(mirrored(tracks)))
    assert found.keys() == other.keys() == {UPPER_FIRST, LOWER_FIRST}
    assert found[UPPER_FIRST] == pytest.approx(other[LOWER_FIRST], abs=0.2)
    assert found[LOWER_FIRST] == pytest.approx(other[UPPER_FIRST], abs=0.2)


def test_contacts_that_are_clearly_apart_have_one_order() -> None:
    fit = fitted(between_two(0.08, seed=1))
    assert orders(fit).keys() == {UPPER_FIRST}
    starts = other_orders(Descent(fit.likelihood, Optimiser.GAUSS_NEWTON), fit.point)
    assert not starts.points
    assert not fit.search.sentence


def test_more_orders_than_are_tried_are_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrdp_prob.inference.search.event_orders.MOST_ORDERS", 0)
    fit = fitted(between_two(0.0, seed=2))
    assert "not all orders in which they may have come were tried" in fit.search.sentence


def share_of_the_rarer_order(tracks: Tracks, sampler: str = "laplace") -> tuple[float, float]:
    """Probability of the order that takes unlike restitutions, and its Monte Carlo standard error."""
    posterior = infer(tracks, sampler=sampler, draws=2000, hand_on=False)
    assert posterior.convergence.converged
    restitution = np.log(posterior.data["posterior"].to_dataset()["restitution"].values.reshape(-1, 3))
    share = float((np.abs(restitution[:, 1] - restitution[:, 2]) > BETWEEN).mean())
    return share, float(np.sqrt(share * (1 - share) / min(posterior.convergence.ess_bulk, 2000)))


@pytest.mark.slow
def test_a_mirror_does_not_change_the_probability_of_an_order() -> None:
    tracks = between_two(0.0, seed=3)
    share, error = share_of_the_rarer_order(tracks)
    other, other_error = share_of_the_rarer_order(mirrored(tracks))
    assert 0.05 < share < 0.25
    assert abs(other - share) < 4 * np.hypot(error, other_error)


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["emcee", "nuts"])
def test_samplers_agree_on_the_probability_of_an_order(sampler: str) -> None:
    tracks = between_two(0.0, seed=3)
    share, error = share_of_the_rarer_order(tracks)
    other, other_error = share_of_the_rarer_order(tracks, sampler)
    assert abs(share - other) < 4 * np.hypot(error, other_error)
