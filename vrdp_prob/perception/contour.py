"""Fit a solid's outline to the edges in the picture, to a fraction of a pixel, where it can be seen."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from vrdp_prob.perception.solids import Outline, Pose, Solid
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_POINTS = 64
_SAMPLES = 17
_END_SAMPLES = 4
"""Samples at each end of a profile whose mean is the colour inside and outside."""
_CONTRAST = 14.0
"""Least difference of colour (brightness steps) across an edge that is measured."""
_MISMATCH = 0.22
"""Largest departure of a profile from a clean step, as a share of the contrast."""
_EDGE_BLUR = 1.6
"""Pixels over which a picture's edge is spread."""
_STEEP_WIDTH = 1.25
"""Pixels around the steepest place of a profile that are averaged."""
_REACH = 0.7
"""Share of the half length within which an edge counts."""
_BISQUARE = 4.7
_LEAST_SCALE = 0.08
"""Pixels; edges are never trusted more than this."""
_ROUNDS = 3
_FEWEST_EDGES = 12
_MISFIT_SCALE = 0.7
"""Pixels by which the edges of a solid of the right shape typically leave its outline."""
WORST_MISFIT = 9.0


@dataclass(frozen=True)
class Edges:
    """Where the picture's edges lie along the normals of an outline.

    Parameters
    ----------
    offset
        Distance of the edge from the outline along the outward normal, pixels.
    good
        Whether a clean edge was found there.
    visible
        Whether the outline's point lies in the picture and in front of everything else.
    """

    offset: Float[np.ndarray, "point"]
    good: Bool[np.ndarray, "point"]
    visible: Bool[np.ndarray, "point"]

    @property
    def support(self) -> float:
        """Share of the visible outline that lies on a clean edge (within a pixel or so)."""
        near = self.good & (np.abs(self.offset) < 1.5)
        return float(near.sum() / max(self.visible.sum(), 1))

    @property
    def misfit(self) -> float:
        """Mean over the visible outline of the squared distance to the edge, where there is none the worst."""
        squared = np.where(self.good, np.minimum((self.offset / _MISFIT_SCALE) ** 2, WORST_MISFIT), WORST_MISFIT)
        return float(squared[self.visible].mean()) if self.visible.any() else WORST_MISFIT


@dataclass(frozen=True)
class ContourFit:
    """Result of fitting an outline.

    Parameters
    ----------
    pose
        Fitted pose.
    scale
        Robust standard deviation of the edges about the outline, pixels.
    information
        Inverse covariance of (x, y, yaw) for edges of unit variance (pixels) that are independent of each other.
    used
        Share of the outline's points that entered.
    support
        Share of the visible outline that lies on a clean edge.
    misfit
        Mean squared distance of the visible outline to the edges, in units of what a right shape leaves, at most 9.
    """

    pose: Pose
    scale: float
    information: Float[np.ndarray, "3 3"]
    used: float
    support: float
    misfit: float


