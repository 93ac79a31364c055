"""Whether a fit is as probable as the truth, both under one likelihood that holds all unknowns.

The fit's vector lacks what it took for unimportant (the velocity of a body at rest, mass and restitution of a body that
meets nobody); these take the prior's mean, which is their default. In the truth, too, matter and yaw of bodies that
meet nobody in either world take it: they say nothing about the tracks, and their true values would only cost the truth
probability and make the comparison easy.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch

from tests.inference.random_scenes import Truth
from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.unknowns import Structure, unknowns

MARGIN = 0.5
"""Nats by which a fit may be less probable than the truth."""
MATTER = ("mass", "restitution", "angle", "spin")


@dataclass(frozen=True)
class Comparison:
    """Log posterior (nats) of the fit and of the truth, and the pairs that collide in each."""

    fitted: float
    true: float
    fitted_pairs: tuple[tuple[int, int], ...]
    true_pairs: tuple[tuple[int, int], ...]

    @property
    def succeeded(self) -> bool:
        """Whether the fit is at least as probable as the truth, within the margin."""
        return self.fitted >= self.true - MARGIN


def compare(truth: Truth, fit: MapFit) -> Comparison:
    """Compare a fit with the truth."""
    everything = full_likelihood(fit)
    lifted, true = lift(fit, everything), truth.point(everything)
    meeting = {body for point in (lifted, true) for pair in _pairs(everything, point) for body in pair}
    alone = set(range(len(truth.tracks.bodies))) - meeting
    unimportant = everything.coordinates.mask(MATTER, alone)
    lifted[unimportant] = true[unimportant] = everything.coordinates.prior_mean[unimportant]
    with torch.no_grad():
        values = everything.log_density(torch.from_numpy(np.stack([lifted, true])))
    return Comparison(*values.tolist(), _pairs(everything, lifted), _pairs(everything, true))


def full_likelihood(fit: MapFit) -> Likelihood:
    """The fit's likelihood with the motion and the matter of every body among the unknowns."""
    bodies = frozenset(range(len(fit.likelihood.tracks.bodies)))
    coordinates = unknowns(fit.likelihood.tracks, fit.likelihood.model, Structure(bodies, bodies))
    return replace(fit.likelihood, coordinates=coordinates)


def lift(fit: MapFit, everything: Likelihood) -> np.ndarray:
    """The fit in the vector of all unknowns."""
    point = everything.coordinates.prior_mean.copy()
    for place, entry in enumerate(fit.likelihood.coordinates.entries):
        point[everything.coordinates.places[entry.field, entry.owner]] = fit.point[place]
    return point


def _pairs(likelihood: Likelihood, point: np.ndarray) -> tuple[tuple[int, int], ...]:
    with torch.no_grad():
        return first_contacts(likelihood.rollout(torch.from_numpy(point[None])), 0)
