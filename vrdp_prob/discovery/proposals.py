"""First guesses of causes that have no strength at which they vanish: what stands in the way, and spheres that slip.

Hidden things leave their mark where a body changes its velocity though nothing seen is near. The scan for kicks finds
these places; the change of the velocity is square to the surface that the body met.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import torch

from vrdp_prob.discovery.scores import CauseScore, Site
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.wall import Wall

MOST_SITES = 3
"""Kicks, the clearest first, that are tried as contacts with something unseen."""
RADII = (0.12, 0.25)
"""Radii in m with which a hidden disc is tried."""
EARLY = 0.004
"""Distance in m by which a hidden surface is put before the place of a kick, so that the fitted path meets it."""


def proposals(fit: SharedFit, scores: Sequence[CauseScore], catalogue: Sequence[Effect]) -> list[CauseScore]:
    """Starts of refits of causes that have no score.

    Parameters
    ----------
    fit
        Fit of a model without them.
    scores
        Scores of the other causes.
    catalogue
        Causes that are looked for.
    """
    kicks = next((one for one in scores if isinstance(one.effect, ExternalImpulse)), None)
    found = []
    for effect in catalogue:
        if isinstance(effect, (Wall, HiddenObstacle)) and kicks is not None:
            starts = [start for site in kicks.sites[:MOST_SITES] for start in _behind(fit, site, effect)]
            found += [_start(effect, start, kicks.p_value) for start in starts]
        elif not effect.vanishes_at:
            found += [
                _start(effect, start, 1.0)
                for start in effect.search_points([one.likelihood.tracks for one in fit.fits])
            ]
    return found


def _start(effect: Effect, start: Mapping[str, float], p_value: float) -> CauseScore:
    return CauseScore(effect, start, (), 0.0, 0, p_value, {})


def _behind(fit: SharedFit, site: Site, effect: Effect) -> list[dict[str, float]]:
    """What may have thrown a body back at the time of a kick."""
    body = site.owner
    assert body is not None
    video = fit.joint.videos[site.video]
    tracks = video.likelihood.tracks
    point = torch.from_numpy(fit.joint.point(site.video)[None])
    path = video.likelihood.predicted(point)[0, :, body, :2]
    time = site.values["impulse_time"]
    place = np.array([np.interp(time, tracks.times, path[:, axis]) for axis in range(2)])
    change = np.array([site.values["impulse_x"], site.values["impulse_y"]])
    into = -change / max(float(np.linalg.norm(change)), 1e-12)
    radius = tracks.bodies[body].radius or 0.0
    if isinstance(effect, Wall):
        distance = float(place @ into) + radius - EARLY
        return [{"hidden_wall_distance": distance, "hidden_wall_direction": math.atan2(into[1], into[0])}]
    centres = [(place + (radius + size - EARLY) * into, size) for size in RADII]
    return [{"obstacle_x": float(c[0]), "obstacle_y": float(c[1]), "obstacle_radius": size} for c, size in centres]
