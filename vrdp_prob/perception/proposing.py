"""Find objects that are not followed yet among the pixels that nothing explains."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from vrdp_prob.perception.appearance import Appearance, Evidence
from vrdp_prob.perception.placing import Placer
from vrdp_prob.perception.region import Gain, Window, apparent_radius, climb, paint, polygon_area
from vrdp_prob.perception.solids import Pose, Solid
from vrdp_prob.scene.body import Shape

_YAWS = tuple(np.radians((0.0, 22.5, 45.0, 67.5)))
_STARTS = ((0, 0), (0.7, 0), (-0.7, 0), (0, 0.7), (0, -0.7))
"""Offsets of the first guess from the middle of the unexplained patch, in apparent radii."""
_STEPS = (0.4, 0.2, 0.1, 0.05)
_KEPT = 4
"""Starts that are followed uphill."""
_LEAST_PATCH = 0.15
"""Smallest patch that is looked at, as a share of a sphere's picture there."""
_LEAST_VISIBLE = 0.3
_LEAST_FILLED = 0.75
"""Share of the visible picture that must be unexplained, and share of the patch that must be covered."""
_HUE_WIDTH = 14
"""Half width of a patch's main hue in OpenCV's steps of two degrees."""
_COLOURFUL = 50
_ONE_COLOUR = 0.75

_DARK_PATCH = 0.6
_DARK_VISIBLE = 0.6
_DARK_FILLED = 0.88
_DARK_SUPPORT = 0.6
_DARK_GRID = 0.3
"""Spacing of the places that are tried in a dark patch, in apparent radii."""


@dataclass(frozen=True)
class Proposal:
    """An object that seems to be there.

    Parameters
    ----------
    shape
        The shape that fits best so far.
    pose
        Where it is.
    appearance
        Its colours.
    """

    shape: Shape
    pose: Pose
    appearance: Appearance


def propose(
    placer: Placer,
    evidence: Evidence,
    explained: UInt8[np.ndarray, "height width"],
    radius: float,
    *,
    gray: bool = True,
) -> list[Proposal]:
    """New objects in one frame, given the pixels that belong to known ones; the search for gray ones takes longest."""
    near = cv2.dilate(explained, np.ones((7, 7), np.uint8)) > 0
    found: list[Proposal] = []
    for patch in _patches(evidence.strange & ~near):
        if patch.sum() >= _LEAST_PATCH * _sphere_area(placer, patch, radius):
            proposal = _from_colour(placer, evidence, _main_colour(evidence, patch), explained, radius)
            found += [proposal] if proposal else []
    if found or not gray:
        return found
    for patch in _patches((evidence.dark | evidence.strange) & ~near):
        if patch.sum() >= _DARK_PATCH * _sphere_area(placer, patch, radius):
            proposal = _from_edges(placer, evidence, patch, explained, radius)
            found += [proposal] if proposal else []
    return found


def _patches(mask: Bool[np.ndarray, "height width"]) -> list[Bool[np.ndarray, "height width"]]:
    if not mask.any():
        return []
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    order = sorted(range(1, count), key=lambda label: -statistics[label, cv2.CC_STAT_AREA])
    return [labels == label for label in order if statistics[label, cv2.CC_STAT_AREA] >= 12]


def _middle(patch: Bool[np.ndarray, "height width"]) -> tuple[float, float]:
    rows, columns = np.nonzero(patch)
    return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5


def _sphere_area(placer: Placer, patch: Bool[np.ndarray, "height width"], radius: float) -> float:
    x, y = placer.camera.to_plane(np.array(_middle(patch)), radius)
    return float(np.pi * apparent_radius(placer.camera, Solid(Shape.SPHERE, radius), Pose(float(x), float(y))) ** 2)


def _main_colour(evidence: Evidence, patch: Bool[np.ndarray, "height width"]) -> Bool[np.ndarray, "height width"]:
    """The part of a patch that has its commonest hue, where it holds objects of several."""
    colours = cv2.cvtColor(evidence.picture[patch][None], cv2.COLOR_RGB2HSV)[0]
    vivid = colours[:, 1] > _COLOURFUL
    if vivid.mean() < 1 - _ONE_COLOUR:
        return patch
    counts = np.bincount(colours[vivid, 0], minlength=180).astype(float)
    around = sum(np.roll(counts, shift) for shift in range(-4, 5))
    distance = np.abs((colours[:, 0].astype(int) - int(np.argmax(around)) + 90) % 180 - 90)
    same = vivid & (distance <= _HUE_WIDTH)
    if same.mean() >= _ONE_COLOUR:
        return patch
    part = np.zeros(patch.shape, dtype=np.uint8)
    part[patch] = same
    pieces = _patches(cv2.morphologyEx(part, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)).astype(bool))
    return pieces[0] if pieces else patch


