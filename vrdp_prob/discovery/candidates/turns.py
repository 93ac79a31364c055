"""Places where bodies turn at once though they meet nothing that is seen, from the tracks alone.

A fit without what bodies bounce off loses its way at the first turn, and then says nothing of those after it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.free_flight import SHIFTS, SMALLEST_JUMP, SPAN, Kink, kink
from vrdp_prob.scene import Tracks

SIGNIFICANT = 6.0
"""Standard deviations of a change of the velocity from which on it is one, wherever it was looked for."""
AROUND = 2.5
"""Frames around an approach of two bodies in which nothing is said of either."""
CLEAR = 1.5
"""Frames between two events and what is fitted to the motion between them."""
GRAZING = 0.1
"""Share of the speed below which a velocity along which a body turned tells no surface: bodies sway, rails guide."""
FITTING = 3.0
"""Mean square that a turn may leave, in that of the noise: what bends faster than its pieces can follow is none."""
REACHED = 1.2
"""Distance from a stated wall, in that of the body's centre from its edge, within which the body has met the wall."""


@dataclass(frozen=True)
class Turn:
    """A body that turned, though it met nothing that is seen.

    Parameters
    ----------
    place
        Where its centre was, x and y in m.
    into
        Direction in which its velocity was taken: a unit vector, which points at what it met if that does not rub.
    direction_sd
        Standard deviation in rad of that direction.
    least, most
        Smallest and largest distance in m from its centre to its edge; 0 where its radius is not stated.
    place_sd
        Noise in m of its positions.
    """

    place: Float[np.ndarray, "2"]
    into: Float[np.ndarray, "2"]
    direction_sd: float
    least: float
    most: float
    place_sd: float


def sudden_turns(videos: Sequence[Tracks]) -> list[Turn]:
    """All sudden turns that some videos show, the plainest first."""
    found = [pair for some in in_processes(_of_video, videos) for pair in some]
    return [one for _, one in sorted(found, key=lambda pair: -pair[0])]


def _of_video(video: Tracks) -> list[tuple[float, Turn]]:
    """Sudden turns of one video, and how many standard deviations each of them is."""
    clues = Clues.of(video)
    tracks, turned = clues.clean, []
    if len(tracks.bodies) > 1 and any(body.radius is None for body in tracks.bodies):
        return []  # nothing says where these meet each other
    for index, body in enumerate(tracks.bodies):
        least = body.radius or 0.0
        most = least * body.shape.reach
        for found in _kinks(clues, index):
            size = float(np.linalg.norm(found.jump))
            into = -found.jump / size
            arriving = float(found.before @ into)
            near_seen = any(wall.distance(found.position) < REACHED * most + 4 * clues.noise for wall in tracks.walls)
            grazing = arriving < GRAZING * float(np.linalg.norm(found.before))
            if not grazing and 0 < arriving < size and not near_seen:
                one = Turn(found.position, into, found.jump_sd / size, least, most, clues.noise)
                turned.append((size / found.jump_sd, one))
    return turned


def _kinks(clues: Clues, body: int) -> list[Kink]:
    """Sudden changes of the velocity of a body where no other one is near, each beside all others."""
    tracks, noise = clues.clean, clues.noise
    step = float(np.median(np.diff(tracks.times)))
    meetings = [one.time for one in clues.approaches if body in (one.first, one.second)]
    alone = [at for at in tracks.times.tolist() if all(abs(at - time) > AROUND * step for time in meetings)]
    turns: list[float] = []

    def fitted(at: float, around: float, events: Sequence[float]) -> Kink | None:
        """The kink at a time, by the motion between the events before and after another time."""
        start = max((time + CLEAR * step for time in events if time < around), default=-np.inf)
        stop = min((time - CLEAR * step for time in events if time >= around), default=np.inf)
        return kink(tracks, body, at, noise, start=start, stop=stop)

    def best(around: float, events: Sequence[float]) -> tuple[float, Kink]:
        """The kink about a time that fits best, and when it is."""
        moved = [(at, one) for at in around + step * SHIFTS if (one := fitted(at, around, events)) is not None]
        return min(moved, key=lambda pair: pair[1].misfit)

    kinks = {at: fitted(at, at, meetings) for at in alone}
    while plain := [(at, one) for at, one in kinks.items() if one is not None and _is_plain(one)]:
        around = max(plain, key=lambda pair: float(np.linalg.norm(pair[1].jump)) / pair[1].jump_sd)[0]
        event, _ = best(around, [*meetings, *turns])
        turns.append(event)
        near = [at for at in alone if abs(at - event) < SPAN + CLEAR * step]
        kinks |= {at: fitted(at, at, [*meetings, *turns]) for at in near}
    found = []
    for event in turns:
        others = [*meetings, *(one for one in turns if one != event)]
        if fitted(event, event, others) is not None:
            found.append(best(event, others)[1])
    return [one for one in found if _is_plain(one) and one.misfit < FITTING * noise**2 * 2 * one.count]


def _is_plain(found: Kink) -> bool:
    """Whether a change of the velocity is beyond chance, and no trifle."""
    size = float(np.linalg.norm(found.jump))
    return size > max(SIGNIFICANT * found.jump_sd, SMALLEST_JUMP * float(np.linalg.norm(found.before)))
