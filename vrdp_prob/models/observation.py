"""How tracks are measured: which numbers were seen, how they are whitened, and the noise scales that are inferred."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vrdp_prob.scene import Shape, Tracks

NOISE_SHARE_OF_RADIUS = 0.05
"""Prior median of the position noise as a share of the bodies' radius, where nobody measured it."""
NOISE_WITHOUT_RADIUS = 0.01
"""Prior median of the position noise in m where no radius is known either."""
ANGLE_SD = 0.02
"""Prior median of the angle noise in rad."""
NOISE_LOG_SD = 2.0
"""Prior standard deviation of the log noise scale: two orders of magnitude either way."""
SMALLEST_SHARE = 1e-3
"""A covariance is not believed below this share (in standard deviation) of the median one."""


@dataclass(frozen=True)
class Observations:
    """What was seen of one video as flat lists, positions first.

    Parameters
    ----------
    frame, body
        Frame and body of each seen position.
    position
        The positions in m.
    whitening
        Matrix that turns a position difference into two independent numbers of unit variance at noise scale 1 (1/m).
    position_reference
        Standard deviation in m that noise scale 1 stands for (the median one where covariances are given).
    angle_frame, angle_body, angle
        Frame, body and value (rad) of each measured angle that says something (the yaw of a sphere does not).
    angle_reference
        Standard deviation in rad that angle noise scale 1 stands for.
    body_count
        Number of bodies of the video.
    """

    frame: Int[np.ndarray, "observation"]
    body: Int[np.ndarray, "observation"]
    position: Float[np.ndarray, "observation 2"]
    whitening: Float[np.ndarray, "observation 2 2"]
    position_reference: float
    angle_frame: Int[np.ndarray, "angle"]
    angle_body: Int[np.ndarray, "angle"]
    angle: Float[np.ndarray, "angle"]
    angle_reference: float
    body_count: int

    @classmethod
    def of(cls, tracks: Tracks, left_out: Bool[np.ndarray, "time body"] | None = None) -> "Observations":
        """What the tracks hold but for what is left out, positions whitened by their covariances where given."""
        used = np.ones_like(tracks.seen) if left_out is None else ~left_out
        frame, body = np.nonzero(tracks.seen & used)
        position = tracks.positions[frame, body]
        whitening, reference = _whitening(tracks, frame, body)
        angle_seen = _angles_that_tell(tracks) & used
        angle_frame, angle_body = np.nonzero(angle_seen)
        angles = tracks.angles
        angle = np.zeros(0) if angles is None else angles[angle_frame, angle_body]
        count = len(tracks.bodies)
        return cls(frame, body, position, whitening, reference, angle_frame, angle_body, angle, ANGLE_SD, count)

    @property
    def angle_bodies(self) -> tuple[int, ...]:
        """Bodies with a measured angle."""
        return tuple(int(index) for index in np.unique(self.angle_body))

    def until(self, frame_count: int) -> "Observations":
        """Only what was seen in the first frames."""
        positions, angles = self.frame < frame_count, self.angle_frame < frame_count
        return Observations(
            self.frame[positions],
            self.body[positions],
            self.position[positions],
            self.whitening[positions],
            self.position_reference,
            self.angle_frame[angles],
            self.angle_body[angles],
            self.angle[angles],
            self.angle_reference,
            self.body_count,
        )

    def whitened(self, difference: Float[Tensor, "point observation 2"]) -> Float[Tensor, "point observation 2"]:
        """Differences of positions (m) as independent numbers of unit variance at noise scale 1."""
        along, across = self._whitening_diagonals
        result = difference * along
        return result if across is None else result + difference.flip(-1) * across

    @cached_property
    def _whitening_diagonals(self) -> tuple[Float[Tensor, "observation 2"], Float[Tensor, "observation 2"] | None]:
        """The whitening's diagonal, and what multiplies the other coordinate; None where nothing does.

        Two products are many times faster than so many products of small matrices.
        """
        matrices = torch.from_numpy(self.whitening)
        across = torch.stack([matrices[:, 0, 1], matrices[:, 1, 0]], dim=1)
        return matrices.diagonal(dim1=1, dim2=2).contiguous(), across if across.any() else None

    @cached_property
    def position_places(self) -> Int[Tensor, "coordinate"]:
        """Places of the seen coordinates (x and y in turn) in a flattened trajectory [time, body, (x, y, angle)]."""
        first = 3 * (self.frame * self.body_count + self.body)
        return torch.from_numpy(np.stack([first, first + 1], axis=1).ravel())

    @cached_property
    def angle_places(self) -> Int[Tensor, "angle"]:
        """Places of the measured angles in a flattened trajectory."""
        return torch.from_numpy(3 * (self.angle_frame * self.body_count + self.angle_body) + 2)

    @cached_property
    def position_frames(self) -> Int[Tensor, "coordinate"]:
        """Frames of the seen coordinates (x and y in turn)."""
        return torch.from_numpy(np.repeat(self.frame, 2))

    @cached_property
    def angle_frames(self) -> Int[Tensor, "angle"]:
        """Frames of the measured angles."""
        return torch.from_numpy(self.angle_frame)


def prior_noise(tracks: Tracks) -> float:
    """Prior median of the position noise in m, from the size of the bodies."""
    radii = [body.radius for body in tracks.bodies if body.radius is not None]
    return NOISE_SHARE_OF_RADIUS * float(np.median(radii)) if radii else NOISE_WITHOUT_RADIUS


def stated_reference(tracks: Tracks) -> float | None:
    """Standard deviation (m) of the position in the middle as it is stated; None where none is."""
    variance = tracks.position_variance
    return None if variance is None else float(np.sqrt(np.nanmedian(variance[tracks.seen])))


def _whitening(
    tracks: Tracks, frame: Int[np.ndarray, "observation"], body: Int[np.ndarray, "observation"]
) -> tuple[Float[np.ndarray, "observation 2 2"], float]:
    covariance, variance = tracks.position_covariance, tracks.position_variance
    reference = stated_reference(tracks) or prior_noise(tracks)
    whitening = np.tile(np.eye(2) / reference, (len(frame), 1, 1))
    if covariance is None or variance is None:
        return whitening, reference
    stated = np.isfinite(variance[frame, body])
    values, vectors = np.linalg.eigh(covariance[frame, body][stated])
    scale = 1 / np.sqrt(np.maximum(values, (SMALLEST_SHARE * reference) ** 2))
    whitening[stated] = scale[..., :, None] * np.swapaxes(vectors, -1, -2)
    return whitening, reference


def _angles_that_tell(tracks: Tracks) -> Bool[np.ndarray, "time body"]:
    angles = tracks.angles
    if angles is None:
        return np.zeros(tracks.seen.shape, dtype=bool)
    tells = np.array([body.shape is not Shape.SPHERE for body in tracks.bodies])
    return np.isfinite(angles) & tells & tracks.seen
