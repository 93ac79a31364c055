"""Whether a fit is as probable as the truth, both under one likelihood that holds all unknowns.

The fit's vector lacks what it took for unimportant (the velocity of a body at rest, mass and restitution of a body that
meets nobody); these take the prior's mean, which is their default. In the truth, too, matter and yaw of bodies that
meet nobody in either world take it: they say nothing about the tracks, and their true values would only cost the truth
probability and make the comparison easy. A model error that the fit found is left out of that likelihood, since it
would forgive a wrong fit; the noise is then the most probable one for the fit's world.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch

from tests.inference.random_scenes import Truth
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.search.events import first_contacts
from vrdp_prob.inference.search.noise_fit import best_noise
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Shape

WRONG_YAW = np.radians(5)
MARGIN = 0.5
"""Nats by which a fit may be less probable than the truth."""
MATTER = ("mass", "restitution", "angle", "spin")


@dataclass(frozen=True)
class Comparison:
    """Log posterior (nats) of the fit and of the truth, the pairs that collide in each, and by how much yaws differ."""

    fitted: float
    true: float
    fitted_pairs: tuple[tuple[int, int], ...]
    true_pairs: tuple[tuple[int, int], ...]
    turned: float

    @property
    def succeeded(self) -> bool:
        """Whether the fit is at least as probable as the truth, within the margin."""
        return self.fitted >= self.true - MARGIN

    @property
    def cause(self) -> str:
        """What is wrong with the fit, in words."""
        missed, invented = (set(a) - set(b) for a, b in self._both)
        if missed or invented:
            parts = [f"{word} {_named(pairs)}" for word, pairs in (("missed", missed), ("invented", invented)) if pairs]
            return f"collisions {', '.join(parts)}"
        if self.fitted_pairs != self.true_pairs:
            return "collisions in another order"
        if self.turned > WRONG_YAW:
            return f"a cube turned by {np.degrees(self.turned):.0f} degrees when it is first hit"
        return "right collisions and yaws, other values"

    @property
    def _both(self) -> tuple[tuple[tuple[tuple[int, int], ...], ...], ...]:
        return (self.true_pairs, self.fitted_pairs), (self.fitted_pairs, self.true_pairs)


def compare(truth: Truth, fit: MapFit) -> Comparison:
    """Compare a fit with the truth."""
    everything = full_likelihood(fit)
    lifted, true = lift(fit, everything), truth.point(everything)
    if fit.likelihood.model_error is not None:
        lifted = best_noise(everything, lifted)
    meeting = {body for point in (lifted, true) for pair in _pairs(everything, point) for body in pair}
    alone = set(range(len(truth.tracks.bodies))) - meeting
    unimportant = everything.coordinates.mask(MATTER, alone)
    lifted[unimportant] = true[unimportant] = everything.coordinates.prior_mean[unimportant]
    with torch.no_grad():
        values = everything.log_density(torch.from_numpy(np.stack([lifted, true])))
    return Comparison(
        *values.tolist(), _pairs(everything, lifted), _pairs(everything, true), _turned(truth, everything, lifted)
    )


def full_likelihood(fit: MapFit) -> Likelihood:
    """The fit's likelihood with the motion and the matter of every body among the unknowns, without a model error."""
    bodies = frozenset(range(len(fit.likelihood.tracks.bodies)))
    fitted = fit.likelihood
    coordinates = unknowns(fitted.tracks, fitted.model, Structure(bodies, bodies), fitted.noise)
    return replace(fitted, coordinates=coordinates, model_error=None)


def lift(fit: MapFit, everything: Likelihood) -> np.ndarray:
    """The fit in the vector of all unknowns."""
    point = everything.coordinates.prior_mean.copy()
    for place, entry in enumerate(fit.likelihood.coordinates.entries):
        point[everything.coordinates.places[entry.field, entry.owner]] = fit.point[place]
    return point


def _pairs(likelihood: Likelihood, point: np.ndarray) -> tuple[tuple[int, int], ...]:
    with torch.no_grad():
        return first_contacts(likelihood.rollout(torch.from_numpy(point[None])), 0)


def _turned(truth: Truth, likelihood: Likelihood, point: np.ndarray) -> float:
    """Largest error (rad, up to quarter turns) of the yaw of a cube in the last frame before it is first hit."""
    with torch.no_grad():
        angles = likelihood.rollout(torch.from_numpy(point[None])).trajectory[0, :, :, 2].numpy()
    errors = [0.0]
    for body, shape in enumerate(truth.scene.shapes):
        times = [time for time, *pair in truth.scene.contacts if body in pair]
        if shape is Shape.CUBE and times:
            frame = int(np.searchsorted(truth.tracks.times, min(times))) - 1
            error = angles[frame, body] - truth.states[frame, body, 4]
            errors.append(abs(error - np.pi / 2 * np.round(error / (np.pi / 2))))
    return float(max(errors))


def _named(pairs: set[tuple[int, int]]) -> str:
    return " and ".join(f"{first}-{second}" for first, second in sorted(pairs))
