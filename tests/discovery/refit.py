"""How large a hidden effect is: what it leaves after the base motion is refitted, in units of the noise.

The noiseless tracks are cut into pieces at the contacts that the base model knows (of two bodies, and with stated
walls; not with hidden things). In every piece a body slides straight under dry friction and drag, from a state of its
own; at a contact the states after it follow from those before it by the base model's frictionless impulse (for a
square only position and momentum do, since its yaw is latent, and at a wall only position). Starting from the true
numbers, one linear least-squares step moves everything that the base model may move: all states, the friction of each
body (or one for all that slide and one for all that roll), mass and restitution of each body (or one restitution for
all), and the drag that all videos share, with the wide priors of the base model. What remains is the residual.

This is an approximation of a fit: it is linear, so an effect that turns a whole path is measured by its first order;
contacts are taken as known, so an effect that adds or removes a contact of two bodies does not count it; and a body
that presses on another one for long is taken as free.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import lstsq, qr

from tests.discovery import refit_kernel
from tests.discovery.videos import Video, recorded
from vrdp_prob.scene import Shape

CONTACT_WEIGHT = 1e3
"""Weight of a contact's rows against observations: so large that they hold exactly."""
DIFFERENCE = 1e-6
LEAST_DRAG = 1e-4
"""Drag in 1/m below which the closed form is not used."""
LOOSE, MASS_SD, RESTITUTION_SD, OWN_FRICTION_SD, SHARED_SD = 10.0, 0.7, 0.35, 0.5, 1.0
"""Prior standard deviations of states (SI), and of the logarithms of masses, restitutions, frictions and the drag."""


@dataclass(frozen=True)
class Freedom:
    """What the refit may move for each body by itself; where it may not, all bodies have one common factor.

    An effect that only orders the frictions of bodies, by mass say, leaves nothing where each has its own.
    """

    own_mass: bool = True
    own_friction: bool = True
    own_restitution: bool = True


@dataclass(frozen=True)
class Leftover:
    """Residuals after the refit, in units of the noise.

    Parameters
    ----------
    pieces
        Root mean square length of the residual vector in each piece of motion between contacts, all videos together.
    counts
        Number of observations in each piece.
    """

    pieces: Float[np.ndarray, "piece"]
    counts: Float[np.ndarray, "piece"]

    @property
    def size(self) -> float:
        """Effect size: root mean square residual where the effect is.

        The mean over pieces has their summed squares as weights, so it is the residual of the one piece that a local
        effect has, and that of all pieces for an effect that is everywhere.
        """
        weights = self.counts * self.pieces**2
        return 0.0 if not weights.sum() > 0 else float(np.sqrt((weights * self.pieces**2).sum() / weights.sum()))


@dataclass(frozen=True)
class _Pieces:
    """One video cut into pieces; see `refit_kernel.misfit`."""

    start: Float[np.ndarray, "piece 4"]
    body: Int[np.ndarray, "piece"]
    duration: Float[np.ndarray, "piece"]
    seen: Float[np.ndarray, "observation 4"]
    contacts: Int[np.ndarray, "contact 6"]
    before: Float[np.ndarray, "contact 2 4"]


def leftover(hidden: Sequence[Video], plain: Sequence[Video], noise: float, freedom: Freedom | None = None) -> Leftover:
    """What hidden causes leave in the noiseless tracks after the base motion is refitted.

    Parameters
    ----------
    hidden, plain
        The videos with the hidden causes, and the same without; friction is taken from the latter.
    noise
        Standard deviation of a measured coordinate in m.
    freedom
        What the refit may move.
    """
    freedom = freedom or Freedom()
    problems = [_problem(*pair, noise, freedom) for pair in zip(hidden, plain, strict=True)]
    reduced = [_without_own(*problem[:3]) for problem in problems]
    columns = np.concatenate([shared for _, shared in reduced])
    rest = np.concatenate([residual for residual, _ in reduced])
    count = columns.shape[1]
    step = lstsq(np.vstack([columns, np.eye(count) / SHARED_SD]), np.concatenate([rest, np.zeros(count)]))[0]
    pieces, counts = [], []
    for (residual, shared), (_, _, _, cut) in zip(reduced, problems, strict=True):
        left = (residual - shared @ step)[8 * len(cut.contacts) :][: 2 * len(cut.seen)].reshape(-1, 2)
        squares = (left**2).sum(axis=1)
        number = np.bincount(cut.seen[:, 0].astype(int), minlength=len(cut.body))
        total = np.bincount(cut.seen[:, 0].astype(int), squares, len(cut.body))
        pieces.append(np.sqrt(total / np.maximum(number, 1)))
        counts.append(number.astype(float))
    return Leftover(np.concatenate(pieces), np.concatenate(counts))


