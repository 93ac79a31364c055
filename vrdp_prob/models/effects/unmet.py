"""How large something fixed may be that stands in the way and that no body has met, by where bodies were."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from vrdp_prob.models.effects.places import paths_of_bodies
from vrdp_prob.models.roughness import noise_scale
from vrdp_prob.scene import Tracks

CELLS = 128
"""Cells along the wider axis of the region in which discs are looked for."""
SIZES = 10
"""Sizes of bodies that are told apart; each is taken for the next smaller one, which leaves more room."""
ROUNDING = 1e-9
"""Distance in m by which a place may seem to lie outside of itself."""
NOISE = 3.0
"""Standard deviations of the noise by which a body may seem to have been inside of what it touched."""
DIRECTIONS = 360
"""Directions in which walls (over half a turn) and the edge of the region (over a whole turn) are looked for."""


@dataclass(frozen=True)
class Unmet:
    """The largest thing that no body has met.

    Parameters
    ----------
    size
        How large it may be, in m.
    words
        What the size is.
    """

    size: float
    words: str


def largest_disc(videos: Sequence[Tracks]) -> Unmet:
    """The largest disc that fits between the paths of bodies, its middle anywhere in their convex hull.

    Parameters
    ----------
    videos
        What was seen. A body without a stated radius is where its middle is.

    Returns
    -------
    Its radius in m, rather too large than too small: by the size of a cell, and by up to a tenth of what radii of
    bodies differ by. Where a body was not seen for a while nobody knows where it went.
    """
    bodies = _passages(videos)
    everywhere = np.concatenate([part for _, path in bodies for part in path])
    low, high = everywhere.min(axis=0), everywhere.max(axis=0)
    cell = float((high - low).max()) / CELLS
    middles = _grid(low, high, cell)
    middles = middles[_enclosed(middles, everywhere, cell or ROUNDING)]
    room = np.full(len(middles), np.inf)
    reaches = np.array([reach for reach, _ in bodies])
    step = float(np.ptp(reaches)) / SIZES or 1.0
    size_of = np.floor((reaches - reaches.min()) / step)
    for size in np.unique(size_of):
        places = np.concatenate([_dense(part, cell) for k in np.flatnonzero(size_of == size) for part in bodies[k][1]])
        distance, _ = KDTree(places).query(middles)
        room = np.minimum(room, distance - (reaches.min() + size * step))
    # between two points of the grid there is at most half a diagonal of a cell more room than at the nearest of them
    return Unmet(max(float(room.max()) + cell / math.sqrt(2), 0.0), "radius of a disc that fits between all paths")


def deepest_wall(videos: Sequence[Tracks]) -> Unmet:
    """How far an endless straight wall may stand within the region where bodies were, with all of a path on one side.

    Parameters
    ----------
    videos
        What was seen. A body without a stated radius is where its middle is.

    Returns
    -------
    The distance in m from the wall to the edge of the region on its nearer side; 0 where a wall may only be outside.
    """
    turns = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    normals = np.stack([np.cos(turns), np.sin(turns)])
    along = [(reach, np.concatenate(path) @ normals) for reach, path in _passages(videos)]
    first = np.array([heights.min(axis=0) - reach for reach, heights in along])
    last = np.array([heights.max(axis=0) + reach for reach, heights in along])
    words = "depth of a wall in the region where bodies were, between all paths"
    return Unmet(max(map(_depth, first.T, last.T)), words)


def _passages(videos: Sequence[Tracks]) -> list[tuple[float, list[Float[np.ndarray, "place 2"]]]]:
    """How far around its middle nothing else was, and the path in its parts, in m, of each body of each video."""
    return [
        (radius - NOISE * noise, path)
        for tracks, noise in ((one, np.nan_to_num(noise_scale(one))) for one in videos)
        for radius, path in paths_of_bodies([tracks])
    ]


def _depth(first: Float[np.ndarray, "body"], last: Float[np.ndarray, "body"]) -> float:
    """Depth of the deepest place between the ends of some intervals that lies in none of them."""
    low, high = float(first.min()), float(last.max())
    order = np.argsort(first)
    ends, starts = np.maximum.accumulate(last[order])[:-1], first[order][1:]
    free = starts > ends
    places = np.clip((low + high) / 2, ends[free], starts[free])
    return float(np.minimum(places - low, high - places).max(initial=0.0))


def _grid(low: Float[np.ndarray, "2"], high: Float[np.ndarray, "2"], cell: float) -> Float[np.ndarray, "place 2"]:
    """Points of a square grid over a rectangle, and past its upper edges by less than a cell."""
    counts = np.ceil((high - low) / cell).astype(int) + 1 if cell else np.ones(2, dtype=int)
    axes = [start + cell * np.arange(count) for start, count in zip(low, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _enclosed(places: Float[np.ndarray, "place 2"], among: Float[np.ndarray, "other 2"], margin: float) -> np.ndarray:
    """Which places lie in the convex hull of others, or at most by a margin outside of it."""
    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    normals = np.stack([np.cos(turns), np.sin(turns)])
    inside: np.ndarray = (places @ normals <= (among @ normals).max(axis=0) + margin).all(axis=1)
    return inside


def _dense(path: Float[np.ndarray, "place 2"], step: float) -> Float[np.ndarray, "denser 2"]:
    """A path with further places between those that are farther apart than a step."""
    if len(path) < 2 or step <= 0:
        return path
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    at = [np.linspace(0, 1, math.ceil(length / step) + 1)[:-1] for length in lengths.tolist()]
    parts = [path[k] + share[:, None] * (path[k + 1] - path[k]) for k, share in enumerate(at)]
    return np.concatenate([*parts, path[-1:]])
