"""What local quadratic fits say before any simulation: release velocities, and the contacts that were seen.

Quadratic and not linear: friction bends a track enough within 0.2 s to bias a momentum balance.
"""

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from jaxtyping import Float

from vrdp_prob.scene import Body, Tracks

SPAN = 0.4
"""Length in s of the stretch of track on each side of a contact."""
LONGEST_GAP = 6
"""Frames over which a hidden object's place is interpolated when contacts are looked for."""
ACCELERATION_SD = 1.0
"""Prior standard deviation in m/s^2 of the acceleration between contacts."""
SHIFTS = np.linspace(-2, 2, 17)
"""Frames by which the time of a contact is moved to where it fits best."""
SIGNIFICANT = 3.5
"""A velocity jump counts from this many standard deviations on."""
SMALLEST_JUMP = 0.02
"""...and from this share of the fastest speed of the two bodies on."""
FEWEST_BEFORE, FEWEST_AFTER = 2, 3
"""Positions on either side of a kink; of a body that was just released few come before its first contact."""


@dataclass(frozen=True)
class LocalFit:
    """Position (m), velocity (m/s) and acceleration (m/s^2) of a body at one time from a polynomial through its track.

    `velocity_sd` is the velocity's standard deviation per axis for noise of the given scale. The acceleration is 0
    where a straight line was fitted.
    """

    position: Float[np.ndarray, "2"]
    velocity: Float[np.ndarray, "2"]
    velocity_sd: float
    acceleration: Float[np.ndarray, "2"] = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class SeenContact:
    """A contact that shows in the tracks, with what momentum balance says about the two bodies.

    Parameters
    ----------
    first, second
        The two bodies, by index.
    time
        Time in s of the closest approach.
    jump
        Size of the velocity jump in units of its standard deviation.
    mass_ratio
        Mass of the first over mass of the second.
    restitution
        Restitution of the pair.
    """

    first: int
    second: int
    time: float
    jump: float
    mass_ratio: float
    restitution: float


@dataclass(frozen=True)
class Approach:
    """Two bodies, by index, that may touch at a time (s)."""

    first: int
    second: int
    time: float


def local_fit(
    tracks: Tracks, body: int, at: float, *, start: float, stop: float, noise: float, degree: int = 2
) -> LocalFit | None:
    """Fit a polynomial to one body's track between two times (s); None where fewer than 3 frames were seen there."""
    times, positions = tracks.times, tracks.positions[:, body]
    chosen = np.isfinite(positions).all(axis=1) & (times >= start - 1e-9) & (times <= stop + 1e-9)
    count = int(chosen.sum())
    if count < 3:
        return None
    offset = times[chosen] - at
    design = np.vander(offset, (degree if count >= 6 else 1) + 1, increasing=True)
    inverse = np.linalg.pinv(design)
    coefficients = inverse @ positions[chosen]
    velocity_sd = noise * float(np.linalg.norm(inverse[1]))
    acceleration = 2 * coefficients[2] if len(coefficients) > 2 else np.zeros(2)
    return LocalFit(coefficients[0], coefficients[1], velocity_sd, acceleration)


def release_fit(tracks: Tracks, body: int, noise: float, until: float, start: float | None = None) -> LocalFit:
    """State of a body at a time (s), that of its first seen frame where None.

    It comes from the longest stretch before `until` (s) that a quadratic fits.
    """
    start = float(tracks.first_seen[body]) if start is None else start
    times, positions = tracks.times, tracks.positions[:, body]
    seen = np.flatnonzero(np.isfinite(positions).all(axis=1))
    best: LocalFit | None = None
    for span in (3, 5, 8, 12, 18, 25):
        stop = min(float(times[seen[min(span, len(seen) - 1)]]), until)
        fit = local_fit(tracks, body, start, start=start, stop=stop, noise=noise)
        if fit is None:
            continue
        if best is None or fit.velocity_sd < best.velocity_sd:
            if best is not None and np.linalg.norm(fit.velocity - best.velocity) > 4 * best.velocity_sd:
                break
            best = fit
    if best is not None:
        return best
    first, second = seen[0], seen[1]
    velocity = (positions[second] - positions[first]) / (times[second] - times[first])
    position = positions[first] + (start - times[first]) * velocity
    return LocalFit(position, velocity, noise * np.sqrt(2) / float(times[second] - times[first]))


