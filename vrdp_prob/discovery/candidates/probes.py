"""What a faint cause would do to the residuals of a fit, found by simulating worlds with a little of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.discovery.residuals.residual_model import Noise
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.linking import Key, shared_key
from vrdp_prob.inference.several_videos.parts import plain_likelihood
from vrdp_prob.models.coordinates import Coordinate
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Transform

STEP = 1e-4
"""Size of a probe in standard deviations of the strength's prior."""
AT_ONCE = 1024
"""Worlds that are simulated side by side."""
JUMP = 1.5
"""Ratio of the changes to both sides from which on one of them has met another course of events."""
FAINT = 1e-5
"""Size of a positive strength that vanishes at 0, as a share of its prior median."""


@dataclass(frozen=True)
class Probe:
    """What one strength does to the data's residuals of a video.

    Parameters
    ----------
    key
        What the strength is shared as among videos; None where it is the video's own.
    owner
        Body that it belongs to, None where it is the video's.
    field
        Name of the parameter.
    directions
        Derivative of the residuals by the strength where it vanishes, one row for every search point.
    """

    key: Key | None
    owner: int | None
    field: str
    directions: Float[np.ndarray, "point data"]


def probes(
    fit: SharedFit, index: int, noise: Noise, effect: Effect, points: Sequence[Mapping[str, float]]
) -> list[Probe]:
    """Probe one video for a cause at search points.

    Parameters
    ----------
    fit
        Fit of a model without the cause.
    index
        Which video.
    noise
        Its fitted noise.
    effect
        The cause.
    points
        Values of its parameters where it is looked for.
    """
    part, video = fit.fits[index], fit.joint.videos[index]
    likelihood = plain_likelihood(part.clues, fit.extended(effect), fit.structures[index])
    entries = likelihood.coordinates.entries
    start = video.likelihood.coordinates.carried(fit.joint.point(index), likelihood.coordinates)
    vanishing = fit.vanishing([effect])
    strengths = {
        place: _Difference.of(entry, vanishing[entry.field])
        for place, entry in enumerate(entries)
        if entry.field in vanishing
    }
    if not strengths or not points:
        return []
    batch = []
    for values in points:
        base = start.copy()
        for place, entry in enumerate(entries):
            if entry.field in values:
                base[place] = entry.transform.to_coordinate(values[entry.field])
        for place, strength in strengths.items():
            base[place] = strength.coordinates[1]
        for place, strength in strengths.items():
            moved = np.tile(base, (3, 1))
            moved[:, place] = strength.coordinates
            batch.append(moved)
    worlds = torch.from_numpy(np.concatenate(batch))
    parts = [worlds[first : first + AT_ONCE] for first in range(0, len(worlds), AT_ONCE)]
    residuals = np.concatenate([noise.linear(likelihood.discrepancies(part)) for part in parts])
    residuals = residuals.reshape(len(points), len(strengths), 3, -1)
    found = []
    for number, (place, strength) in enumerate(strengths.items()):
        entry = entries[place]
        directions = _derivative(residuals[:, number], strength.distance)
        found.append(Probe(shared_key(entry, likelihood.tracks), entry.owner, entry.field, directions))
    return found


def _derivative(residuals: Float[np.ndarray, "point 3 data"], distance: float) -> Float[np.ndarray, "point data"]:
    """Derivative by differences; where a contact happens or fails to on one side, that of the other side."""
    sides = np.diff(residuals, axis=1) / distance
    sides = np.where(np.isfinite(sides), sides, 0.0)
    sizes = np.linalg.norm(sides, axis=2)
    alike = sizes.max(axis=1) < JUMP * sizes.min(axis=1)
    smaller = sides[np.arange(len(sides)), sizes.argmin(axis=1)]
    derivative: np.ndarray = np.where(alike[:, None], sides.mean(axis=1), smaller)
    return derivative


@dataclass(frozen=True)
class _Difference:
    """Three coordinates at which the residuals are compared, and the distance of neighbouring values."""

    coordinates: tuple[float, float, float]
    distance: float

    @classmethod
    def of(cls, entry: Coordinate, vanishing: float) -> "_Difference":
        if entry.transform is Transform.LOG and vanishing == 0.0:
            faint = FAINT * math.exp(entry.prior.mean)
            return cls((math.log(faint), math.log(2 * faint), math.log(3 * faint)), faint)
        middle, step = entry.transform.to_coordinate(vanishing), STEP * entry.prior.sd
        per_value = vanishing if entry.transform is Transform.LOG else 1.0
        return cls((middle - step, middle, middle + step), step * per_value)
