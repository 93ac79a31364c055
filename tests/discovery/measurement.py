"""What is measured of a video: noise, missing frames, gross outliers, and what is stated of bodies and walls."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from tests.discovery.videos import Video, recorded
from vrdp_prob.scene import Body, Camera, Tracks

FIRST = 3
"""Number of frames at which each body is seen first and that are neither missing nor outliers."""
GAP = 5
"""Frames that are missing together."""


@dataclass(frozen=True)
class Measurement:
    """How videos are measured.

    Parameters
    ----------
    noise
        Standard deviation of a coordinate in m.
    dropout
        Share of observations that are missing, half of them in gaps of some frames.
    outliers
        Share of observations that are grossly wrong.
    outlier_size
        Standard deviation in m of a coordinate that is grossly wrong.
    masses
        Whether the masses of the bodies are stated.
    angles
        Whether angles are measured, each body's from a zero of its own.
    angle_noise
        Standard deviation of an angle in rad.
    wall_restitution
        Whether the restitution of stated walls is.
    camera
        Whether a camera above the table is stated.
    """

    noise: float = 0.002
    dropout: float = 0.0
    outliers: float = 0.0
    outlier_size: float = 0.3
    masses: bool = False
    angles: bool = False
    angle_noise: float = 0.01
    wall_restitution: bool = True
    camera: bool = False


def measure(
    video: Video, name: str, measurement: Measurement, generator: np.random.Generator
) -> tuple[Tracks, Bool[np.ndarray, "time body"]]:
    """Tracks of a video, and which observations are outliers."""
    states = video.motion.states
    seen = _seen(video, measurement.dropout, generator) & video.in_view
    wrong = seen & _settled(video) & (generator.random(seen.shape) < measurement.outliers)
    places = recorded(video, states[..., :2]) + measurement.noise * generator.standard_normal((*seen.shape, 2))
    places = places + np.where(
        wrong[..., None], measurement.outlier_size * generator.standard_normal(places.shape), 0.0
    )
    places[~seen] = np.nan
    tracks = Tracks.from_arrays(
        name,
        _bodies(video, masses=measurement.masses),
        video.stamps,
        places,
        angles=_angles(video, seen, measurement, generator) if measurement.angles else None,
        walls=tuple(wall if measurement.wall_restitution else replace(wall, restitution=None) for wall in video.walls),
        camera=overhead_camera(video) if measurement.camera else None,
    )
    return tracks, wrong


def overhead_camera(video: Video) -> Camera:
    """A camera 10 m above the middle of the picture, which shows what is in view."""
    height, side = 10.0, 800
    focus = side / 2 * height / video.view
    x, y = video.centre
    projection = np.array(
        [
            [focus, 0.0, -side / 2, side / 2 * height - focus * x],
            [0.0, -focus, -side / 2, side / 2 * height + focus * y],
            [0.0, 0.0, -1.0, height],
        ]
    )
    return Camera(projection, side, side, video.frame_rate)


def _bodies(video: Video, *, masses: bool) -> tuple[Body, ...]:
    stated = [float(mass) if masses else None for mass in video.mass]
    return tuple(
        Body(chr(ord("a") + k), shape, float(video.radius[k]), mass=stated[k], material=video.materials[k])
        for k, shape in enumerate(video.shapes)
    )


def _there(video: Video) -> Bool[np.ndarray, "time body"]:
    """Whether a body has been released."""
    return np.asarray(video.times[:, None] >= video.release - 1e-9)


def _settled(video: Video) -> Bool[np.ndarray, "time body"]:
    """Whether a body has been there for some frames."""
    there = _there(video)
    return np.asarray(there & (np.cumsum(there, axis=0) > FIRST))


def _seen(video: Video, dropout: float, generator: np.random.Generator) -> Bool[np.ndarray, "time body"]:
    there = _there(video)
    single = generator.random(there.shape) < dropout / 2
    gap = generator.random(there.shape) < dropout / 2 / GAP
    for _ in range(GAP - 1):
        gap[1:] |= gap[:-1]
    return np.asarray(there & ~((single | gap) & _settled(video)))


def _angles(
    video: Video, seen: Bool[np.ndarray, "time body"], measurement: Measurement, generator: np.random.Generator
) -> Float[np.ndarray, "time body"]:
    """Measured angles, each from a zero of its own."""
    zero = generator.uniform(-np.pi, np.pi, len(video.shapes))
    angles = video.motion.states[..., 4] - zero + measurement.angle_noise * generator.standard_normal(seen.shape)
    return np.asarray(np.where(seen, angles, np.nan))
