"""Kicks that come with a contact of the kicked body, so that the contact could as well be another one."""

from collections.abc import Collection

import numpy as np

from vrdp_prob.discovery.fitted_motion import REACH
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.models.simulator.events import CONTACTS, RolloutEventKind


def kicked_at_contact(part: MapFit, bodies: Collection[int]) -> bool:
    """Whether some bodies of a video meet something when the fit kicks one.

    Parameters
    ----------
    part
        Fit of the video under a model with a kick.
    bodies
        The kicked bodies.
    """
    events, tracks = part.rollout.events, part.likelihood.tracks
    kicks = events.of_kind(RolloutEventKind.KICK).time
    meets = np.isin(events.kind, CONTACTS) & events.concerns(bodies)
    reach = REACH * float(np.median(np.diff(tracks.times)))
    return bool((np.abs(events.time[meets] - kicks[:, None]) < reach).any())
