"""First guesses of hidden things that stand in the way of bodies.

They leave their mark where a body changes its velocity though it meets nothing seen. A fit with kicks finds these
places; the change of the velocity is square to the surface that the body met.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.candidates.kicked_at_contact import kicked_at_contact
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.places import Region
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.parameters import RESTITUTION

MOST_KICKS = 3
"""Kicks, the strongest first, from which hidden things are guessed."""
RADII = (0.04, 0.08)
"""Radii with which a hidden disc is tried, in half widths of the region where bodies were seen."""
SLOWEST = 0.02
"""Speed in m/s across a surface below which nothing is said of its restitution."""
EARLY = 0.001
"""Distance in m by which a surface is put before the place of a kick, so that the body is sure to meet it."""


def hidden_things(kicked: SharedFit, catalogue: Sequence[Effect]) -> list[FirstGuess]:
    """Starts of refits in which something unseen did what a fit puts down to kicks.

    Parameters
    ----------
    kicked
        Fit of a model with kicks.
    catalogue
        Causes that are looked for.
    """
    return [
        FirstGuess(effect, start)
        for effect in catalogue
        if isinstance(effect, Wall | HiddenObstacle)
        for kick in _kicks(kicked)
        for start in _surfaces(kicked, kick, effect)
    ]


@dataclass(frozen=True)
class _Kick:
    """A change (m/s) of the velocity of a body of a video at a time (s)."""

    video: int
    body: int
    time: float
    change: Float[np.ndarray, "2"]


def _kicks(fit: SharedFit) -> list[_Kick]:
    """The kicks of a fit that come with no contact, the strongest first."""
    found = []
    for index, video in enumerate(fit.joint.videos):
        places, point = video.likelihood.coordinates.places, fit.joint.point(index)
        events, times = fit.fits[index].rollout.events, video.likelihood.tracks.times
        for field, body in places:
            if field == "impulse_x" and body is not None and not kicked_at_contact(events, times, [body]):
                change = point[[places["impulse_x", body], places["impulse_y", body]]]
                found.append(_Kick(index, body, float(point[places["impulse_time", None]]), change))
    return sorted(found, key=lambda one: -float(np.linalg.norm(one.change)))[:MOST_KICKS]


def _surfaces(fit: SharedFit, kick: _Kick, effect: Wall | HiddenObstacle) -> Iterator[dict[str, float]]:
    """What may have thrown a body back."""
    video = fit.joint.videos[kick.video]
    tracks = video.likelihood.tracks
    path = video.likelihood.predicted(torch.from_numpy(fit.joint.point(kick.video)[None]))[0, :, kick.body, :2]
    before = int(np.clip(np.searchsorted(tracks.times, kick.time) - 1, 1, len(tracks.times) - 1))
    velocity = (path[before] - path[before - 1]) / (tracks.times[before] - tracks.times[before - 1])
    place = path[before] + velocity * (kick.time - tracks.times[before])
    into = -kick.change / max(float(np.linalg.norm(kick.change)), 1e-12)
    arriving = float(velocity @ into)
    leaving = float(np.linalg.norm(kick.change)) - arriving
    factor = RESTITUTION.default
    if arriving > SLOWEST:
        factor = float(np.clip(leaving / arriving / RESTITUTION.default, 0.05, 0.95))
    radius = (tracks.bodies[kick.body].radius or 0.0) - EARLY
    if isinstance(effect, Wall):
        yield effect.start(float(place @ into) + radius, math.atan2(into[1], into[0]), factor)
        return
    unit = Region.of(fit.tracks).half_width
    for size in (share * unit for share in RADII):
        x, y = place + (radius + size) * into
        yield effect.start((float(x), float(y)), size, factor)
