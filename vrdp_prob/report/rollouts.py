"""From the worlds that answers come from to what the player shows of them."""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.answer import monte_carlo_error
from vrdp_prob.reasoning.changes import BUILT_IN
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.timeline import WorldDraws
from vrdp_prob.reasoning.vocabulary import ChangeWord
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.report.content import FACTUAL, FUTURE, Collisions, PairShare, WorldContent
from vrdp_prob.scene import Tracks
from vrdp_prob.spread import evenly_spread

MOST_FRAMES = 500
"""Most moments of a world that travel inside the page; longer recordings are thinned."""


def player_worlds(
    few: PosteriorWorlds,
    *,
    asked: Collection[str] = (),
    many: PosteriorWorlds | None = None,
    words: Sequence[ChangeWord] = (),
) -> tuple[WorldContent, ...]:
    """The video, what happens next, and the video with each body removed, heavier, lighter, and as learned words say.

    Parameters
    ----------
    few
        As many draws as are shown.
    asked, many
        Keys of the worlds that answers come from, and the draws that these were counted in: such a world is shown by an
        even choice of those, and its probabilities are theirs.
    words
        Learned words, which may redefine built-in ones.
    """
    count = few.draws
    first = _factual(many or few, count)
    shown = [first] if first is not None else []
    source = _source(FUTURE, few, asked, many)
    shown.append(_simulated(source.future, source.effective_draws, count, FUTURE))
    changes = {change.word: change for change in (*BUILT_IN, *(word.change for word in words))}
    for kind, change in changes.items():
        for place, body in enumerate(few.bodies):
            source = _source(f"{kind}:{body.id}", few, asked, many)
            world = source.counterfactual(change, place)
            shown.append(_simulated(world, source.effective_draws, count, kind, body.id))
    return tuple(shown)


def _source(key: str, few: PosteriorWorlds, asked: Collection[str], many: PosteriorWorlds | None) -> PosteriorWorlds:
    return many if many is not None and key in asked else few


def _factual(worlds: PosteriorWorlds, count: int) -> WorldContent | None:
    """Rollouts of the video, with the collisions that were seen in it; None where no draw could be simulated."""
    rollout = worlds.factual
    fine = np.flatnonzero(rollout.fine)
    if not len(fine):
        return None
    tracks = worlds.posterior.tracks
    draws, frames = fine[evenly_spread(count, len(fine))], evenly_spread(MOST_FRAMES, len(tracks.times))
    return WorldContent(
        FACTUAL,
        None,
        tracks.times[frames],
        rollout.trajectory.numpy()[draws][:, frames].astype(float),
        rollout.exists.numpy()[draws][:, frames],
        collisions(worlds.events().select(draws), tracks.times, measured_course(tracks)[None]),
        pair_shares(worlds.events(), worlds.effective_draws),
    )


def _simulated(
    world: WorldDraws, effective_draws: float, count: int, kind: str, body: str | None = None
) -> WorldContent:
    draws, frames = evenly_spread(count, len(world.trajectory)), evenly_spread(MOST_FRAMES, len(world.times))
    return WorldContent(
        kind,
        body,
        world.times[frames],
        world.trajectory[draws][:, frames],
        world.exists[draws][:, frames],
        collisions(world.events.select(draws), world.times, world.trajectory[draws][..., :2]),
        pair_shares(world.events, effective_draws),
    )


def pair_shares(events: EventTable, effective_draws: float) -> tuple[PairShare, ...]:
    """The pairs that collide in some draw, in the order of their median times.

    Parameters
    ----------
    events
        What happens in each draw.
    effective_draws
        Number of independent draws that these are worth.
    """
    met = []
    for place, pair in enumerate(events.universe.pairs):
        happens = events.happens[:, place]
        if happens.any():
            share, time = float(happens.mean()), float(np.median(events.time[happens, place]))
            met.append(PairShare(pair, share, time, monte_carlo_error(share, effective_draws)))
    return tuple(sorted(met, key=lambda one: one.time))


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
