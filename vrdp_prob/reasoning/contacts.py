"""Which bodies met, read off the tracks: a contact kicks both bodies at one time while they are in reach.

Greedy and Bayesian: the contact with the most evidence is taken first, and what it explains no longer speaks for
another one. The evidence for a contact is the Bayes factor of a kick in both tracks against none, averaged over the
times at which the two are near enough to touch. The two kicks are opposite, mostly along the line between the centres,
and differ in size as masses do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.special import expit, logsumexp

from vrdp_prob.inference.search.free_flight import contact_distances
from vrdp_prob.reasoning.smoother import BodyTrack, OneMoreKick, Smoother, fitted
from vrdp_prob.scene import Body, Shape

TIME_STEP = 0.01
"""Grid in s on which the time of a contact is sought."""

LEAST_TIMES = 3.0
"""Times of the grid at which two bodies are fully in reach when they meet, at least."""

DISTANCE_SD = 0.02
"""Standard deviation in m by which the distance of the centres in a contact differs from the sum of the radii."""

KICK_SIZES = (0.1, 0.4, 1.2)
"""Typical velocity changes in m/s along the line of the centres, equally probable beforehand."""

OPPOSITE = 0.85
"""Correlation of the two kicks: bodies whose masses differ by 50 % or so are kicked by as much less and more."""

SIDEWAYS = {True: 0.3, False: 0.6}
"""Size of a kick across the line of the centres, relative to along it, for two discs and where a cube takes part."""

ENOUGH_LOG_ODDS = 0.0
"""A contact is taken as seen, and explains the kicks around it, from these log odds on."""

PRIOR_LOG_ODDS = {True: 3.0, False: 1.5}
"""Log odds of a contact of two bodies that come in reach, for two discs and where a cube takes part.