def seen_contacts(tracks: Tracks, noise: float) -> tuple[SeenContact, ...]:
    """Contacts between bodies that show in the tracks as a close approach with a velocity jump, in order of time."""
    found = [
        contact
        for first, second in combinations(range(len(tracks.bodies)), 2)
        for contact in _contacts_of_pair(tracks, first, second, noise)
    ]
    return tuple(sorted(found, key=lambda contact: contact.time))


def contact_distances(first: Body, second: Body) -> tuple[float, float] | None:
    """Smallest and largest distance (m) of the centres at which two bodies can touch; None without both radii."""
    if first.radius is None or second.radius is None:
        return None
    return first.radius + second.radius, first.radius * first.shape.reach + second.radius * second.shape.reach


def approaches(tracks: Tracks, noise: float) -> tuple[Approach, ...]:
    """Times at which two bodies come so near to each other that they may touch, in order of time."""
    found = [
        Approach(first, second, time)
        for first, second in combinations(range(len(tracks.bodies)), 2)
        for time in _approaches_of_pair(tracks, first, second, noise)
    ]
    return tuple(sorted(found, key=lambda approach: approach.time))


def _approaches_of_pair(tracks: Tracks, first: int, second: int, noise: float) -> list[float]:
    limits = contact_distances(tracks.bodies[first], tracks.bodies[second])
    if limits is None:
        return []
    times = tracks.times
    difference = _interpolated(tracks, first) - _interpolated(tracks, second)
    distance = np.linalg.norm(difference, axis=1)
    step = float(np.median(np.diff(times)))
    near = []
    for frame in _local_minima(distance):
        speed = np.linalg.norm(np.gradient(difference, times, axis=0)[max(frame - 2, 0) : frame + 3], axis=1)
        slack = 4 * noise + step * float(np.nanmax(speed, initial=0.0))
        if distance[frame] <= limits[1] + slack:
            near.append(float(times[frame]))
    return near


def _contacts_of_pair(tracks: Tracks, first: int, second: int, noise: float) -> list[SeenContact]:
    judged = [_judge(tracks, first, second, time, noise) for time in _approaches_of_pair(tracks, first, second, noise)]
    return _strongest_of_neighbours([contact for contact in judged if contact is not None])


def _strongest_of_neighbours(contacts: list[SeenContact]) -> list[SeenContact]:
    """One contact where noise made two minima of the distance out of it."""
    kept: list[SeenContact] = []
    for contact in sorted(contacts, key=lambda contact: -contact.jump):
        if all(abs(contact.time - other.time) > SPAN / 2 for other in kept):
            kept.append(contact)
    return kept


def _judge(tracks: Tracks, first: int, second: int, time: float, noise: float) -> SeenContact | None:
    kink_first, kink_second, at = _best_kinks(tracks, first, second, time, noise)
    if kink_first is None or kink_second is None:
        return None
    push = kink_first.jump - kink_second.jump
    push_sd = float(np.hypot(kink_first.jump_sd, kink_second.jump_sd))
    fastest = max(float(np.linalg.norm(one.before)) for one in (kink_first, kink_second))
    size = float(np.linalg.norm(push))
    if size < max(SIGNIFICANT * push_sd, SMALLEST_JUMP * fastest):
        return None
    normal = push / size
    approach = float((kink_first.before - kink_second.before) @ normal)
    toward = float((kink_first.position - kink_second.position) @ normal)
    if approach >= 0 or toward <= 0:
        return None
    kick_first = max(float(kink_first.jump @ normal), push_sd / 4)
    kick_second = max(float(-kink_second.jump @ normal), push_sd / 4)
    ratio = float(np.clip(kick_second / kick_first, 0.1, 10.0))
    restitution = float(np.clip((approach + size) / -approach, 0.05, 0.98))
    return SeenContact(first, second, at, size / push_sd, ratio, restitution)