def measure_edges(
    picture: UInt8[np.ndarray, "height width 3"],
    outline: Outline,
    half: float,
    covered: UInt8[np.ndarray, "height width"] | None = None,
    *,
    rounded: bool = False,
) -> Edges:
    """Look for a step of colour along each normal, `half` pixels inward and outward.

    On flat faces the place of the step is where the mixture of inner and outer colour, summed along the profile, puts
    it. A sphere's shade changes up to its rim (`rounded`), which would shift that; there the steepest place counts.

    Points whose profile leaves the picture or meets something nearer (`covered` not 0) are left out.
    """
    reach = np.linspace(-half, half, _SAMPLES)
    step = reach[1] - reach[0]
    # the middle of the first pixel is at 0.5 for the camera and at 0 for OpenCV
    places = outline.pixels[:, None, :] + reach[None, :, None] * outline.normals[:, None, :] - 0.5
    across, down = (np.ascontiguousarray(places[..., axis], dtype=np.float32) for axis in (0, 1))
    height, width = picture.shape[:2]
    ends = places[:, [0, -1]]
    visible = ((ends > 0) & (ends < (width - 1, height - 1))).all(axis=(1, 2))
    if covered is not None:
        visible &= cv2.remap(covered, across, down, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE).max(axis=1) == 0
    colour = cv2.remap(picture, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(float)
    inside, outside = colour[:, :_END_SAMPLES].mean(axis=1), colour[:, -_END_SAMPLES:].mean(axis=1)
    difference = inside - outside
    contrast = np.linalg.norm(difference, axis=1)
    share = ((colour - outside[:, None]) * difference[:, None]).sum(axis=2) / np.maximum(contrast**2, 1e-6)[:, None]
    offset = np.clip(share, -0.3, 1.3).sum(axis=1) * step - half - step / 2
    if rounded:
        offset = _steepest(share, reach)
    ideal = np.clip((offset[:, None] - reach) / _EDGE_BLUR + 0.5, 0, 1)
    mismatch = np.sqrt(((share - ideal) ** 2).mean(axis=1))
    good = visible & (contrast > _CONTRAST) & (mismatch < _MISMATCH) & (np.abs(offset) < _REACH * half)
    return Edges(offset, good, visible)


def _steepest(
    share: Float[np.ndarray, "point sample"], reach: Float[np.ndarray, "sample"]
) -> Float[np.ndarray, "point"]:
    """Centre of the steepest fall of a profile."""
    fall = np.clip(share[:, :-1] - share[:, 1:], 0, None)
    middle = (reach[1:] + reach[:-1]) / 2
    smooth = fall.copy()
    smooth[:, 1:] += fall[:, :-1]
    smooth[:, :-1] += fall[:, 1:]
    place = middle[smooth.argmax(axis=1)]
    width = _STEEP_WIDTH + middle[1] - middle[0]
    for _ in range(2):
        weights = fall * np.clip(1 - ((middle - place[:, None]) / width) ** 4, 0, 1)
        total = weights.sum(axis=1)
        place = np.where(total > 1e-9, (weights * middle).sum(axis=1) / np.maximum(total, 1e-9), place)
    return place


def fit_contour(
    picture: UInt8[np.ndarray, "height width 3"],
    camera: Camera,
    solid: Solid,
    pose: Pose,
    *,
    halves: tuple[float, ...],
    covered: UInt8[np.ndarray, "height width"] | None = None,
) -> ContourFit | None:
    """Fit a solid's pose by Gauss-Newton on the distances from outline to edge; None where too few edges show.

    Parameters
    ----------
    picture
        The frame.
    camera
        The camera.
    solid
        What is looked for.
    pose
        Where to start.
    halves
        Half length in pixels of the profiles, one per step of the fit.
    covered
        Not 0 where something nearer hides the solid.
    """
    count = 3 if solid.shape is Shape.CUBE else 2
    scale, information, weights, edges = 1.0, np.zeros((3, 3)), np.zeros(_POINTS), None
    for half in halves:
        outline = solid.outline(camera, pose, _POINTS)
        edges = measure_edges(picture, outline, half, covered, rounded=solid.shape is Shape.SPHERE)
        if edges.good.sum() < _FEWEST_EDGES:
            return None
        sensitivity = outline.sensitivity(camera, pose)[:, :count]
        step, scale, weights = _robust_step(sensitivity, edges.offset, edges.good)
        limit = 1.0 * half / max(float(np.linalg.norm(sensitivity[:, :2], axis=1).mean()), 1e-9)
        length = float(np.linalg.norm(step[:2]))
        step = step * min(1.0, limit / max(length, 1e-12))
        pose = pose.moved(*step)
        information = np.zeros((3, 3))
        information[:count, :count] = (sensitivity * weights[:, None]).T @ sensitivity
    if edges is None:
        return None
    return ContourFit(pose, scale, information, float((weights > 0.1).mean()), edges.support, edges.misfit)


def _robust_step(
    sensitivity: Float[np.ndarray, "point parameter"],
    offset: Float[np.ndarray, "point"],
    good: Bool[np.ndarray, "point"],
) -> tuple[Float[np.ndarray, "parameter"], float, Float[np.ndarray, "point"]]:
    """Weighted least squares with bisquare weights; step, scale and weights."""
    weights = good.astype(float)
    ridge = 1e-6 * np.eye(sensitivity.shape[1])
    step, scale = np.zeros(sensitivity.shape[1]), 1.0
    for _ in range(_ROUNDS):
        weighted = sensitivity * weights[:, None]
        step = np.linalg.solve(weighted.T @ sensitivity + ridge, weighted.T @ offset)
        residual = np.abs(offset - sensitivity @ step)
        scale = max(_LEAST_SCALE, 1.4826 * float(np.median(residual[good])))
        weights = good * np.clip(1 - (residual / (_BISQUARE * scale)) ** 2, 0, None) ** 2
    return step, scale, weights
