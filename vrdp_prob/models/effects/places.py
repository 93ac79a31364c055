"""Where and when an effect may be, by where and when bodies were seen."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.ndimage import median_filter

from vrdp_prob.models.parameters import Parameter
from vrdp_prob.scene import Tracks

REACH_IN_TIME = 0.6
"""Standard deviation of the time of an event, in halves of the time in which something was seen."""


AROUND = 5
"""Positions in a row whose middle is where a body was."""
LONGEST_STEP = 3
"""Frames between two positions up to which a body is taken to have gone straight from one to the other."""


@dataclass(frozen=True)
class Region:
    """The part of the table in which bodies were seen.

    Parameters
    ----------
    middle
        x and y in m of its middle.
    half_width
        Half its width in m along the axis along which it is wider.
    """

    middle: tuple[float, float]
    half_width: float

    @classmethod
    def of(cls, videos: Sequence[Tracks]) -> "Region":
        """The region of some videos."""
        low, high = _bounds(videos)
        x, y = ((low + high) / 2).tolist()
        return cls((x, y), float((high - low).max()) / 2)

    def expected(self, x: Parameter, y: Parameter, reach: float) -> dict[str, Parameter]:
        """A place, believed to lie around the middle of the region.

        Parameters
        ----------
        x, y
            Its coordinates as they are stated, for a scene around the origin.
        reach
            Standard deviation of each in half widths of the region; the stated one where that is larger.
        """
        width = reach * self.half_width
        return {one.name: _moved(one, middle, width) for one, middle in zip((x, y), self.middle, strict=True)}

    def expected_size(self, size: Parameter, share: float) -> dict[str, Parameter]:
        """A size, believed to be a share of half the width of the region, as far off as is stated."""
        middle = math.log(share * self.half_width)
        return {size.name: replace(size, prior=replace(size.prior, mean=middle), default=math.exp(middle))}

    def expected_distance(self, distance: Parameter, reach: float) -> dict[str, Parameter]:
        """A distance from the origin to something that lies as far from the middle of the region as is stated.

        Parameters
        ----------
        distance
            The distance, whose direction nobody knows.
        reach
            As in `expected`.
        """
        width = max(distance.prior.sd, reach * self.half_width)
        return {distance.name: _moved(distance, distance.prior.mean, math.hypot(width, *self.middle))}


def expected_time(videos: Sequence[Tracks], time: Parameter) -> dict[str, Parameter]:
    """A time at which something happens, believed to lie around the middle of all time stamps."""
    first, last = min(one.times[0] for one in videos), max(one.times[-1] for one in videos)
    return {time.name: _moved(time, float(first + last) / 2, REACH_IN_TIME * float(last - first) / 2)}


def usual_interval(videos: Sequence[Tracks]) -> float:
    """Time in s between two frames, the one in the middle."""
    return float(np.median(np.concatenate([np.diff(one.times) for one in videos])))


def _moved(parameter: Parameter, middle: float, width: float) -> Parameter:
    """A parameter that is its own coordinate, around another middle, with at least so wide a prior."""
    prior = replace(parameter.prior, mean=middle, sd=max(parameter.prior.sd, width))
    return replace(parameter, prior=prior, default=parameter.default + middle - parameter.prior.mean)


def places_around(videos: Sequence[Tracks], shares: Sequence[float]) -> list[tuple[float, float]]:
    """Points of a grid over the region where bodies were seen.

    Parameters
    ----------
    videos
        What was seen.
    shares
        Coordinates of the grid along each axis, in half widths of the region from its middle.
    """
    low, high = _bounds(videos)
    middle, half = (low + high) / 2, (high - low) / 2
    return [(float(middle[0] + u * half[0]), float(middle[1] + v * half[1])) for u, v in product(shares, shares)]


def visited(videos: Sequence[Tracks], step: float) -> list[tuple[float, float]]:
    """Points of a square grid, `step` m apart, near which a body was seen."""
    cells = np.unique(np.round(_paths(videos) / step).astype(int), axis=0)
    return [(float(x * step), float(y * step)) for x, y in cells]


def _bounds(videos: Sequence[Tracks]) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
    """Smallest and largest coordinates in m at which a body was seen."""
    paths = _paths(videos)
    return paths.min(axis=0), paths.max(axis=0)


def paths_of_bodies(videos: Sequence[Tracks]) -> list[tuple[float, list[Float[np.ndarray, "place 2"]]]]:
    """Radius and path in m of each body of each video: a radius that nobody states is 0, and no outlier counts.

    Each place is that in the middle of those around it. A path has several parts where a body was not seen for a while.
    """
    found = []
    for tracks in videos:
        for index, body in enumerate(tracks.bodies):
            frames = np.flatnonzero(tracks.seen[:, index])
            if len(frames):
                path = _without_outliers(tracks.positions[frames, index])
                gaps = np.flatnonzero(np.diff(frames) > LONGEST_STEP) + 1
                found.append((body.radius or 0.0, np.split(path, gaps)))
    return found


def _without_outliers(path: Float[np.ndarray, "place 2"]) -> Float[np.ndarray, "place 2"]:
    """A path of which each place is that in the middle of those around it."""
    smooth: np.ndarray = median_filter(path, size=(AROUND, 1), mode="mirror") if len(path) > AROUND else path
    return smooth


def _paths(videos: Sequence[Tracks]) -> Float[np.ndarray, "place 2"]:
    """Where bodies were seen in m."""
    return np.concatenate([part for _, path in paths_of_bodies(videos) for part in path])