def _problem(
    hidden: Video, plain: Video, noise: float, freedom: Freedom
) -> tuple[Float[np.ndarray, "row"], Float[np.ndarray, "row own"], Float[np.ndarray, "row shared"], _Pieces]:
    """Residuals of a video over the noise, and minus their derivatives by its own and by the shared unknowns."""
    cut = _cut(hidden)
    count = len(plain.shapes)
    disc = np.array([shape is not Shape.CUBE for shape in plain.shapes])
    sphere = np.array([shape is Shape.SPHERE for shape in plain.shapes])
    states = cut.start.size

    def residuals(unknowns: Float[np.ndarray, "unknown"], share: float = 1.0) -> Float[np.ndarray, "row"]:
        own_friction, mass, restitution = np.split(unknowns[states : states + 3 * count], 3)
        sliding, rolling, drag, bounce = unknowns[states + 3 * count :]
        friction = plain.friction * np.exp(own_friction + np.where(sphere, rolling, sliding))
        found: Float[np.ndarray, "row"] = refit_kernel.misfit(
            unknowns[:states].reshape(-1, 4),
            friction,
            max(plain.laws.drag, LEAST_DRAG) * np.exp(drag),
            plain.mass * np.exp(mass),
            plain.restitution * np.exp(restitution + bounce / 2),
            plain.radius,
            disc,
            cut.body,
            cut.duration,
            cut.seen,
            cut.contacts,
            share * offset,
            CONTACT_WEIGHT,
        )
        return found / noise

    truth = np.concatenate([cut.start.ravel(), np.zeros(3 * count + 4)])
    offset = _offset(cut, plain)
    slopes = _slopes(residuals, truth)
    at_contacts = residuals(truth)
    constant = at_contacts + (residuals(truth, 1 - DIFFERENCE) - at_contacts) / DIFFERENCE
    fixed_sd = 1e-6
    own_sd = [
        np.full(states, LOOSE),
        np.full(count, OWN_FRICTION_SD if freedom.own_friction else fixed_sd),
        np.full(count, MASS_SD if freedom.own_mass else fixed_sd),
        np.full(count, RESTITUTION_SD if freedom.own_restitution else fixed_sd),
    ]
    own = np.vstack([-slopes[:, : states + 3 * count], np.diag(1 / np.concatenate(own_sd))])
    nothing = np.zeros(states + 3 * count)
    shared = np.vstack([-slopes[:, states + 3 * count :], np.zeros((len(nothing), 4))])
    return np.concatenate([constant, nothing]), own, shared, cut


def _offset(cut: _Pieces, plain: Video) -> Float[np.ndarray, "contact 2 4"]:
    """True states before contacts less those that the base motion has there.

    Contacts are linearised where they truly are, since a path that an effect has turned might miss the other body.
    """
    offset = np.zeros((len(cut.contacts), 2, 4))
    for number, row in enumerate(cut.contacts):
        for side in range(1 + (row[1] >= 0)):
            body, piece = row[side], row[2 + side]
            end = refit_kernel.base_motion(
                cut.start[piece], plain.friction[body], max(plain.laws.drag, LEAST_DRAG), cut.duration[piece]
            )
            offset[number, side] = cut.before[number, side] - end
    return offset


def _slopes(
    function: Callable[[Float[np.ndarray, "unknown"]], Float[np.ndarray, "row"]], at: Float[np.ndarray, "unknown"]
) -> Float[np.ndarray, "row unknown"]:
    """Central differences."""
    moved = DIFFERENCE * np.eye(len(at))
    return np.stack([(function(at + step) - function(at - step)) / (2 * DIFFERENCE) for step in moved], axis=1)


def _without_own(
    residual: Float[np.ndarray, "row"], own: Float[np.ndarray, "row own"], shared: Float[np.ndarray, "row shared"]
) -> tuple[Float[np.ndarray, "row"], Float[np.ndarray, "row shared"]]:
    """What a video's own unknowns cannot explain of its residuals and of the shared columns."""
    basis = qr(own, mode="economic")[0]
    return residual - basis @ (basis.T @ residual), shared - basis @ (basis.T @ shared)


def _cut(video: Video) -> _Pieces:
    """Cut the noiseless tracks of a video at the contacts that the base model knows."""
    count, motion = len(video.shapes), video.motion
    first_wall = count + len(video.hidden_discs)
    known = set(range(count)) | set(range(first_wall, first_wall + len(video.walls)))
    begin = np.hstack([video.position, video.velocity])
    starts, bodies, times = list(begin), list(range(count)), list(video.release)
    ends: list[float] = [np.inf] * count
    current, contacts, before = list(range(count)), [], []
    for time, (i, j), around in zip(motion.contact_times, motion.pairs, motion.around, strict=True):
        if j not in known:
            continue
        row = [i, j if j < count else -1, current[i], current[j] if j < count else -1, -1, -1]
        for side, body in enumerate((i, j)[: 1 + (j < count)]):
            ends[current[body]], current[body] = time, len(starts)
            row[4 + side] = current[body]
            starts.append(around[1, side, :4])
            bodies.append(body)
            times.append(time)
            ends.append(np.inf)
        contacts.append(row)
        before.append(around[0, :, :4])
    stamps = _stamp(video, np.array(times))
    duration = np.minimum(_stamp(video, np.array(ends)), 1e3) - stamps
    seen = []
    places, in_view = recorded(video, motion.states[..., :2]), video.in_view
    for piece, body in enumerate(bodies):
        inside = (video.stamps >= stamps[piece] - 1e-12) & (video.stamps < stamps[piece] + duration[piece] - 1e-12)
        frames = np.flatnonzero(inside & in_view[:, body])
        seen += [(piece, video.stamps[frame] - stamps[piece], *places[frame, body]) for frame in frames]
    return _Pieces(
        np.array(starts),
        np.array(bodies),
        duration,
        np.array(seen),
        np.array(contacts, dtype=int).reshape(-1, 6),
        np.array(before).reshape(-1, 2, 4),
    )


def _stamp(video: Video, times: Float[np.ndarray, "moment"]) -> Float[np.ndarray, "moment"]:
    """Time stamps that belong to true times in s."""
    if video.late is None:
        return times
    return np.where(np.isfinite(times), np.interp(times, video.times, video.stamps), times)
