"""Geometry of the page's static figures: tracks and rollouts as SVG paths."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.report.content import FACTUAL, FUTURE, ReportContent, WorldContent
from vrdp_prob.report.wording import color_of, tags
from vrdp_prob.scene import Camera
from vrdp_prob.scene.camera import REST_HEIGHT

FIGURE_DRAWS = 24
"""Rollouts drawn in the still figure."""

_PLAIN_WIDTH, _PLAIN_HEIGHT = 480, 320

Projection = Callable[[Float[np.ndarray, "*points 2"]], Float[np.ndarray, "*points 2"]]


@dataclass(frozen=True)
class TrackFigure:
    """One body in the still figure; all paths in picture coordinates (pixels).

    Parameters
    ----------
    color, tag
        Colour name and mark of the body.
    dots
        Measured positions, thinned.
    seen, future
        SVG path data of each rollout until the last frame seen, and after it.
    ends
        Where each rollout stands at the end of the future.
    label
        Where the mark stands.
    """

    color: str
    tag: str
    dots: list[tuple[float, float]]
    seen: list[str]
    future: list[str]
    ends: list[tuple[float, float]]
    label: tuple[float, float]


@dataclass(frozen=True)
class StillFigure:
    """Tracks and rollouts as the camera sees them, or from above where there is no camera."""

    width: int
    height: int
    walls: list[str]
    tracks: list[TrackFigure]


def still_figure(content: ReportContent) -> StillFigure:
    """Tracks and posterior rollouts in picture coordinates."""
    camera = content.tracks.camera
    projection = plane_projection(content) if camera is None else camera_projection(camera, _height(content))
    width, height = (_PLAIN_WIDTH, _PLAIN_HEIGHT) if camera is None else (camera.width, camera.height)
    tag = tags(content.tracks.bodies)
    figures = []
    for index, body in enumerate(content.tracks.bodies):
        measured = projection(content.tracks.positions[:, index])
        measured = measured[np.isfinite(measured).all(axis=-1)]
        seen, future, ends = _rollouts(content, index, projection, (width, height))
        figures.append(
            TrackFigure(
                color_of(body, index),
                tag[body.id],
                _points(_thinned(measured, 4.0)),
                seen,
                future,
                ends,
                _points(measured[-1:])[0],
            )
        )
    walls = [path_data(projection(ends)) for ends in _wall_ends(content)]
    return StillFigure(width, height, walls, figures)


def _wall_ends(content: ReportContent) -> list[Float[np.ndarray, "end 2"]]:
    return [np.array([[wall.x1, wall.y1], [wall.x2, wall.y2]]) for wall in content.tracks.walls]


def camera_projection(camera: Camera, height: float) -> Projection:
    """Picture coordinates (pixels) of points of the plane at a height (m)."""

    def project(points: Float[np.ndarray, "*points 2"]) -> Float[np.ndarray, "*points 2"]:
        raised = np.concatenate([points, np.full((*points.shape[:-1], 1), height)], axis=-1)
        return camera.project(raised)

    return project


def plane_projection(content: ReportContent) -> Projection:
    """Figure coordinates of points of the plane seen from above, with all measured positions in the figure."""
    positions = np.concatenate([content.tracks.positions.reshape(-1, 2), *_wall_ends(content)])
    low, high = np.nanmin(positions, axis=0), np.nanmax(positions, axis=0)
    room = np.array([_PLAIN_WIDTH, _PLAIN_HEIGHT]) * 0.8
    scale = float((room / np.maximum(high - low, 1e-6)).min())
    middle, centre = (low + high) / 2, np.array([_PLAIN_WIDTH, _PLAIN_HEIGHT]) / 2

    def project(points: Float[np.ndarray, "*points 2"]) -> Float[np.ndarray, "*points 2"]:
        return centre + scale * (points - middle) * np.array([1.0, -1.0])

    return project


def _height(content: ReportContent) -> float:
    radii = [body.radius for body in content.tracks.bodies if body.radius is not None]
    return float(np.median(radii)) if radii else REST_HEIGHT


def _rollouts(
    content: ReportContent, index: int, projection: Projection, size: tuple[int, int]
) -> tuple[list[str], list[str], list[tuple[float, float]]]:
    seen = _paths(content.world(FACTUAL), index, projection)
    future = _paths(content.world(FUTURE), index, projection)
    ends = [_points(path[-1:])[0] for path in future if _inside(path[-1], size)]
    return _drawn(seen, size), _drawn(future, size), ends


def _paths(world: WorldContent | None, index: int, projection: Projection) -> list[Float[np.ndarray, "_ 2"]]:
    """Where a body goes in each draw, in figure coordinates."""
    if world is None:
        return []
    points = [
        projection(world.trajectory[draw, world.exists[draw, :, index], index, :2])
        for draw in range(min(world.draws, FIGURE_DRAWS))
    ]
    return [path for path in points if len(path)]


def _drawn(paths: list[Float[np.ndarray, "_ 2"]], size: tuple[int, int]) -> list[str]:
    data = [path_data(_clipped(path, size)) for path in paths]
    return [path for path in data if path]


def _inside(point: Float[np.ndarray, "2"], size: tuple[int, int]) -> bool:
    return bool((point >= -20).all() and (point <= np.array(size) + 20).all())


def _clipped(points: Float[np.ndarray, "time 2"], size: tuple[int, int]) -> Float[np.ndarray, "kept 2"]:
    """The part of a path from its first to its last point in or near the picture."""
    near = np.flatnonzero([_inside(point, size) for point in points])
    return points[near[0] : near[-1] + 1] if len(near) else points[:0]


def path_data(points: Float[np.ndarray, "time 2"]) -> str:
    """SVG path through points, thinned to what can be seen; empty where fewer than two are left."""
    kept = _simplified(points, 0.35)
    if len(kept) < 2:
        return ""
    return "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in kept)


def _simplified(points: Float[np.ndarray, "time 2"], tolerance: float) -> Float[np.ndarray, "kept 2"]:
    """Fewest points (Ramer, Douglas and Peucker) whose polygon stays within a tolerance of all of them."""
    if len(points) < 3:
        return points
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        chord = points[last] - points[first]
        offsets = points[first + 1 : last] - points[first]
        along = np.clip(offsets @ chord / max(float(chord @ chord), 1e-12), 0, 1)
        distances = np.linalg.norm(offsets - along[:, None] * chord, axis=-1)
        if len(distances) and distances.max() > tolerance:
            middle = first + 1 + int(distances.argmax())
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points[keep]


def _thinned(points: Float[np.ndarray, "time 2"], spacing: float) -> Float[np.ndarray, "kept 2"]:
    """Points at least a spacing (pixels) apart, the first one always."""
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) >= spacing:
            kept.append(point)
    return np.array(kept)


def _points(points: Float[np.ndarray, "count 2"]) -> list[tuple[float, float]]:
    return [(round(float(u), 1), round(float(v), 1)) for u, v in points]
