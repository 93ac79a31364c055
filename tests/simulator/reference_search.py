"""First contact of two outlines that move along known paths, by bounds on how fast their gap can change.

Between two samples h apart a gap stays above half their sum minus half of h times the fastest change. Where that is
above `GRAZING` nothing can happen; elsewhere the samples are refined, so nothing is missed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

GRAZING = 1e-4
"""Gap in m below which an approach that is no contact is in doubt, and least depth of a contact that is not."""
SPLIT = 8
FINEST = 1e-5
"""Length in s of the shortest interval that is split."""
Gap = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Found:
    """Time of a contact or of an approach that is in doubt; infinity where there is none."""

    contact: float = np.inf
    doubt: float = np.inf


NOTHING = Found()


def clear_from(gap: Gap, time: float, end: float) -> Found | float:
    """Time after a contact at which the gap has opened to twice GRAZING; in doubt where it closes before."""
    after = np.concatenate([[time], time + np.geomspace(1e-6, 0.5, 120)])
    gaps = gap(after)
    opened = np.flatnonzero(gaps > 2 * GRAZING)
    if not len(opened):
        return Found(doubt=time)
    if (np.diff(gaps[: opened[0] + 1]) < 0).any():
        return Found(doubt=time)
    return float(after[opened[0]]) if after[opened[0]] < end else NOTHING


def penetrates(gap: Gap, time: float) -> bool:
    """Whether two outlines that meet would enter each other by more than GRAZING if nothing held them."""
    after = gap(time + np.geomspace(1e-4, 0.1, 40))
    deep = np.flatnonzero(after < -GRAZING)
    return bool(len(deep) and (after[: deep[0]] < 0).all())


def first_contact(gap: Gap, low: np.ndarray, high: np.ndarray, fastest: float) -> Found:
    """First root of the gap in intervals [low, high] that are sorted and as long as each other or shorter."""
    shares = np.linspace(0, 1, SPLIT + 1)
    while len(low):
        times = low[:, None] + (high - low)[:, None] * shares
        values = gap(times)
        if values[0, 0] < 0:
            return Found(doubt=float(times[0, 0]))
        before, after = values[:, :-1].ravel(), values[:, 1:].ravel()
        length = np.repeat((high - low) / SPLIT, SPLIT)
        low, high = times[:, :-1].ravel(), times[:, 1:].ravel()
        crossing = (before > 0) & (after <= 0)
        keep = (before + after - fastest * length < 2 * GRAZING) | crossing
        if crossing.any():
            keep[np.flatnonzero(crossing)[0] + 1 :] = False
        low, high, before, after = low[keep], high[keep], before[keep], after[keep]
        if len(low) and length.max() <= FINEST:
            return _decide(gap, low, high, before, after)
    return NOTHING


def _decide(gap: Gap, low: np.ndarray, high: np.ndarray, before: np.ndarray, after: np.ndarray) -> Found:
    """The first run of adjacent intervals: a contact where the gap falls all along to a root, else in doubt."""
    breaks = np.flatnonzero(low[1:] - high[:-1] > FINEST / 2)
    last = int(breaks[0]) if len(breaks) else len(low) - 1
    run = slice(0, last + 1)
    if after[last] <= 0 and (after[run] < before[run]).all():
        return Found(contact=_root(gap, low[last], high[last], before[last], after[last]))
    return Found(doubt=float(low[0]))


def _root(gap: Gap, low: float, high: float, before: float, after: float) -> float:
    """Root in an interval in which the gap is almost straight, by three steps along secants."""
    for _ in range(3):
        middle = low + (high - low) * before / (before - after) if before > after else low
        value = float(gap(np.array([middle]))[0])
        if value > 0:
            low, before = middle, value
        else:
            high, after = middle, value
    return low if before < -after else high
