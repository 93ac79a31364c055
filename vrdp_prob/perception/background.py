"""The empty floor, seen through the objects that stand on it.

A temporal median alone takes an object that rests for the whole video for floor. Here a smooth surface is fitted
robustly to the median picture; where the median departs from it, the frames that agree with the surface are asked, and
where none does, the surface itself is the floor.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, UInt8
from numpy.polynomial import legendre

from vrdp_prob.spread import evenly_spread

_SAMPLED_FRAMES = 41
_GRID_STEP = 6
"""Pixels between the points to which the surface is fitted."""
_DEGREE = 7
_ROUNDS = 12
_BISQUARE = 4.7
_MINIMUM_TOLERANCE = 8.0
"""Brightness steps by which a floor pixel may leave the surface at least."""
_ENOUGH_FRAMES = 3


@dataclass(frozen=True)
class Background:
    """The floor without objects.

    Parameters
    ----------
    picture
        Colour of the floor at each pixel, 0 to 255.
    spread
        Typical departure of the real floor from it, in brightness steps.
    """

    picture: Float[np.ndarray, "height width 3"]
    spread: float

    @cached_property
    def rounded(self) -> UInt8[np.ndarray, "height width 3"]:
        """The floor as a picture."""
        return np.clip(np.rint(self.picture), 0, 255).astype(np.uint8)


def estimate_background(frames: UInt8[np.ndarray, "frame height width 3"]) -> Background:
    """Estimate the empty floor of a video of a fixed camera."""
    chosen = evenly_spread(_SAMPLED_FRAMES, len(frames))
    sample = np.sort(frames[chosen], axis=0)
    median = sample[len(sample) // 2].astype(np.float32)
    surface, spread = _smooth_surface(median)
    tolerance = max(_MINIMUM_TOLERANCE, _BISQUARE * spread)
    agrees = np.abs(median - surface).max(axis=-1) <= tolerance
    picture = np.where(agrees[..., None], median, surface)
    rows, columns = np.nonzero(~agrees)
    values = frames[chosen][:, rows, columns].astype(np.float32)
    near = np.abs(values - surface[rows, columns]).max(axis=-1) <= tolerance
    count = near.sum(axis=0)
    mean = (values * near[..., None]).sum(axis=0) / np.maximum(count, 1)[:, None]
    picture[rows, columns] = np.where((count >= _ENOUGH_FRAMES)[:, None], mean, surface[rows, columns])
    return Background(picture.astype(float), spread)


def _smooth_surface(picture: Float[np.ndarray, "height width 3"]) -> tuple[Float[np.ndarray, "height width 3"], float]:
    """Robust polynomial surface through a picture, and the scale of what it leaves."""
    height, width = picture.shape[:2]
    rows, columns = np.arange(0, height, _GRID_STEP), np.arange(0, width, _GRID_STEP)
    basis = _basis(rows / height, columns / width)
    values = picture[np.ix_(rows, columns)].reshape(-1, 3).astype(float)
    weights = np.ones(len(values))
    scale = 1.0
    for _ in range(_ROUNDS):
        weighted = basis * weights[:, None]
        coefficients = np.linalg.solve(basis.T @ weighted + 1e-9 * np.eye(basis.shape[1]), weighted.T @ values)
        residual = np.abs(values - basis @ coefficients).max(axis=1)
        scale = max(1.0, 1.4826 * float(np.median(residual)))
        weights = np.clip(1 - (residual / (_BISQUARE * scale)) ** 2, 0, None) ** 2
    vertical, horizontal = _axis(np.arange(height) / height), _axis(np.arange(width) / width)
    full = np.zeros((_DEGREE + 1, _DEGREE + 1, 3))
    full[_terms()] = coefficients
    return np.einsum("ia,jb,abc->ijc", vertical, horizontal, full, optimize=True), scale


def _axis(position: Float[np.ndarray, "point"]) -> Float[np.ndarray, "point term"]:
    return legendre.legvander(2 * position - 1, _DEGREE)


def _terms() -> tuple[np.ndarray, np.ndarray]:
    first, second = np.indices((_DEGREE + 1, _DEGREE + 1))
    rows, columns = np.nonzero(first + second <= _DEGREE)
    return rows, columns


def _basis(rows: Float[np.ndarray, "row"], columns: Float[np.ndarray, "column"]) -> Float[np.ndarray, "point term"]:
    vertical, horizontal = _terms()
    product = _axis(rows)[:, None, vertical] * _axis(columns)[None, :, horizontal]
    return product.reshape(-1, len(vertical))