def _from_colour(
    placer: Placer,
    evidence: Evidence,
    patch: Bool[np.ndarray, "height width"],
    explained: UInt8[np.ndarray, "height width"],
    radius: float,
) -> Proposal | None:
    """A solid whose picture covers a patch of one colour."""
    appearance = Appearance()
    appearance.learn(evidence.bins[patch])
    gain = Gain.of(evidence, appearance, explained, [])
    middle = np.array(_middle(patch))
    trials: list[tuple[float, Solid, Pose]] = []
    for solid, yaw in _forms(radius):
        size = np.sqrt(_sphere_area(placer, patch, radius) / np.pi)
        for offset in _STARTS:
            x, y = placer.camera.to_plane(middle + size * np.array(offset), radius)
            pose = Pose(float(x), float(y), yaw)
            trials.append((gain.score(solid.polygon(placer.camera, pose)), solid, pose))
    trials.sort(key=lambda trial: -trial[0])
    chosen = [next((trial for trial in trials if trial[1].shape is shape), trials[0]) for shape in Shape]
    best: tuple[float, Solid, Pose] | None = None
    for _, solid, start in [*chosen, *trials[:_KEPT]]:
        pose, value = climb(gain, placer.camera, solid, start, _STEPS)
        if best is None or value > best[0]:
            best = (value, solid, pose)
    if best is None or not _fills(placer, best[1], best[2], patch=patch, wanted=evidence.strange, explained=explained):
        return None
    return Proposal(best[1].shape, best[2], appearance)


def _forms(radius: float) -> list[tuple[Solid, float]]:
    cubes = [(Solid(Shape.CUBE, radius), yaw) for yaw in _YAWS]
    return [(Solid(Shape.SPHERE, radius), 0.0), (Solid(Shape.CYLINDER, radius), 0.0), *cubes]


def _fills(
    placer: Placer,
    solid: Solid,
    pose: Pose,
    *,
    patch: Bool[np.ndarray, "height width"],
    wanted: Bool[np.ndarray, "height width"],
    explained: UInt8[np.ndarray, "height width"],
) -> bool:
    """Whether the solid's picture and the patch cover each other and enough of it shows."""
    window, free, shown = _visible(placer, solid, pose, explained)
    if shown < _LEAST_VISIBLE:
        return False
    filled = (wanted[window.place] & free).sum() / free.sum()
    covered = (patch[window.place] & (window.mask > 0)).sum() / patch.sum()
    return bool(filled >= _LEAST_FILLED and covered >= _LEAST_FILLED)


def _from_edges(
    placer: Placer,
    evidence: Evidence,
    patch: Bool[np.ndarray, "height width"],
    explained: UInt8[np.ndarray, "height width"],
    radius: float,
) -> Proposal | None:
    """A gray solid: its pixels could be shadow, but a shadow has no such outline."""
    dark = evidence.dark | evidence.strange
    size = np.sqrt(_sphere_area(placer, patch, radius) / np.pi)
    rows, columns = np.nonzero(patch)
    best: tuple[float, Solid, Pose] | None = None
    for v in np.arange(rows.min(), rows.max() + 1, _DARK_GRID * size):
        for u in np.arange(columns.min(), columns.max() + 1, _DARK_GRID * size):
            x, y = placer.camera.to_plane(np.array([u + 0.5, v + 0.5]), radius)
            for solid, yaw in _forms(radius):
                start = Pose(float(x), float(y), yaw)
                if _dark_share(placer, solid, start, dark, explained) < 0.8 * _DARK_FILLED:
                    continue
                fit = placer.refine(evidence, solid, start, explained)
                if fit is None or (best is not None and fit.support <= best[0]):
                    continue
                if _dark_share(placer, solid, fit.pose, dark, explained) >= _DARK_FILLED:
                    best = (fit.support, solid, fit.pose)
    if best is None or best[0] < _DARK_SUPPORT:
        return None
    window = placer.window(best[1], best[2])
    appearance = Appearance()
    appearance.learn(evidence.bins[window.place][(window.mask > 0) & dark[window.place]])
    return Proposal(best[1].shape, best[2], appearance)


def _dark_share(
    placer: Placer,
    solid: Solid,
    pose: Pose,
    dark: Bool[np.ndarray, "height width"],
    explained: UInt8[np.ndarray, "height width"],
) -> float:
    """Share of the solid's visible picture that is dark; 0 where too little shows."""
    window, free, shown = _visible(placer, solid, pose, explained)
    return float((dark[window.place] & free).sum() / free.sum()) if shown >= _DARK_VISIBLE else 0.0


def _visible(
    placer: Placer, solid: Solid, pose: Pose, explained: UInt8[np.ndarray, "height width"]
) -> tuple[Window, Bool[np.ndarray, "row column"], float]:
    """A solid's window, its pixels there that nothing else explains, and their share of its whole picture."""
    polygon = solid.polygon(placer.camera, pose)
    window = paint(polygon, *explained.shape)
    free = (window.mask > 0) & (explained[window.place] == 0)
    return window, free, float(free.sum() / polygon_area(polygon))
