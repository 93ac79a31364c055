"""A fixed pinhole camera: where a point of the world appears in the picture, and back through a plane."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically

REST_HEIGHT = 0.2
"""Height in m of the centre of a resting CLEVRER object."""

_CLEVRER_PROJECTION = (
    (-207.8461456, 525.0000610, -120.0000153, 1200.0003662),
    (123.9359589, 0.0, -534.6633301, 799.9999390),
    (-0.8660254, 0.0, -0.5, 5.0000005),
)


@dataclass(frozen=True)
class Camera:
    """Projection of the world into the picture, `[u w, v w, w] = P (x, y, z, 1)`.

    Parameters
    ----------
    projection
        The 3x4 matrix P (world in m, picture in pixels, u to the right, v down).
    width, height
        Size of the picture in pixels.
    frame_rate
        Frames per second, None where the video file says it.
    pixel_sd
        Reprojection error of the calibration: standard deviation per pixel coordinate.

    Raises
    ------
    InputError
        If the matrix has another shape, is not finite, or is singular, the picture has no size, or another number is
        none that it can be.
    """

    projection: Float[np.ndarray, "3 4"]
    width: int
    height: int
    frame_rate: float | None = None
    pixel_sd: float = 0.0

    def __post_init__(self) -> None:
        matrix = np.asarray(self.projection, dtype=float)
        object.__setattr__(self, "projection", matrix)
        if not np.isfinite(matrix).all():
            raise InputError("camera: 'projection' holds a number that is not finite; give a 3x4 matrix of numbers.")
        rows = matrix / np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
        if np.linalg.svd(rows[:, :3], compute_uv=False)[-1] < 1e-9:
            raise InputError(
                "camera: 'projection' is a singular matrix; calibrate the camera anew (vrdp-prob calibrate-camera)."
            )
        if self.width <= 0 or self.height <= 0:
            raise InputError("camera: 'width' and 'height' must be positive numbers of pixels.")
        if self.frame_rate is not None and not 0 < self.frame_rate < np.inf:
            raise InputError(f"camera: 'fps' is {self.frame_rate:g}; give frames per second, or leave it out.")
        if not 0 <= self.pixel_sd < np.inf:
            raise InputError(
                f"camera: 'pixel_sd' is {self.pixel_sd:g}; give a number of pixels from 0, or leave it out."
            )

    @classmethod
    def clevrer(cls) -> "Camera":
        """The camera of the CLEVRER data set (480x320 pixels, 25 frames per second)."""
        return cls(np.array(_CLEVRER_PROJECTION), width=480, height=320, frame_rate=25.0)

    @classmethod
    def read(cls, path: Path | str) -> "Camera":
        """Read a camera file (JSON with `projection`, `width`, `height`, optionally `fps` and `pixel_sd`).

        Raises
        ------
        InputError
            If the file cannot be read, is not such a document, or its matrix is unusable.
        """
        try:
            document = json.loads(Path(path).read_text(encoding="utf-8"))
            projection = np.array(document["projection"], dtype=float)
            width, height = int(document["width"]), int(document["height"])
            frame_rate = float(document["fps"]) if document.get("fps") else None
            pixel_sd = float(document.get("pixel_sd", 0.0))
        except OSError as error:
            raise InputError(f"{path}: the camera file cannot be read ({error.strerror}); check the path.") from error
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            raise InputError(
                f"{path}: not a camera file ({error}); it needs 'projection' (3 rows of 4), 'width' and 'height'."
            ) from error
        if projection.shape != (3, 4):
            raise InputError(f"{path}: 'projection' is {projection.shape}, not 3 rows of 4 numbers.")
        try:
            return cls(projection, width, height, frame_rate, pixel_sd)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    def to_document(self) -> dict[str, object]:
        """Content of a camera file."""
        return {
            "width": self.width,
            "height": self.height,
            "fps": self.frame_rate,
            "pixel_sd": self.pixel_sd,
            "projection": self.projection.tolist(),
        }

    def write(self, path: Path | str) -> None:
        """Write a camera file that `Camera.read` reads.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with write_atomically(path) as temporary:
            temporary.write_text(json.dumps(self.to_document(), indent=1) + "\n", encoding="utf-8")

    def project(self, points: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 2"]:
        """Pixel coordinates (u, v) of points of the world (x, y, z) in m."""
        homogeneous = points @ self.projection[:, :3].T + self.projection[:, 3]
        pixels: Float[np.ndarray, "*points 2"] = homogeneous[..., :2] / homogeneous[..., 2:]
        return pixels

    def to_plane(self, pixels: Float[np.ndarray, "*points 2"], height: float) -> Float[np.ndarray, "*points 2"]:
        """Plane coordinates (x, y) in m of the points at a given height (m) that appear at the given pixels."""
        matrix = self.projection
        rows = matrix[:2] - pixels[..., :, None] * matrix[2]
        right = -(rows[..., 2] * height + rows[..., 3])
        plane: Float[np.ndarray, "*points 2"] = np.linalg.solve(rows[..., :2], right[..., None])[..., 0]
        return plane

    def plane_jacobian(
        self, positions: Float[np.ndarray, "*points 2"], height: float
    ) -> Float[np.ndarray, "*points 2 2"]:
        """Derivative of the plane position (x, y) with respect to the pixel (u, v), in m per pixel."""
        points = np.concatenate([positions, np.full((*positions.shape[:-1], 1), height)], axis=-1)
        homogeneous = points @ self.projection[:, :3].T + self.projection[:, 3]
        pixels = homogeneous[..., :2] / homogeneous[..., 2:]
        forward = (self.projection[:2, :2] - pixels[..., :, None] * self.projection[2, :2]) / homogeneous[..., 2:, None]
        jacobian: Float[np.ndarray, "*points 2 2"] = np.linalg.inv(forward)
        return jacobian

    def in_view(
        self, positions: Float[np.ndarray, "*points 2"], height: float = REST_HEIGHT
    ) -> Bool[np.ndarray, "*points"]:
        """Whether the points (x, y) at a height (m) appear inside the picture; boolean array with axes `*points`."""
        points = np.concatenate([positions, np.full((*positions.shape[:-1], 1), height)], axis=-1)
        homogeneous = points @ self.projection[:, :3].T + self.projection[:, 3]
        depth = homogeneous[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = homogeneous[..., 0] / depth, homogeneous[..., 1] / depth
        return np.asarray((depth > 0) & (u >= 0) & (u <= self.width) & (v >= 0) & (v <= self.height))
