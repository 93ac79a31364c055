"""A fit whose window grows in small steps, with fresh candidates where the video brings something new.

Growing matters more than the optimiser: a collision is only reached by a fit whose motion before it is right. At each
window with something new (a contact, a body that enters, a fit that got worse) many candidate worlds are drawn from
what is known so far, simulated in one batch, and the best are refined.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float

from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.free_flight import SeenContact
from vrdp_prob.inference.least_squares import Minimum, minimise, robust_cost
from vrdp_prob.inference.noise_fit import NOISE_FIELDS, best_noise
from vrdp_prob.inference.samples import Gaussian
from vrdp_prob.models.likelihood import Likelihood

CANDIDATES = 128
"""Worlds drawn where a window brings something new."""
REFINED = 3
"""Candidates that are refined after that."""
SPREADS = (0.3, 1.0, 2.0, 4.0)
"""Candidates are drawn from the Gaussian of the fit so far, wider by these factors."""
WIDEST = 2.0
"""...but no coordinate wanders further than so many prior standard deviations."""
HUBER = 4.0
"""Residuals beyond it (in units of the noise) pull less while the fit is not finished."""
WORSE = 1.3
"""A window whose new frames fit worse than this (root mean square in units of the noise) gets fresh candidates."""
GOOD_FIT = 1.1
"""No further candidate is refined once the mean squared residual is below this (in units of the noise)."""


class GrowingFit:
    """State of a fit while its window grows.

    Parameters
    ----------
    likelihood
        The density with everything that may matter among its unknowns.
    start
        First values: release states from local fits, the rest at the prior's mean.
    contacts
        Contacts seen in the tracks.
    generator
        Source of the candidates.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        start: Float[np.ndarray, "dimension"],
        contacts: Sequence[SeenContact],
        generator: np.random.Generator,
    ) -> None:
        self.likelihood, self.point = likelihood, start.copy()
        self._contacts, self._generator = contacts, generator
        self._coordinates = likelihood.coordinates
        self._noise_places = self._coordinates.mask(NOISE_FIELDS)
        self._idle_sd = self._coordinates.prior_sd.copy()
        self._precision = np.diag(self._idle_sd**-2)
        self._events: set[tuple[int, int]] = set()
        self.evaluations = 0
        self.converged = False

    def trust_release_fits(self, deviations: Mapping[int, tuple[float, float]]) -> None:
        """Take release positions (m) and velocities (m/s) as known that well until the window reaches the body."""
        for body, (position_sd, velocity_sd) in deviations.items():
            for field, sd in (
                ("x", position_sd),
                ("y", position_sd),
                ("velocity_x", velocity_sd),
                ("velocity_y", velocity_sd),
            ):
                place = self._coordinates.places.get((field, body))
                if place is not None:
                    self._idle_sd[place] = sd
        self._precision = np.diag(self._idle_sd**-2)

    def grow(self, frame_count: int, previous: int) -> None:
        """Fit the first frames, starting from the fit of fewer."""
        active = self._active(frame_count)
        candidates = self.point[None]
        if self._news(frame_count, previous):
            candidates = np.concatenate([candidates, self._candidates(active, previous, frame_count)])
        self._refine(candidates, frame_count, active)

    def finish(self, rounds: int = 4) -> None:
        """Refine on all frames with plain least squares, the noise scale in turn with the rest."""
        frame_count = len(self.likelihood.tracks.times)
        for _ in range(rounds):
            self.point = best_noise(self.likelihood, self.point)
            before = self.point
            active = self._active(frame_count)
            self._refine(self.point[None], frame_count, active, iterations=12, threshold=None, tolerance=1e-3)
            if np.abs((self.point - before) / self._coordinates.scale).max() < 1e-3:
                break

    def _active(self, frame_count: int) -> Bool[np.ndarray, "dimension"]:
        """Coordinates that can matter in the first frames."""
        tracks = self.likelihood.tracks
        released = np.flatnonzero(tracks.seen[:frame_count].any(axis=0)).tolist()
        last = float(tracks.times[frame_count - 1])
        seen = {body for contact in self._contacts if contact.time <= last for body in (contact.first, contact.second)}
        touched = seen | {body for pair in self._events for body in pair}
        owners = [entry.owner for entry in self._coordinates.entries]
        fields = [entry.field for entry in self._coordinates.entries]
        contact_fields = {"angle", "mass", "restitution"}
        active = [
            owner is None or field == "wall_restitution" or owner in (touched if field in contact_fields else released)
            for owner, field in zip(owners, fields, strict=True)
        ]
        return np.array(active, dtype=bool) & ~self._noise_places

    def _news(self, frame_count: int, previous: int) -> bool:
        """Whether the added frames bring something that the fit so far cannot know."""
        tracks = self.likelihood.tracks
        start, stop = float(tracks.times[max(previous - 3, 0)]), float(tracks.times[frame_count - 1])
        if any(start <= contact.time <= stop for contact in self._contacts):
            return True
        pairs = self._pairs(frame_count)
        if pairs - self._events:
            self._events |= pairs
            return True
        residuals = self.likelihood.residuals(self.point[None], frame_count)[0]
        new = self._added(frame_count, previous)
        added = residuals[: len(new)][new]
        return not np.isfinite(added).all() or (len(added) > 0 and float(np.sqrt(np.mean(added**2))) > WORSE)

    def _added(self, frame_count: int, previous: int) -> Bool[np.ndarray, "residual"]:
        """Which position residuals of a window are new."""
        frames = self.likelihood.observations.frame
        return np.repeat(frames[frames < frame_count] >= previous, 2)

    def _candidates(
        self, active: Bool[np.ndarray, "dimension"], previous: int, frame_count: int
    ) -> Float[np.ndarray, "candidate dimension"]:
        """Worlds drawn from what is known so far, half of them with the collisions that local fits suggest."""
        places = np.flatnonzero(active)
        gaussian = Gaussian.from_precision(self.point[places], self._precision[np.ix_(places, places)])
        normal = self._generator.standard_normal((CANDIDATES, len(places)))
        spreads = np.resize(np.array(SPREADS), CANDIDATES)[:, None]
        widest = WIDEST * self._coordinates.prior_sd[places]
        moves = np.clip(spreads * (normal @ gaussian.root.T), -widest, widest)
        candidates = np.tile(self.point, (CANDIDATES, 1))
        candidates[:, places] += moves
        tracks = self.likelihood.tracks
        start, stop = float(tracks.times[max(previous - 3, 0)]), float(tracks.times[frame_count - 1])
        for contact in self._contacts:
            if start <= contact.time <= stop:
                self._suggest(candidates[::2], contact)
        return candidates

    def _suggest(self, candidates: Float[np.ndarray, "candidate dimension"], contact: SeenContact) -> None:
        """Move masses and restitutions of candidates towards what momentum balance says of a contact, in place."""
        variance = 1 / np.diag(self._precision)
        for field, sign, target in (
            ("mass", -1.0, np.log(contact.mass_ratio)),
            ("restitution", 1.0, np.log(contact.restitution)),
        ):
            first, second = (self._coordinates.places.get((field, body)) for body in (contact.first, contact.second))
            if first is None or second is None:
                continue
            missing = target - (candidates[:, first] + sign * candidates[:, second])
            share = variance[first] / (variance[first] + variance[second])
            candidates[:, first] += share * missing
            candidates[:, second] += sign * (1 - share) * missing

    def _refine(
        self,
        candidates: Float[np.ndarray, "candidate dimension"],
        frame_count: int,
        active: Bool[np.ndarray, "dimension"],
        *,
        iterations: int = 6,
        threshold: float | None = HUBER,
        tolerance: float = 0.05,
    ) -> None:
        """Refine the best candidates and keep the best result."""
        chosen = candidates
        if len(candidates) > 1:
            costs = robust_cost(self.likelihood.residuals(candidates, frame_count), threshold)
            self.evaluations += len(candidates)
            order = np.argsort(costs)[:REFINED].tolist()
            chosen = candidates[order if 0 in order else [*order, 0]]
        best: Minimum | None = None
        for start in chosen:
            minimum = minimise(
                lambda points: self.likelihood.residuals(points, frame_count),
                start,
                self._coordinates.scale,
                active=active,
                iterations=iterations,
                tolerance=tolerance,
                threshold=threshold,
            )
            self.evaluations += minimum.evaluations
            if best is None or minimum.cost < best.cost:
                best = minimum
            if best.cost < GOOD_FIT * len(best.jacobian) / 2:
                break
        if best is None or not np.isfinite(best.cost):
            return
        self.point, self.converged = best.point, best.converged
        self._events |= self._pairs(frame_count)
        self._precision = best.jacobian.T @ best.jacobian
        diagonal = np.arange(len(active))
        self._precision[diagonal, diagonal] = np.maximum(np.diag(self._precision), self._coordinates.prior_sd**-2)
        idle = np.flatnonzero(~active)
        self._precision[idle, idle] = self._idle_sd[idle] ** -2

    def _pairs(self, frame_count: int) -> set[tuple[int, int]]:
        with torch.no_grad():
            rollout = self.likelihood.rollout(torch.from_numpy(self.point[None]), frame_count)
        return set(first_contacts(rollout, 0))
