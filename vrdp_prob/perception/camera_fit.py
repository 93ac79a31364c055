"""Find the camera from points of known place on a plane and their pixels.

Points on one plane fix only the plane's homography, eight numbers. A camera with square pixels, no distortion and its
principal point in the middle of the picture has seven (focal length, rotation, place), so that it is determined.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vrdp_prob.errors import InputError
from vrdp_prob.scene.camera import Camera

_FEWEST_POINTS = 6
_FLATTEST = 0.02
"""Least ratio of the points' extents on the plane: a line of points does not determine a camera."""
_FOCAL_STARTS = (0.8, 1.5, 3.0, 6.0)
"""Focal lengths in picture widths that are tried beside the closed form."""
_ONE_SIGMA = 0.683
"""Share of a normal error within one standard deviation."""
_ROBUST_PIXELS = 1.0
"""Reprojection error in pixels from which a point loses weight."""


@dataclass(frozen=True)
class PictureSize:
    """Size of a picture in pixels and its frame rate.

    Parameters
    ----------
    width, height
        Pixels.
    frame_rate
        Frames per second, None where it is not known.
    """

    width: int
    height: int
    frame_rate: float | None = None

    @property
    def middle(self) -> Float[np.ndarray, "2"]:
        """The principal point that is assumed."""
        return np.array([self.width / 2, self.height / 2])


def calibrate_camera(
    positions: Float[np.ndarray, "point 2"],
    pixels: Float[np.ndarray, "point 2"],
    height: float,
    size: PictureSize,
) -> Camera:
    """Camera that sees points of a horizontal plane at given pixels.

    Parameters
    ----------
    positions
        Places (x, y) in m on the plane z = `height`.
    pixels
        Where they appear; a few wrong ones do no harm.
    height
        Height of the plane in m.
    size
        The picture.

    Returns
    -------
    Camera
        With `pixel_sd`, the reprojection error per coordinate within which 68 % of the points lie.

    Raises
    ------
    InputError
        If there are too few points, they lie on a line, or no camera above the plane explains them.

    Notes
    -----
    The focal length follows from the homography in closed form (Zhang, A flexible new technique for camera calibration,
    2000, with the principal point known); then all seven numbers are refined on the reprojection error with a soft
    absolute loss.
    """
    extent = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False) if len(positions) > 1 else np.zeros(2)
    if len(positions) < _FEWEST_POINTS or extent[-1] < _FLATTEST * extent[0]:
        raise InputError(
            f"calibration: {len(positions)} matched points do not determine a camera; give at least {_FEWEST_POINTS} "
            "that do not lie on one line, for example from more videos."
        )
    homography = fit_homography(positions, pixels)
    best: tuple[float, Float[np.ndarray, "parameter"]] | None = None
    for focal in _focal_lengths(homography, size):
        start = _pose(homography, focal, height, size)
        if start is None:
            continue
        fit = least_squares(
            _residuals,
            start,
            loss="soft_l1",
            f_scale=_ROBUST_PIXELS,
            args=(positions, pixels, height, size),
            x_scale="jac",
        )
        if np.isfinite(fit.cost) and (best is None or fit.cost < best[0]):
            best = (float(fit.cost), fit.x)
    if best is None:
        raise InputError(
            "calibration: no camera above the plane explains the matched points; check that positions and videos "
            "belong together."
        )
    residual = _residuals(best[1], positions, pixels, height, size)
    spread = float(np.quantile(np.abs(residual), _ONE_SIGMA))
    return Camera(_projection(best[1], size), size.width, size.height, size.frame_rate, pixel_sd=spread)


def fit_homography(
    positions: Float[np.ndarray, "*batch point 2"], pixels: Float[np.ndarray, "*batch point 2"]
) -> Float[np.ndarray, "*batch 3 3"]:
    """Homography from plane to picture by the direct linear transform; a batch of point sets at once.

    Source: Hartley and Zisserman, Multiple View Geometry, section 4.1, with normalised coordinates (4.4).
    """
    source, source_scale = _normalised(positions)
    target, target_scale = _normalised(pixels)
    ones, zeros = np.ones_like(source[..., :1]), np.zeros((*source.shape[:-1], 3))
    point = np.concatenate([source, ones], axis=-1)
    rows = np.concatenate(
        [
            np.concatenate([point, zeros, -target[..., :1] * point], axis=-1),
            np.concatenate([zeros, point, -target[..., 1:] * point], axis=-1),
        ],
        axis=-2,
    )
    vector = np.linalg.svd(rows, full_matrices=True)[2][..., -1, :]
    inner = vector.reshape(*vector.shape[:-1], 3, 3)
    homography: Float[np.ndarray, "*batch 3 3"] = np.linalg.inv(target_scale) @ inner @ source_scale
    return homography


