"""Most probable noise scales for worlds that are held fixed, and how sharply they are known."""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.optimize import minimize
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import FRAME_JITTER
from vrdp_prob.models.unknowns import ANGLE_NOISE, DEGREES_OF_FREEDOM, NOISE

NOISE_FIELDS = (NOISE, ANGLE_NOISE, DEGREES_OF_FREEDOM, FRAME_JITTER.name)
"""Coordinates that the simulated worlds do not depend on."""
NORMAL_MEDIAN = 1.1774
"""Median length of two independent standard normal numbers."""


def best_noise(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], chosen: Bool[np.ndarray, "dimension"] | None = None
) -> Float[np.ndarray, "dimension"]:
    """The point with the most probable noise (that of some coordinates, where chosen) for its world.

    It is the point itself where its world fails.
    """
    places = _places(likelihood) if chosen is None else np.flatnonzero(chosen)
    discrepancies = likelihood.discrepancies(torch.from_numpy(point[None]))
    if not len(places) or not bool(torch.isfinite(discrepancies.positions).all()):
        return point

    def descend(values: Float[np.ndarray, "noise"]) -> tuple[float, Float[np.ndarray, "noise"]]:
        moved = torch.from_numpy(_with(point, places, values)[None]).requires_grad_()
        loss = -likelihood.log_density_given(discrepancies, moved)[0]
        (gradient,) = torch.autograd.grad(loss, moved)
        return float(loss.detach()), gradient[0].numpy()[places]

    start = point[places]
    size = float(discrepancies.positions.norm(dim=-1).median()) / NORMAL_MEDIAN
    place = likelihood.coordinates.places.get((NOISE, None))
    if place is not None and size > 0:
        start = np.where(places == place, np.log(size), start)
    result = minimize(descend, start, jac=True, method="L-BFGS-B", options={"maxiter": 60})
    return _with(point, places, result.x)


def noise_curvature(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"]
) -> tuple[Int[np.ndarray, "noise"], Float[np.ndarray, "noise noise"]]:
    """Places of the noise coordinates, and the curvature of the negative log posterior along them."""
    places = _places(likelihood)
    if not len(places):
        return places, np.zeros((0, 0))
    discrepancies = likelihood.discrepancies(torch.from_numpy(point[None]))
    chosen = torch.from_numpy(places)

    def loss(values: Tensor) -> Tensor:
        moved = torch.from_numpy(point).index_copy(0, chosen, values)
        return -likelihood.log_density_given(discrepancies, moved[None])[0]

    hessian = torch.autograd.functional.hessian(loss, torch.from_numpy(point[places]))
    curvature: np.ndarray = hessian.numpy()
    values, vectors = np.linalg.eigh((curvature + curvature.T) / 2)
    least = np.maximum(values, likelihood.coordinates.prior_sd[places].max() ** -2)
    return places, (vectors * least) @ vectors.T


def _places(likelihood: Likelihood) -> Int[np.ndarray, "noise"]:
    return np.flatnonzero(likelihood.coordinates.mask(NOISE_FIELDS))


def _with(
    point: Float[np.ndarray, "dimension"], places: Int[np.ndarray, "noise"], values: Float[np.ndarray, "noise"]
) -> Float[np.ndarray, "dimension"]:
    moved = point.copy()
    moved[places] = values
    return moved
