"""Cubes that pass something so closely that they would have met it, had they been turned otherwise.

That they did not meet it says something about their yaw, though the motion shows nothing of it. A yaw that kept its
default there could make the cube collide in the simulation where it passed in the video.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.search.free_flight import contact_distances
from vrdp_prob.scene import Shape, Tracks, Wall


def close_passes(tracks: Tracks, trajectory: Float[np.ndarray, "point time body number"]) -> frozenset[int]:
    """Cubes whose corners reach to where another body or a wall was, in some world, when they were nearest.

    Between frames bodies are taken to move along straight lines.

    Parameters
    ----------
    tracks
        The bodies, when each came in, and the walls.
    trajectory
        Positions x, y (m) in every frame of some worlds, and whatever else.
    """
    found: set[int] = set()
    cubes = {
        index: body.radius * body.shape.reach
        for index, body in enumerate(tracks.bodies)
        if body.shape is Shape.CUBE and body.radius is not None
    }
    positions, present = trajectory[..., :2], np.arange(len(tracks.times))[:, None] >= tracks.seen.argmax(axis=0)
    for pair in combinations(range(len(tracks.bodies)), 2):
        limits = contact_distances(*(tracks.bodies[body] for body in pair))
        if cubes.keys() & pair and limits is not None:
            together = present[:, pair].all(axis=1)
            apart = positions[:, together, pair[0]] - positions[:, together, pair[1]]
            if _nearest(apart) < limits[1]:
                found.update(cubes.keys() & pair)
    for wall in tracks.walls:
        found.update(
            body
            for body, reach in cubes.items()
            if body not in found and _nearest(_from_wall(positions[:, present[:, body], body], wall)) < reach
        )
    return frozenset(found)


def _nearest(apart: Float[np.ndarray, "point time 2"]) -> float:
    """Length (m) of the shortest of some vectors that change linearly from frame to frame; inf where none is known."""
    step = np.diff(apart, axis=1)
    length = (step**2).sum(axis=-1)
    along = -(apart[:, :-1] * step).sum(axis=-1) / np.where(length > 0, length, 1.0)
    between = apart[:, :-1] + np.clip(along, 0, 1)[..., None] * step
    distances = np.linalg.norm(np.concatenate([apart, between], axis=1), axis=-1)
    return float(np.min(distances, where=np.isfinite(distances), initial=np.inf))


def _from_wall(positions: Float[np.ndarray, "point time 2"], wall: Wall) -> Float[np.ndarray, "point time 2"]:
    """Vectors (m) to positions from the nearest points of a wall."""
    start, along = np.array([wall.x1, wall.y1]), np.array([wall.x2 - wall.x1, wall.y2 - wall.y1])
    share = np.clip((positions - start) @ along / (along @ along), 0, 1)
    return positions - (start + share[..., None] * along)
