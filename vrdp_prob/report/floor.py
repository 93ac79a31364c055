"""The empty floor of a still: the objects painted over, so that rollouts can be drawn where nothing stands."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from vrdp_prob.scene import Camera, Tracks
from vrdp_prob.scene.camera import REST_HEIGHT

_ROOM = 1.35
"""How much wider than the object the painted patch is."""

_SHADOW = 0.8
"""How far around an object, in radii, its shadow is painted over as well."""

_SAMPLES = 24


def clear_floor(
    image: UInt8[np.ndarray, "height width 3"], tracks: Tracks, time: float
) -> UInt8[np.ndarray, "height width 3"]:
    """The still with the objects measured at its time painted over from their surroundings.

    Parameters
    ----------
    image
        The still; channels red, green, blue.
    tracks
        Measured positions; without a camera the still is returned as it is.
    time
        Time in s of the still.
    """
    if tracks.camera is None:
        return image
    frame = int(np.abs(tracks.times - time).argmin())
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    for body, position in zip(tracks.bodies, tracks.positions[frame], strict=True):
        if np.isfinite(position).all():
            outline = _outline(tracks.camera, position, body.radius or REST_HEIGHT)
            cv2.fillConvexPoly(mask, cv2.convexHull(outline), 255)
    smooth = cv2.inpaint(np.ascontiguousarray(image), mask, 5, cv2.INPAINT_TELEA)
    blurred = cv2.GaussianBlur(smooth, (0, 0), 9)
    weight = cv2.GaussianBlur(mask, (0, 0), 2)[..., None] / 255.0
    cleared: UInt8[np.ndarray, "height width 3"] = np.rint(weight * blurred + (1 - weight) * smooth).astype(np.uint8)
    return cleared


def _outline(camera: Camera, position: Float[np.ndarray, "2"], radius: float) -> np.ndarray:
    """Pixels around an object and the shadow at its foot; int32 with axes `point 1 axis`."""
    turn = np.linspace(0, 2 * np.pi, _SAMPLES, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    rings = [
        np.column_stack([position + (_ROOM * np.sqrt(2) + extra) * radius * circle, np.full(_SAMPLES, height)])
        for height, extra in ((0.0, _SHADOW), (2.2 * radius, 0.0))
    ]
    pixels = camera.project(np.concatenate(rings))
    return np.rint(pixels).astype(np.int32)[:, None, :]
