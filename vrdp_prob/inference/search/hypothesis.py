"""One explanation of the first frames of a video, and whether two of them are the same."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.search.least_squares import Minimum
from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import CONTACTS, RolloutEventKind
from vrdp_prob.scene import Shape

QUARTER = np.pi / 2
"""A square looks the same after a quarter turn (rad)."""
SLOPE_STEP = 1e-4
"""Step in spin (rad/s) and in the logarithm of its decay for differences."""


@dataclass(frozen=True)
class Hypothesis:
    """An explanation of the first frames.

    Parameters
    ----------
    point
        The values.
    cost
        Robust negative log posterior (nats, up to a constant) of the frames so far.
    precision
        Gauss-Newton curvature when it was last refined.
    pairs
        Pairs that have collided, in order.
    unrefined
        Windows since it was last refined.
    explains
        Whether it explains the frames so far about as well as noise would.
    earlier
        What it was after earlier windows, with the time (s) at which each window ended.
    """

    point: Float[np.ndarray, "dimension"]
    cost: float
    precision: Float[np.ndarray, "dimension dimension"]
    pairs: tuple[tuple[int, int], ...] = ()
    unrefined: int = 0
    explains: bool = True
    earlier: tuple[tuple[float, "Hypothesis"], ...] = ()

    def around(self, places: Int[np.ndarray, "place"]) -> Gaussian:
        """The Gaussian around it, of the coordinates at some places, the others held."""
        return Gaussian.from_precision(self.point[places], self.precision[np.ix_(places, places)])

    def before(self, time: float) -> "Hypothesis":
        """What it was after the last window that ended before a time (s); itself where there is none."""
        known = [one for end, one in self.earlier if end < time]
        return known[-1] if known else self

    def explained_before(self, time: float) -> bool:
        """Whether it explained all before a time (s), as far as that is known."""
        before = self.before(time)
        return before is self or before.explains

    def noted(self, end: float) -> "Hypothesis":
        """The same, remembered as what it is after the window that ends at a time (s)."""
        kept = tuple((time, one) for time, one in self.earlier if time < end)
        return replace(self, earlier=(*kept, (end, replace(self, earlier=()))))


def yaw_places(likelihood: Likelihood, bodies: Iterable[int] | None = None) -> list[int]:
    """Places of the yaws (of some bodies) that only contacts tell: those of cubes.

    Measured angles tell how a cube turns, and not how it lies: they count from a zero of their own.
    """
    places, tracks = likelihood.coordinates.places, likelihood.tracks
    chosen = range(len(tracks.bodies)) if bodies is None else sorted(bodies)
    found = (places.get(("angle", body)) for body in chosen if tracks.bodies[body].shape is Shape.CUBE)
    return [place for place in found if place is not None]


def zero_place(likelihood: Likelihood, yaw: int) -> int | None:
    """Place of the zero from which the measured angles of a cube count, by that of its yaw; None where it has none."""
    coordinates = likelihood.coordinates
    return coordinates.places.get(("angle_zero", coordinates.entries[yaw].owner))


def turn(
    points: Float[np.ndarray, "point dimension"], likelihood: Likelihood, yaw: int, by: Float[np.ndarray, "point"]
) -> None:
    """Turn a cube by some angles (rad), in place, its measured angles left as they were seen."""
    points[:, yaw] += by
    if (zero := zero_place(likelihood, yaw)) is not None:
        points[:, zero] -= by


def least_turn(angles: Float[np.ndarray, "*angle"]) -> Float[np.ndarray, "*angle"]:
    """Turns that a square cannot tell from some angles (rad), by at most an eighth of a turn."""
    return angles - QUARTER * np.round(angles / QUARTER)


def turned_least(
    likelihood: Likelihood, points: Float[np.ndarray, "*point dimension"]
) -> Float[np.ndarray, "*point dimension"]:
    """The same worlds with the yaws that only contacts tell within an eighth of a turn from zero."""
    result = points.copy().reshape(-1, points.shape[-1])
    for yaw in yaw_places(likelihood):
        turn(result, likelihood, yaw, least_turn(result[:, yaw]) - result[:, yaw])
    return result.reshape(points.shape)


def distances(
    likelihood: Likelihood,
    reference: Float[np.ndarray, "dimension"],
    precision: Float[np.ndarray, "dimension dimension"],
    others: Float[np.ndarray, "point dimension"],
    frame_count: int | None = None,
) -> Float[np.ndarray, "point"]:
    """How far points are from a reference in standard deviations.

    Only the yaw with which a cube meets something is known, so release yaw and spin make up for each other along a
    curve. Yaws are compared just before the first contact in the reference, where that curve is a straight line; a
    quarter turn is no difference.
    """
    coordinates = likelihood.coordinates
    before = frames_before_contact(likelihood, reference, frame_count)
    slopes = [
        place
        for place, entry in enumerate(coordinates.entries)
        if entry.field == "angular_drag" or (entry.field == "spin" and entry.owner in before)
    ]
    moved = np.tile(reference, (len(slopes), 1))
    moved[np.arange(len(slopes)), slopes] += SLOPE_STEP
    with torch.no_grad():
        points = torch.from_numpy(np.concatenate([reference[None], moved, others]))
        turned = likelihood.rollout(points, frame_count).trajectory[..., 2].numpy()
    change = np.eye(len(reference))
    difference = others - reference
    for place in yaw_places(likelihood):
        apart = difference[:, place]
        body = coordinates.entries[place].owner
        if body is not None and body in before:
            angle = turned[:, before[body], body]
            change[place, slopes] = (angle[1 : len(slopes) + 1] - angle[0]) / SLOPE_STEP
            apart = difference[:, place] = angle[len(slopes) + 1 :] - angle[0]
        turn(difference, likelihood, place, least_turn(apart) - apart)
    straight = np.linalg.inv(change)
    metric = straight.T @ precision @ straight
    return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", difference, metric, difference), 0.0))


def different(
    likelihood: Likelihood,
    found: Sequence[Minimum],
    *,
    worse: float,
    most: int,
    frame_count: int | None = None,
) -> list[Minimum]:
    """The best of some minima that are not the same, none of them so many nats worse than the best one."""
    left = sorted((one for one in found if np.isfinite(one.cost)), key=lambda one: one.cost)
    left = [one for one in left if one.cost < left[0].cost + worse]
    kept: list[Minimum] = []
    while left and len(kept) < most:
        best = left[0]
        kept.append(best)
        precision = best.jacobian.T @ best.jacobian
        apart = distances(likelihood, best.point, precision, np.array([one.point for one in left]), frame_count) > 1
        left = [one for one, far in zip(left[1:], apart[1:].tolist(), strict=True) if far]
    return kept


def frames_before_contact(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], frame_count: int | None = None
) -> dict[int, int]:
    """Frame just before the first contact of each body that has one after it was released."""
    with torch.no_grad():
        events = likelihood.rollout(torch.from_numpy(point[None]), frame_count).events
    touching = np.isin(events.kind, CONTACTS)
    frames: dict[int, int] = {}
    for kind, time, *pair in zip(
        events.kind[touching], events.time[touching], events.first[touching], events.second[touching], strict=True
    ):
        frame = int(np.searchsorted(likelihood.tracks.times, float(time), side="right")) - 1
        for body in pair if kind == RolloutEventKind.COLLISION else pair[:1]:
            frames[int(body)] = min(frame, frames.get(int(body), frame))
    return frames


def owned(coordinates: Coordinates, bodies: Iterable[int]) -> np.ndarray:
    """Which coordinates belong to some bodies."""
    chosen = set(bodies)
    return np.array([entry.owner in chosen and entry.field != "wall_restitution" for entry in coordinates.entries])
