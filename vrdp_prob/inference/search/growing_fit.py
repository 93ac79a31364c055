"""Explanations of a video whose window grows in small steps.

Growing matters more than the optimiser: a collision is only reached by a fit whose motion before it is right. Where a
window brings something new many candidate worlds are simulated in one batch and the best are refined; once a contact is
some frames old, other explanations of it are tried. What remains nearly as good is followed on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Float

from vrdp_prob.inference.search.alternatives import Encounter, alternatives, suggest
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.encounters import EncounterFinder, contacts_in, hard_to_explain
from vrdp_prob.inference.search.events import first_contacts
from vrdp_prob.inference.search.hypothesis import Hypothesis, distances, turned_least, yaw_places
from vrdp_prob.inference.search.least_squares import Minimum, robust_cost
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.inference.search.standstill import first_false_stop, moving_on
from vrdp_prob.models.likelihood import Likelihood

CANDIDATES = 64
"""Worlds drawn where a window brings something new."""
REFINED, MOST_REFINED = 2, 10
"""Candidates that are refined after that, and that are at most, where all before is explained and what was refined is
not, and differs."""
ALIKE = 10.0
"""Nats by which refined candidates differ at most that have found the same explanation."""
SPREADS = (0.3, 1.0, 2.0, 4.0)
"""Candidates are drawn from the Gaussian of the fit so far, wider by these factors."""
WIDEST = 2.0
"""...but no coordinate wanders further than so many prior standard deviations."""
HUBER = 4.0
"""Residuals beyond it (in units of the noise) pull less while the fit is not finished."""
QUIET = 1.15
"""A window is taken as it comes while its new frames fit better than this (root mean square over the noise)..."""
MOST_UNREFINED = 2
"""...at most so often in a row."""
WORSE = 1.3
"""A window whose new frames fit worse than this gets fresh candidates."""
EXPLAINS_SO_FAR = 1.3
"""A fit explains the frames so far up to this factor on the cost that noise alone would make."""
GOOD_FIT = 1.1
"""No further candidate is refined once the mean squared residual is below this (in units of the noise)."""
FOLLOWED = 4
"""Explanations that are followed at most."""
NEARLY = 15.0
"""...as long as they are not so many nats worse than the best."""
SAME = 3.0
"""Explanations that are no further apart (standard deviations) are the same."""
CONTACT_FIELDS = ("angle", "mass", "restitution")
"""What of a body only contacts tell."""


class GrowingFit:
    """Explanations of the first frames, the best one first.

    `doubtful` says whether several cubes with open yaws met, or contacts are hard to explain, where the search may well
    have gone astray.

    Parameters
    ----------
    likelihood
        The density with everything that may matter among its unknowns.
    start
        First values: release states from local fits, the rest at the prior's mean.
    clues
        What shows in the tracks.
    generator
        Source of the candidates.
    plan
        How starts are refined, and whether there are several.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        start: Float[np.ndarray, "dimension"],
        clues: Clues,
        generator: np.random.Generator,
        plan: FitPlan,
    ) -> None:
        self.likelihood, self._plan = likelihood, plan
        self._descent = Descent(likelihood, plan.optimiser)
        self._clues, self._generator = clues, generator
        self._coordinates = likelihood.coordinates
        self._noise_places = self._coordinates.mask(NOISE_FIELDS)
        self._idle_sd = self._coordinates.prior_sd.copy()
        self._finder = EncounterFinder(likelihood, clues)
        self.hypotheses = [Hypothesis(start, np.inf, np.diag(self._idle_sd**-2))]
        self.doubtful = False
        self.evaluations = 0

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
        self.hypotheses = [replace(one, precision=np.diag(self._idle_sd**-2)) for one in self.hypotheses]

    def fit_free_flight(self) -> None:
        """Find release states and friction from the frames before the first contact of each body."""
        tracks, observations = self.likelihood.tracks, self.likelihood.observations
        until = np.array([self._clues.first_contact(body) for body in range(len(tracks.bodies))])
        free = tracks.times[observations.frame] < until[observations.body]
        turning = tracks.times[observations.angle_frame] < until[observations.angle_body]
        weights = np.concatenate([np.repeat(free, 2), turning]).astype(float)
        active = ~(self._noise_places | self._coordinates.mask(CONTACT_FIELDS))
        (best,) = self.hypotheses
        count = self.likelihood.residuals(best.point[None]).shape[1]
        weights = np.concatenate([weights, np.ones(count - len(weights))])
        (minimum,) = self._descent(best.point[None], active, weights=weights, iterations=10, threshold=HUBER)
        self.evaluations += minimum.evaluations
        if np.isfinite(minimum.cost):
            self.hypotheses = [replace(best, point=minimum.point)]

    def grow(self, frame_count: int, previous: int) -> None:
        """Explain the first frames, starting from what explains fewer."""
        self.hypotheses = [one if one.earlier else one.noted(-np.inf) for one in self.hypotheses]
        self._keep([self._followed(one, frame_count, previous) for one in self.hypotheses], frame_count)
        if not self._plan.alternatives:
            return
        self._move_on(frame_count, previous)
        for encounter in self._finder.due(self.hypotheses[0], frame_count):
            self.doubtful |= encounter.puzzling and len(yaw_places(self.likelihood, encounter.bodies)) > 1
            self._explain_otherwise(encounter, frame_count)
        if frame_count == len(self.likelihood.tracks.times):
            contacts = contacts_in(self.likelihood, self.hypotheses[0], frame_count)
            self.doubtful |= hard_to_explain(contacts, self.likelihood.tracks.first_seen)

    def _explain_otherwise(self, encounter: Encounter, frame_count: int) -> None:
        """Look for other explanations of an encounter, beside the best one so far."""
        best = self.hypotheses[0]
        active = self._active(frame_count, encounter.bodies)
        found = alternatives(
            self._descent, best, encounter, frame_count, active, threshold=HUBER, generator=self._generator
        )
        self._keep_beside(best, found, active, frame_count)

    def _move_on(self, frame_count: int, previous: int) -> None:
        """Look for other explanations where a body stands still in the best one so far, and is seen to move."""
        best = self.hypotheses[0]
        stop = first_false_stop(self.likelihood, best, frame_count, previous)
        if stop is None:
            return
        active = self._active(frame_count)
        found = moving_on(self._descent, best, stop, frame_count, active, threshold=HUBER)
        self._keep_beside(best, found, active, frame_count)

    def _keep_beside(
        self, best: Hypothesis, found: Sequence[Minimum], active: Bool[np.ndarray, "dimension"], frame_count: int
    ) -> None:
        """Keep the best of what is known and of other explanations than the best one."""
        self.evaluations += sum(one.evaluations for one in found)
        self._keep([*self.hypotheses, *(self._refined(best, one, active, frame_count) for one in found)], frame_count)

    def _keep(self, hypotheses: Sequence[Hypothesis], frame_count: int) -> None:
        """Keep the best explanations that differ, with their yaws near zero."""
        kept = merged(self.likelihood, hypotheses, frame_count)
        end = float(self.likelihood.tracks.times[frame_count - 1])
        expected = self.expected_cost(frame_count)
        self.hypotheses = [
            replace(
                one, point=turned_least(self.likelihood, one.point), explains=one.cost < EXPLAINS_SO_FAR * expected
            ).noted(end)
            for one in kept
        ]

    def expected_cost(self, frame_count: int) -> float:
        """Cost of the first frames that noise alone would make."""
        observations = self.likelihood.observations.until(frame_count)
        return len(observations.frame) + len(observations.angle) / 2

    def _followed(self, hypothesis: Hypothesis, frame_count: int, previous: int) -> Hypothesis:
        """An explanation on a larger window; refined unless nothing has happened that it does not know."""
        residuals = self.likelihood.residuals(hypothesis.point[None], frame_count)[0]
        pairs = self._pairs(hypothesis.point, frame_count)
        self.evaluations += 2
        new = self._added(frame_count, previous)
        added = residuals[: len(new)][new]
        deviation = float(np.sqrt(np.mean(added**2))) if len(added) else 0.0
        contact = self._contact_within(frame_count, previous)
        entered = self._entered(frame_count, previous)
        known = pairs == hypothesis.pairs and not contact and not entered
        last = frame_count == len(self.likelihood.tracks.times)
        if known and not last and deviation < QUIET and hypothesis.unrefined < MOST_UNREFINED:
            cost = float(robust_cost(residuals, HUBER))
            return replace(hypothesis, cost=cost, unrefined=hypothesis.unrefined + 1)
        surprise = contact or bool(set(pairs) - set(hypothesis.pairs)) or not deviation <= WORSE
        hypothesis = replace(hypothesis, pairs=pairs)
        active = self._active(frame_count)
        starts = hypothesis.point[None]
        if surprise and self._plan.alternatives:
            starts = np.concatenate([starts, self._candidates(hypothesis, active, previous, frame_count)])
        return self._refine(hypothesis, starts, frame_count, active)

    def _active(self, frame_count: int, touched: frozenset[int] = frozenset()) -> Bool[np.ndarray, "dimension"]:
        """Coordinates that can matter in the first frames."""
        tracks = self.likelihood.tracks
        released = np.unique(self.likelihood.observations.until(frame_count).body).tolist()
        last = float(tracks.times[frame_count - 1])
        contacts = self._clues.contacts
        seen = {body for contact in contacts if contact.time <= last for body in (contact.first, contact.second)}
        met = {body for one in self.hypotheses for pair in one.pairs for body in pair}
        meeting = seen | met | touched
        active = [
            entry.owner is None
            or entry.field == "wall_restitution"
            or entry.owner in (meeting if entry.field in CONTACT_FIELDS else released)
            for entry in self._coordinates.entries
        ]
        return np.array(active, dtype=bool) & ~self._noise_places

    def _contact_within(self, frame_count: int, previous: int) -> bool:
        """Whether a contact shows in the tracks in the added frames or just before them."""
        start, stop = self._span(frame_count, previous)
        return any(start <= contact.time <= stop for contact in self._clues.contacts)

    def _span(self, frame_count: int, previous: int) -> tuple[float, float]:
        times = self.likelihood.tracks.times
        return float(times[max(previous - 3, 0)]), float(times[frame_count - 1])

    def _entered(self, frame_count: int, previous: int) -> bool:
        """Whether a body is seen for the first time in the added frames."""
        first = self.likelihood.tracks.seen.argmax(axis=0)
        return bool(((first >= previous) & (first < frame_count)).any())

    def _added(self, frame_count: int, previous: int) -> Bool[np.ndarray, "residual"]:
        """Which position residuals of a window are new."""
        frames = self.likelihood.observations.frame
        return np.repeat(frames[frames < frame_count] >= previous, 2)

    def _candidates(
        self, hypothesis: Hypothesis, active: Bool[np.ndarray, "dimension"], previous: int, frame_count: int
    ) -> Float[np.ndarray, "candidate dimension"]:
        """Worlds drawn from what is known so far, half of them with the collisions that local fits suggest."""
        places = np.flatnonzero(active)
        gaussian = hypothesis.around(places)
        normal = self._generator.standard_normal((CANDIDATES, len(places)))
        spreads = np.resize(np.array(SPREADS), CANDIDATES)[:, None]
        widest = WIDEST * self._coordinates.prior_sd[places]
        candidates = np.tile(hypothesis.point, (CANDIDATES, 1))
        candidates[:, places] += np.clip(spreads * (normal @ gaussian.root.T), -widest, widest)
        start, stop = self._span(frame_count, previous)
        for contact in self._clues.contacts:
            if start <= contact.time <= stop:
                suggest(candidates[::2], contact, self.likelihood, 1 / np.diag(hypothesis.precision))
        return candidates

    def _refine(
        self,
        hypothesis: Hypothesis,
        candidates: Float[np.ndarray, "candidate dimension"],
        frame_count: int,
        active: Bool[np.ndarray, "dimension"],
    ) -> Hypothesis:
        """Refine the best candidates, the present values among them, and give the best result."""
        order = [0]
        if len(candidates) > 1:
            costs = robust_cost(self.likelihood.residuals(candidates, frame_count), HUBER)
            self.evaluations += len(candidates)
            ranked = np.argsort(costs)[:MOST_REFINED].tolist()
            order = list(dict.fromkeys([*ranked[:REFINED], 0, *ranked[REFINED:]]))
        found: list[Minimum] = []
        for start in candidates[order]:
            (minimum,) = self._descent(
                start[None], active, frame_count=frame_count, iterations=6, tolerance=0.05, threshold=HUBER
            )
            self.evaluations += minimum.evaluations
            found.append(minimum)
            best = min(found, key=lambda one: one.cost)
            if best.cost < GOOD_FIT * len(best.jacobian) / 2:
                break
            if len(found) > REFINED and (not hypothesis.explains or all(one.cost < best.cost + ALIKE for one in found)):
                break
        return self._refined(hypothesis, best, active, frame_count)

    def _refined(
        self, hypothesis: Hypothesis, minimum: Minimum, active: Bool[np.ndarray, "dimension"], frame_count: int
    ) -> Hypothesis:
        """The explanation at a minimum; the old one where the world failed."""
        if not np.isfinite(minimum.cost):
            return hypothesis
        precision = minimum.jacobian.T @ minimum.jacobian
        diagonal = np.arange(len(active))
        precision[diagonal, diagonal] = np.maximum(np.diag(precision), self._coordinates.prior_sd**-2)
        idle = np.flatnonzero(~active)
        precision[idle, idle] = self._idle_sd[idle] ** -2
        pairs = self._pairs(minimum.point, frame_count)
        self.evaluations += 1
        return Hypothesis(minimum.point, minimum.cost, precision, pairs, earlier=hypothesis.earlier)

    def _pairs(self, point: Float[np.ndarray, "dimension"], frame_count: int) -> tuple[tuple[int, int], ...]:
        with torch.no_grad():
            rollout = self.likelihood.rollout(torch.from_numpy(point[None]), frame_count)
        return first_contacts(rollout, 0)


def merged(
    likelihood: Likelihood, hypotheses: Sequence[Hypothesis], frame_count: int | None = None
) -> list[Hypothesis]:
    """The best of some explanations that differ and are nearly as good as the best one."""
    ordered = sorted((one for one in hypotheses if np.isfinite(one.cost)), key=lambda one: one.cost)
    kept, left = ordered[:1] or list(hypotheses[:1]), ordered[1:]
    left = [one for one in left if one.cost <= kept[0].cost + NEARLY]
    while left and len(kept) < FOLLOWED:
        points = np.array([one.point for one in left])
        apart = distances(likelihood, kept[-1].point, kept[-1].precision, points, frame_count) > SAME
        left = [one for one, far in zip(left, apart.tolist(), strict=True) if far]
        kept += left[:1]
        left = left[1:]
    return kept
