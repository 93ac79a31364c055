"""From simulated worlds to what the player shows of them."""

import numpy as np

from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind
from vrdp_prob.models.simulator.rollout import Rollout
from vrdp_prob.report.content import Collisions, WorldContent, WorldKind


def world_content(rollout: Rollout, kind: WorldKind, body: str | None = None) -> WorldContent | None:
    """One world of the player; draws whose simulation broke off are left out, None where no draw is left.

    Parameters
    ----------
    rollout
        Posterior draws, simulated in this world.
    kind, body
        What was done to the world, and the id of the body that it was done to.
    """
    kept = np.flatnonzero(rollout.fine)
    if not len(kept):
        return None
    return WorldContent(
        kind,
        body,
        rollout.times.detach().numpy().astype(float),
        rollout.trajectory.detach().numpy()[kept].astype(float),
        rollout.exists.numpy()[kept],
        first_contacts(rollout.events, kept),
    )


def first_contacts(events: EventTable, worlds: np.ndarray) -> Collisions:
    """First contact of each pair of bodies in some worlds of a batch (integer array with axis `draw`), by draw."""
    met = events.of_kind(RolloutEventKind.COLLISION)
    met = met.where(np.isin(met.world, worlds))
    met = met.where(np.argsort(met.time, kind="stable"))
    pairs = np.column_stack([met.world, met.first, met.second])
    _, first = np.unique(pairs, axis=0, return_index=True)
    return Collisions(
        np.searchsorted(worlds, met.world[first]),
        met.time[first],
        pairs[first, 1:],
        met.point[first],
    )