Discs that come within 2 cm of contact either touch or miss by less than that: of all lines that a disc can take past
another, those that touch fill 0.8 m and those that miss so narrowly 0.04 m.
"""

AGAIN_LOG_ODDS = -4.0
"""Log odds of one more contact of two bodies that have met: they are in reach around every contact anyway."""

SHORTEST_PAUSE = 0.12
"""Time in s between two contacts of the same pair that are told apart."""

SLOWEST_APPROACH = 0.06
"""Bodies that meet come nearer to each other by at least so many m/s."""

EDGE = 0.1
"""A contact shows in the tracks only if both bodies were seen this long (s) before and after it."""

MOST_CONTACTS = 60


@dataclass(frozen=True)
class Contact:
    """A contact of two bodies.

    Parameters
    ----------
    first, second
        Places of the bodies, first < second.
    time
        Most probable time in s.
    log_odds
        Log odds that it happened.
    """

    first: int
    second: int
    time: float
    log_odds: float

    @property
    def probability(self) -> float:
        """That it happened."""
        return float(expit(self.log_odds))


@dataclass(frozen=True)
class SeenMotion:
    """What the tracks tell without physics.

    Parameters
    ----------
    smoothers
        The motion of each body.
    contacts
        Contacts that are taken as seen, in order of time, several of a pair among them.
    doubtful
        Best contact of each pair that has none, however improbable.
    """

    smoothers: tuple[Smoother, ...]
    contacts: tuple[Contact, ...]
    doubtful: tuple[Contact, ...]


def see(bodies: Sequence[Body], tracks: Sequence[BodyTrack]) -> SeenMotion:
    """Find the contacts in the tracks and fit the motion between them."""
    smoothers = fitted(tracks)
    start = min(track.times[0] for track in tracks)
    stop = max(track.times[-1] for track in tracks)
    grid = np.arange(start, stop + TIME_STEP / 2, TIME_STEP)
    more = [smoother.one_more(grid) for smoother in smoothers]
    pairs = [_Pair.of(bodies, tracks, pair, grid) for pair in combinations(range(len(bodies)), 2)]
    possible = [pair for pair in pairs if pair is not None]
    taken: list[Contact] = []
    best = {pair: pair.best_contact(more, grid, taken) for pair in possible}
    while len(taken) < MOST_CONTACTS:
        candidates = [contact for contact in best.values() if contact is not None]
        strongest = max(candidates, key=lambda contact: contact.log_odds, default=None)
        if strongest is None or strongest.log_odds < ENOUGH_LOG_ODDS:
            break
        taken.append(strongest)
        changed = {strongest.first, strongest.second}
        for body in changed:
            smoothers[body] = smoothers[body].with_kick(strongest.time)
            more[body] = smoothers[body].one_more(grid)
        for pair in possible:
            if changed & {pair.first, pair.second}:
                best[pair] = pair.best_contact(more, grid, taken)
    met = {(contact.first, contact.second) for contact in taken}
    doubtful = [contact for contact in best.values() if contact and (contact.first, contact.second) not in met]
    return SeenMotion(tuple(smoothers), tuple(sorted(taken, key=lambda contact: contact.time)), tuple(doubtful))


@dataclass(frozen=True)
class _Pair:
    """Two bodies that may meet: their places, the distances (m) at which they can touch, when both are seen."""

    first: int
    second: int
    reach: tuple[float, float]
    discs: bool
    start: int
    stop: int

    @classmethod
    def of(
        cls, bodies: Sequence[Body], tracks: Sequence[BodyTrack], places: tuple[int, int], grid: np.ndarray
    ) -> "_Pair | None":
        reach = contact_distances(*(bodies[place] for place in places))
        start = max(tracks[place].times[0] for place in places)
        stop = min(tracks[place].times[-1] for place in places)
        if reach is None or start >= stop:
            return None
        discs = all(bodies[place].shape is not Shape.CUBE for place in places)
        window = np.searchsorted(grid, [start + EDGE, stop - EDGE])
        if window[0] >= window[1]:
            return None
        return cls(*places, reach, discs, int(window[0]), int(window[1]))

    def best_contact(
        self,
        more: Sequence[OneMoreKick],
        grid: Float[np.ndarray, "time"],
        taken: Sequence[Contact],
    ) -> Contact | None:
        """The contact with the most evidence beside those taken; None where the two are never in reach."""
        chosen = slice(self.start, self.stop)
        times, one, other = grid[chosen], more[self.first].at(chosen), more[self.second].at(chosen)
        evidence, kicks = self._kicks(one, other)
        (place, speed), (other_place, other_speed) = one.kicked(kicks[:, :2]), other.kicked(kicks[:, 2:])
        apart = place - other_place
        fit = self._distance_fit(apart)
        allowed = fit > -8
        own = [contact.time for contact in taken if (contact.first, contact.second) == (self.first, self.second)]
        has_met = bool(own)
        for time in own:
            allowed &= np.abs(times - time) > SHORTEST_PAUSE
        allowed &= ((kicks[:, :2] - kicks[:, 2:]) * apart).sum(axis=1) > 0
        closing = -((speed - other_speed) * apart).sum(axis=1)
        allowed &= closing > SLOWEST_APPROACH * np.linalg.norm(apart, axis=1)
        if not allowed.any():
            return None
        times, score, fit = times[allowed], (evidence + fit)[allowed], fit[allowed]
        peak = int(score.argmax())
        window = np.abs(times - times[peak]) < SHORTEST_PAUSE
        # a pair that is in reach for a moment only, and hardly, has missed
        average = float(logsumexp(score[window]) - max(logsumexp(fit), np.log(LEAST_TIMES)))
        prior = AGAIN_LOG_ODDS if has_met else PRIOR_LOG_ODDS[self.discs]
        return Contact(self.first, self.second, float(times[peak]), average + prior)

    def _kicks(self, one: OneMoreKick, other: OneMoreKick) -> tuple[np.ndarray, np.ndarray]:
        """Log Bayes factor and best kicks (m/s; x and y of the first, then of the second body) at each time."""
        apart = one.position - other.position
        normal = apart / np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)
        along = normal[:, :, None] * normal[:, None, :]
        shape = along + SIDEWAYS[self.discs] ** 2 * (np.eye(2) - along)
        pair = np.array([[1, -OPPOSITE], [-OPPOSITE, 1]])
        prior = np.einsum("ab,kij->kaibj", pair, shape).reshape(-1, 4, 4)
        precision = np.repeat(np.stack([one.precision, other.precision], axis=1), 2, axis=1)
        pull = np.concatenate([one.pull, other.pull], axis=1)
        evidences, kicks = [], []
        for size in KICK_SIZES:
            covariance = size**2 * prior
            system = np.eye(4) + covariance * precision[:, None, :]
            kick = np.linalg.solve(system, covariance @ pull[:, :, None])[:, :, 0]
            evidences.append(0.5 * (pull * kick).sum(axis=1) - 0.5 * np.linalg.slogdet(system)[1])
            kicks.append(kick)
        weights = np.stack(evidences)
        total = logsumexp(weights, axis=0)
        average = np.einsum("sk,ski->ki", np.exp(weights - total), np.stack(kicks))
        return one.evidence + other.evidence + total - np.log(len(KICK_SIZES)), average

    def _distance_fit(self, apart: Float[np.ndarray, "time 2"]) -> Float[np.ndarray, "time"]:
        """Log density, up to a constant, of the distance in a contact: how far it is outside the possible ones."""
        distance = np.linalg.norm(apart, axis=1)
        outside = np.maximum(np.maximum(self.reach[0] - distance, distance - self.reach[1]), 0)
        return np.asarray(-0.5 * (outside / DISTANCE_SD) ** 2)
