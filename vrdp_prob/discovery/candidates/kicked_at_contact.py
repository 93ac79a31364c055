"""Kicks that come with a contact of the kicked body, so that the contact could as well be another one."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.residuals.fitted_motion import REACH
from vrdp_prob.models.simulator.events import CONTACTS, EventTable, RolloutEventKind


def kicked_at_contact(events: EventTable, times: Float[np.ndarray, "frame"], bodies: Sequence[int]) -> bool:
    """Whether some bodies of a video meet something when one is kicked.

    Parameters
    ----------
    events
        What happens in the video.
    times
        Of its frames, in s.
    bodies
        The kicked bodies.
    """
    kicks = events.of_kind(RolloutEventKind.KICK).time
    meets = np.isin(events.kind, CONTACTS) & events.concerns(bodies)
    reach = REACH * float(np.median(np.diff(times)))
    return bool((np.abs(events.time[meets] - kicks[:, None]) < reach).any())
