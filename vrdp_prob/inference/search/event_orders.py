"""Other orders of contacts that follow one another so closely that the tracks leave open which came first.

A body that meets two others, or one and a wall, at nearly the same time meets the second one with what the first left
it. In the other order the same motion takes other masses and restitutions: another mode, which no descent reaches,
since motion and masses would have to change at once. So the motion is moved, by as little as the tracks allow, to where
the order is the other one; there masses and restitutions follow; then all is refined.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.least_squares import jacobian, minimise, one_sided
from vrdp_prob.inference.search.noise_fit import NOISE_FIELDS
from vrdp_prob.inference.search.plan import Optimiser
from vrdp_prob.inference.search.refinement import Refine, Refined, Searched, best_first
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import CONTACTS, EventTable, RolloutEventKind

CLOSE = 0.25
"""Contacts (s) of one body further apart than this are not looked at."""
REACH = 3.5
"""An order is tried if the tracks contradict it by at most so many standard deviations of the time between contacts."""
BEYOND = (0.3, 1.0, 2.0)
"""Standard deviations past simultaneity at which the order is the other one, the first that makes it so."""
AT_THE_EDGE, JUST_BESIDE = 1.0, 0.02
"""Standard deviations between contacts below which a maximum may be at the edge, and at which it is sought there."""
STEP = 0.05
"""Step for derivatives, in standard deviations."""
MOST_ORDERS = 6
"""Orders that are tried from one maximum: those that the tracks contradict least."""
MOST_LOOKS = 4
"""Maxima from which other orders are looked for at most."""
NEARLY = 15.0
"""Nats that a maximum may be below the best one for others to be looked for from it."""
BETTER = 0.5
"""Nats that an order that was looked from before has to gain to be looked from again."""
AFTER = 16
"""Frames from both contacts on that masses and restitutions follow at first; later contacts need these right."""
FIRST_ITERATIONS, THEN_ITERATIONS = 6, 4
"""Steps of masses and restitutions on these frames, and on all."""
EDGE_ROUNDS, EDGE_ITERATIONS = 2, 6
"""Turns of a descent along the edge between two orders, and steps of each."""
MATTER = ("mass", "restitution", "wall_restitution")
"""What follows."""

Contact = tuple[int, int, int]
"""Kind, first and second of the first contact between these two."""


@dataclass(frozen=True)
class _Gap:
    """The time between two contacts of a body, as the tracks know it.

    Parameters
    ----------
    early, late
        The contacts.
    time
        Time (s) of the first.
    seconds
        Time (s) between them.
    slopes
        Its derivative by the whitened coordinates.
    """

    early: Contact
    late: Contact
    time: float
    seconds: float
    slopes: Float[np.ndarray, "whitened"]

    @property
    def sd(self) -> float:
        """Standard deviation (s)."""
        return float(np.linalg.norm(self.slopes))

    @property
    def size(self) -> float:
        """Standard deviations between the contacts."""
        return self.seconds / self.sd

    def move_to(self, size: float) -> Float[np.ndarray, "whitened"]:
        """The least change, in whitened coordinates, to so many standard deviations between the contacts."""
        return (size - self.size) * self.slopes / self.sd


@dataclass(frozen=True)
class _Neighbourhood:
    """A point with the Gaussian around it, in all coordinates but the noise.

    Parameters
    ----------
    likelihood
        The density.
    point
        The point.
    root
        Change of the coordinates per whitened coordinate.
    """

    likelihood: Likelihood
    point: Float[np.ndarray, "dimension"]
    root: Float[np.ndarray, "dimension whitened"]

    @classmethod
    def of(cls, likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> "_Neighbourhood":
        """That of a point."""
        free = ~likelihood.coordinates.mask(NOISE_FIELDS)
        _, derivative = jacobian(
            likelihood.residuals, point, likelihood.coordinates.scale, active=free, central=True, own_side=True
        )
        gaussian = Gaussian.from_precision(point[free], derivative[:, free].T @ derivative[:, free])
        root = np.zeros((len(point), len(gaussian.mean)))
        root[free] = gaussian.root
        return cls(likelihood, point, root)

    def moved(self, whitened: Float[np.ndarray, "*batch whitened"]) -> Float[np.ndarray, "*batch dimension"]:
        """Points around."""
        return self.point + whitened @ self.root.T

    def gaps(self, pairs: Sequence[tuple[Contact, Contact]]) -> list[_Gap]:
        """The times between pairs of contacts, those that may be none first; without such as nothing here changes."""
        count = self.root.shape[1]
        steps = STEP * np.concatenate([np.zeros((1, count)), np.eye(count), -np.eye(count)])
        worlds = _contacts_at(self.likelihood, self.moved(steps))
        found = []
        for early, late in pairs:
            between = np.array([one.get(late, np.nan) - one.get(early, np.nan) for one in worlds])
            between[between * between[0] < 0] = np.nan  # in the other order it passes at another rate
            ahead, behind = between[1 : count + 1] - between[0], between[0] - between[count + 1 :]
            slopes = np.nan_to_num(one_sided(ahead[:, None], behind[:, None], least=0.0)[:, 0]) / STEP
            if slopes.any():
                found.append(_Gap(early, late, worlds[0][early], float(between[0]), slopes))
        return sorted(found, key=lambda gap: abs(gap.size))


def with_other_orders(
    likelihood: Likelihood, found: Sequence[Refined], refined: Refine, *, optimiser: Optimiser
) -> Searched:
    """Maxima with those in which close contacts have come in another order.

    Parameters
    ----------
    likelihood
        The density.
    found
        Its maxima, best first.
    refined
        How what may be near other maxima is refined.
    optimiser
        How masses and restitutions follow before that.
    """
    descent = Descent(likelihood, optimiser)
    searched = Searched(best_first(found), 0)
    looked: dict[tuple[Contact, ...], float] = {}
    for look in range(MOST_LOOKS + 1):
        best = searched.found
        hopeful = [one for one in best if one.log_density > best[0].log_density - NEARLY]
        orders = [tuple(one) for one in _contacts_at(likelihood, [one.point for one in hopeful])]
        new = [
            (order, one.point, one.log_density)
            for order, one in zip(orders, hopeful, strict=True)
            if one.log_density > looked.get(order, -np.inf) + BETTER
        ]
        if not new or look == MOST_LOOKS:
            searched = searched.beside([], len(hopeful), complete=not new)
            break
        order, point, looked[order] = new[0]
        starts = other_orders(descent, point, frozenset(looked))
        others = refined(likelihood, starts.points, likelihood)
        searched = searched.beside(others, len(hopeful) + starts.evaluations, complete=starts.complete)
    return searched


@dataclass(frozen=True)
class Starts:
    """What is near other maxima.

    Parameters
    ----------
    points
        The points.
    evaluations
        Worlds simulated on the way.
    complete
        Whether there are no more orders than were tried.
    """

    points: list[Float[np.ndarray, "dimension"]]
    evaluations: int
    complete: bool


def other_orders(
    descent: Descent, point: Float[np.ndarray, "dimension"], known: frozenset[tuple[Contact, ...]] = frozenset()
) -> Starts:
    """What is near other maxima of the log posterior, in which close contacts have come in another order.

    Parameters
    ----------
    descent
        Refines worlds of the density.
    point
        A maximum, from which is looked.
    known
        Orders that need not be looked for.
    """
    likelihood = descent.likelihood
    matter = likelihood.coordinates.mask(MATTER)
    (contacts,) = _contacts_at(likelihood, [point])
    close = _close(contacts)
    if not close or not matter.any():
        return Starts([], 1, True)
    around = _Neighbourhood.of(likelihood, point)
    evaluations = 1 + 4 * around.root.shape[1]
    found: list[Float[np.ndarray, "dimension"]] = []
    open_gaps = [gap for gap in around.gaps(close) if abs(gap.size) < REACH]
    for gap in open_gaps[:MOST_ORDERS]:
        edges = [(point, gap.early, gap.late)] if abs(gap.size) < AT_THE_EDGE else []
        other = _swapped(around, gap, known)
        evaluations += len(BEYOND)
        if other is not None:
            until = int(np.searchsorted(likelihood.tracks.times, gap.time + max(gap.seconds, 0.0))) + AFTER
            until = min(until, len(likelihood.tracks.times))
            (first,) = descent(other[None], matter, frame_count=until, iterations=FIRST_ITERATIONS)
            (then,) = descent(first.point[None], matter, iterations=THEN_ITERATIONS)
            evaluations += first.evaluations + then.evaluations
            if np.isfinite(then.cost):
                found.append(then.point)
                edges.append((then.point, gap.late, gap.early))
        for start, early, late in edges:
            along, spent = _along_the_edge(likelihood, start, early, late)
            evaluations += spent
            if along is not None:
                found.append(along)
    return Starts(found, evaluations, len(open_gaps) <= MOST_ORDERS)


def _swapped(
    around: _Neighbourhood, gap: _Gap, known: frozenset[tuple[Contact, ...]]
) -> Float[np.ndarray, "dimension"] | None:
    """The nearest point at which two contacts have come in the other order; None where that order is known."""
    moved = around.moved(np.array([gap.move_to(-beyond) for beyond in BEYOND]))
    for point, contacts in zip(moved, _contacts_at(around.likelihood, moved), strict=True):
        if contacts.get(gap.late, np.inf) < contacts.get(gap.early, -np.inf):
            return None if tuple(contacts) in known else point
    return None


def _along_the_edge(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], early: Contact, late: Contact
) -> tuple[Float[np.ndarray, "dimension"] | None, int]:
    """The most probable point at which two contacts come in an order and nearly at once, and the worlds simulated.

    None where they do not come in that order.

    Where each order is the more probable the closer the contacts are, descents in all directions stop at the edge
    between them, while the density still rises along it.
    """
    evaluations, best = 0, None
    for _ in range(EDGE_ROUNDS):
        around = _Neighbourhood.of(likelihood, point)
        evaluations += 4 * around.root.shape[1]
        gaps = around.gaps([(early, late)])
        if not gaps:
            break
        edge = gaps[0].move_to(JUST_BESIDE)
        along = np.linalg.svd(gaps[0].slopes[None])[2][1:]

        def residuals(
            moves: Float[np.ndarray, "point direction"],
            around: _Neighbourhood = around,
            edge: Float[np.ndarray, "whitened"] = edge,
            along: Float[np.ndarray, "direction whitened"] = along,
        ) -> Float[np.ndarray, "point residual"]:
            return likelihood.residuals(around.moved(edge + moves @ along))

        minimum = minimise(residuals, np.zeros(len(along)), np.ones(len(along)), iterations=EDGE_ITERATIONS)
        evaluations += minimum.evaluations
        if not np.isfinite(minimum.cost):
            break
        best = point = around.moved(edge + minimum.point @ along)
    return best, evaluations


def _contacts_at(
    likelihood: Likelihood, points: Sequence[Float[np.ndarray, "dimension"]] | Float[np.ndarray, "point dimension"]
) -> list[dict[Contact, float]]:
    """Times (s) of the first contacts of every two in the worlds of some points; none where a world failed."""
    if not len(points):
        return []
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(np.array(points)))
    fine = rollout.fine.tolist()
    return [_contacts(rollout.events.of_world(world)) if fine[world] else {} for world in range(len(points))]


def _contacts(events: EventTable) -> dict[Contact, float]:
    """Times (s) of the first contacts of every two in a world, in their order."""
    events = events.where(np.isin(events.kind, CONTACTS))
    found: dict[Contact, float] = {}
    for kind, first, second, time in zip(
        events.kind.tolist(), events.first.tolist(), events.second.tolist(), events.time.tolist(), strict=True
    ):
        found.setdefault((kind, first, second), time)
    return found


def _close(contacts: dict[Contact, float]) -> list[tuple[Contact, Contact]]:
    """First contacts of one body with different partners that follow one another closely."""
    return [
        (early, late)
        for (early, before), (late, after) in combinations(contacts.items(), 2)
        if _bodies(early) & _bodies(late) and after - before < CLOSE
    ]


def _bodies(contact: Contact) -> set[int]:
    kind, first, second = contact
    return {first, second} if kind == RolloutEventKind.COLLISION else {first}