@dataclass(frozen=True)
class Kink:
    """Two quadratic pieces that join at one place: position (m), velocity before, velocity jump (m/s) and its sd.

    `misfit` is the sum of the squares in m^2 that both leave of `count` positions.
    """

    position: Float[np.ndarray, "2"]
    before: Float[np.ndarray, "2"]
    jump: Float[np.ndarray, "2"]
    jump_sd: float
    misfit: float
    count: int


def _best_kinks(
    tracks: Tracks, first: int, second: int, time: float, noise: float
) -> tuple[Kink | None, Kink | None, float]:
    """Kinks of both bodies at the common time around `time` that fits best."""
    step = float(np.median(np.diff(tracks.times)))
    best: tuple[Kink | None, Kink | None, float] = (None, None, time)
    lowest = np.inf
    for at in time + step * SHIFTS:
        kinks = [kink(tracks, body, float(at), noise) for body in (first, second)]
        misfit = sum(np.inf if one is None else one.misfit for one in kinks)
        if misfit < lowest:
            lowest, best = misfit, (kinks[0], kinks[1], float(at))
    return best


def kink(
    tracks: Tracks, body: int, at: float, noise: float, *, start: float = -np.inf, stop: float = np.inf
) -> Kink | None:
    """Fit a kink at a time (s) to what was seen of a body around it, between two times (s); None where that is little.

    Parameters
    ----------
    tracks
        What was seen.
    body
        The body, by index.
    at
        Time in s of the kink.
    noise
        Measurement noise in m.
    start, stop
        Times in s before and after which nothing counts.
    """
    times, positions = tracks.times, tracks.positions[:, body]
    offset = times - at
    inside = (np.abs(offset) <= SPAN) & (times >= start) & (times <= stop)
    chosen = np.isfinite(positions).all(axis=1) & inside
    offset, seen = offset[chosen], positions[chosen]
    if (offset < 0).sum() < FEWEST_BEFORE or (offset >= 0).sum() < FEWEST_AFTER:
        return None
    after = np.maximum(offset, 0)
    before = np.minimum(offset, 0)
    design = np.stack([np.ones_like(offset), offset, after, before**2 / 2, after**2 / 2], axis=1)
    prior = np.diag([0, 0, 0, 1, 1]) * (noise / ACCELERATION_SD) ** 2
    covariance = np.linalg.inv(design.T @ design + prior)
    coefficients = covariance @ design.T @ seen
    misfit = float(
        ((seen - design @ coefficients) ** 2).sum() + np.einsum("ik,ij,jk->", coefficients, prior, coefficients)
    )
    return Kink(
        coefficients[0], coefficients[1], coefficients[2], noise * float(np.sqrt(covariance[2, 2])), misfit, len(seen)
    )


def _interpolated(tracks: Tracks, body: int) -> Float[np.ndarray, "time 2"]:
    """Positions with short gaps filled by straight lines, NaN elsewhere."""
    times, positions = tracks.times, tracks.positions[:, body]
    seen = np.flatnonzero(np.isfinite(positions).all(axis=1))
    filled = np.stack([np.interp(times, times[seen], positions[seen, axis]) for axis in range(2)], axis=1)
    frames = np.arange(len(times))
    previous = seen[np.clip(np.searchsorted(seen, frames, side="right") - 1, 0, len(seen) - 1)]
    following = seen[np.clip(np.searchsorted(seen, frames), 0, len(seen) - 1)]
    outside = (frames < seen[0]) | (frames > seen[-1])
    filled[outside | (following - previous > LONGEST_GAP)] = np.nan
    return filled


def _local_minima(distance: Float[np.ndarray, "time"]) -> list[int]:
    finite = np.where(np.isfinite(distance), distance, np.inf)
    padded = np.concatenate([[np.inf], finite, [np.inf]])
    lower = (padded[1:-1] <= padded[:-2]) & (padded[1:-1] < padded[2:]) & np.isfinite(distance)
    return [int(frame) for frame in np.flatnonzero(lower)]