def apply_homography(
    homography: Float[np.ndarray, "*batch 3 3"], positions: Float[np.ndarray, "point 2"]
) -> Float[np.ndarray, "*batch point 3"]:
    """Homogeneous pixels (u w, v w, w) of points of the plane."""
    points = np.column_stack([positions, np.ones(len(positions))])
    pixels: Float[np.ndarray, "*batch point 3"] = points @ np.swapaxes(homography, -1, -2)
    return pixels


def _normalised(
    points: Float[np.ndarray, "*batch point 2"],
) -> tuple[Float[np.ndarray, "*batch point 2"], Float[np.ndarray, "*batch 3 3"]]:
    middle = points.mean(axis=-2, keepdims=True)
    scale = np.sqrt(2) / np.maximum(np.linalg.norm(points - middle, axis=-1).mean(axis=-1), 1e-9)
    matrix = np.zeros((*scale.shape, 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = scale
    matrix[..., :2, 2] = -scale[..., None] * middle[..., 0, :]
    matrix[..., 2, 2] = 1.0
    return (points - middle) * scale[..., None, None], matrix


def _focal_lengths(homography: Float[np.ndarray, "3 3"], size: PictureSize) -> list[float]:
    """Focal lengths in pixels to start from: the one that makes the plane's axes orthogonal and equally long, first."""
    shift = np.eye(3)
    shift[:2, 2] = -size.middle
    first, second = (shift @ homography)[:, :2].T
    flat = np.array([first[:2] @ second[:2], first[:2] @ first[:2] - second[:2] @ second[:2]])
    deep = np.array([first[2] * second[2], first[2] ** 2 - second[2] ** 2])
    inverse_square = -float(flat @ deep) / max(float(flat @ flat), 1e-300)
    starts = [size.width * factor for factor in _FOCAL_STARTS]
    return [inverse_square**-0.5, *starts] if inverse_square > 0 else starts


def _pose(
    homography: Float[np.ndarray, "3 3"], focal: float, height: float, size: PictureSize
) -> Float[np.ndarray, "7"] | None:
    """Log focal length, rotation vector and translation of a camera above the plane."""
    inverse = np.array([[1 / focal, 0, -size.middle[0] / focal], [0, 1 / focal, -size.middle[1] / focal], [0, 0, 1.0]])
    columns = inverse @ homography
    columns /= np.sqrt(np.linalg.norm(columns[:, 0]) * np.linalg.norm(columns[:, 1]))
    if columns[2, 2] < 0:
        columns = -columns
    left, _, right = np.linalg.svd(
        np.column_stack([columns[:, 0], columns[:, 1], np.cross(columns[:, 0], columns[:, 1])])
    )
    rotation = left @ right
    translation = columns[:, 2] - height * rotation[:, 2]
    centre = -rotation.T @ translation
    if np.linalg.det(rotation) < 0 or centre[2] <= height:
        return None
    return np.array([np.log(focal), *Rotation.from_matrix(rotation).as_rotvec(), *translation])


def _projection(parameters: Float[np.ndarray, "7"], size: PictureSize) -> Float[np.ndarray, "3 4"]:
    focal = np.exp(parameters[0])
    intrinsic = np.array([[focal, 0, size.middle[0]], [0, focal, size.middle[1]], [0, 0, 1.0]])
    rotation = Rotation.from_rotvec(parameters[1:4]).as_matrix()
    matrix: Float[np.ndarray, "3 4"] = intrinsic @ np.column_stack([rotation, parameters[4:]])
    return matrix


def _residuals(
    parameters: Float[np.ndarray, "7"],
    positions: Float[np.ndarray, "point 2"],
    pixels: Float[np.ndarray, "point 2"],
    height: float,
    size: PictureSize,
) -> Float[np.ndarray, "residual"]:
    points = np.column_stack([positions, np.full(len(positions), height), np.ones(len(positions))])
    homogeneous = points @ _projection(parameters, size).T
    depth = np.where(np.abs(homogeneous[:, 2]) > 1e-9, homogeneous[:, 2], 1e-9)
    return np.ravel(homogeneous[:, :2] / depth[:, None] - pixels)
