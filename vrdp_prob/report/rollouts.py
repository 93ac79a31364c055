"""From the worlds that answers come from to what the player shows of them."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.timeline import WorldDraws
from vrdp_prob.reasoning.values import Change
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.report.content import Collisions, WorldContent, WorldKind
from vrdp_prob.scene import Tracks

MOST_FRAMES = 500
"""Most moments of a world that travel inside the page; longer recordings are thinned."""

_KINDS = {
    Change.REMOVED: WorldKind.REMOVED,
    Change.HEAVIER: WorldKind.HEAVIER,
    Change.LIGHTER: WorldKind.LIGHTER,
}


def player_worlds(worlds: PosteriorWorlds) -> tuple[WorldContent, ...]:
    """The video, what happens next, and the video with each body removed, heavier and lighter."""
    shown = [_factual(worlds), _simulated(worlds.future, WorldKind.FUTURE)]
    for change, kind in _KINDS.items():
        for place, body in enumerate(worlds.bodies):
            shown.append(_simulated(worlds.counterfactual(change, place), kind, body.id))
    return tuple(world for world in shown if world is not None)


def _factual(worlds: PosteriorWorlds) -> WorldContent | None:
    """Rollouts of the video, with the collisions that were seen in it; None where no draw could be simulated."""
    rollout = worlds.factual
    kept = np.flatnonzero(rollout.fine)
    if not len(kept):
        return None
    tracks = worlds.posterior.tracks
    chosen = _chosen(len(tracks.times))
    return WorldContent(
        WorldKind.FACTUAL,
        None,
        tracks.times[chosen],
        rollout.trajectory.numpy()[kept][:, chosen].astype(float),
        rollout.exists.numpy()[kept][:, chosen],
        collisions(worlds.events().select(kept), tracks.times, measured_course(tracks)[None]),
    )


def _simulated(world: WorldDraws, kind: WorldKind, body: str | None = None) -> WorldContent:
    chosen = _chosen(len(world.times))
    return WorldContent(
        kind,
        body,
        world.times[chosen],
        world.trajectory[:, chosen],
        world.exists[:, chosen],
        collisions(world.events, world.times, world.trajectory[..., :2]),
    )


def collisions(
    events: EventTable, times: Float[np.ndarray, "time"], positions: Float[np.ndarray, "draw time body 2"]
) -> Collisions:
    """Collisions of an event table; each is shown midway between its two bodies.

    Parameters
    ----------
    events
        What happens in each draw.
    times
        Times in s.
    positions
        Positions in m; one draw stands for all.
    """
    draws, places = np.nonzero(events.happens[:, events.universe.collisions])
    pairs = np.array(events.universe.pairs, dtype=int).reshape(-1, 2)[places]
    moments = events.time[:, events.universe.collisions][draws, places]
    frames = np.abs(times - moments[:, None]).argmin(axis=1) if len(moments) else np.zeros(0, dtype=int)
    rows = np.minimum(draws, len(positions) - 1)
    middle = positions[rows[:, None], frames[:, None], pairs].mean(axis=1)
    return Collisions(draws, moments, pairs, middle)


def measured_course(tracks: Tracks) -> Float[np.ndarray, "time body 2"]:
    """Measured positions in m with the gaps filled by straight lines, held still before and after."""
    course = tracks.positions
    for body, seen in enumerate(tracks.seen.T):
        for axis in range(2):
            course[:, body, axis] = np.interp(tracks.times, tracks.times[seen], course[seen, body, axis])
    return course


def _chosen(count: int) -> np.ndarray:
    """Indices of evenly chosen moments, the first and the last among them; integers with axis `kept`."""
    return np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int)
