"""How likely a pixel's colour is under an object, the floor, or a shadow on the floor."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Integer, UInt8
from scipy.ndimage import gaussian_filter

from vrdp_prob.perception.background import Background

_LEVELS = 32
_BIN_WIDTH = 256 // _LEVELS
_BLUR = 0.8
"""Bins by which a histogram is blurred."""
_STRAY = 0.1
"""Share of an object's pixels that may have any colour: mirror images, highlights, mixed edges."""
LOG_ANY_COLOUR = float(-3 * np.log(256.0))
"""Log density (per cubic brightness step) of a colour about which nothing is known."""

_SHADOW_SHARE = 0.1
_DARKEST_SHADOW = 0.2
"""Share of its light that the floor keeps in the darkest shadow."""
_TINT = ((0.8, 3.0), (0.2, 8.0))
"""Shares and widths (brightness steps) of how far a shadow's colour leaves the floor's."""
_QUIET = 7
"""Brightness steps of departure below which a pixel is floor without further thought."""
_DARK = 0.8
"""Share of the floor's light below which a colourless pixel is a deep shadow or a gray object."""


class Appearance:
    """Colours of one object, as a blurred histogram learned while it is followed."""

    def __init__(self) -> None:
        self._counts = np.zeros((_LEVELS,) * 3)
        self._table: Float32[np.ndarray, "bin"] = np.full(_LEVELS**3, LOG_ANY_COLOUR, dtype=np.float32)

    def learn(self, bins: Integer[np.ndarray, "pixel"], *, memory: float = 1.0) -> None:
        """Add pixels (their histogram bins); what was learned before keeps a share `memory`."""
        seen = np.bincount(bins, minlength=_LEVELS**3).reshape(self._counts.shape)
        self._counts = memory * self._counts + seen
        blurred = gaussian_filter(self._counts, _BLUR, mode="nearest")
        density = (1 - _STRAY) * blurred / max(blurred.sum(), 1e-9) / _BIN_WIDTH**3 + _STRAY / 256.0**3
        self._table = np.log(density).astype(np.float32).ravel()

    def log_density(self, bins: Integer[np.ndarray, "*pixels"]) -> Float32[np.ndarray, "*pixels"]:
        """Log density of the colours in the given bins."""
        return self._table[bins]

    def likeness(self, other: "Appearance") -> float:
        """Overlap of two histograms (Bhattacharyya coefficient), 0 to 1."""
        first, second = (gaussian_filter(item._counts, _BLUR, mode="nearest") for item in (self, other))
        total = np.sqrt(max(first.sum(), 1e-9) * max(second.sum(), 1e-9))
        return float(np.sqrt(first * second).sum() / total)


@dataclass(frozen=True)
class Evidence:
    """What one frame says at each pixel before objects are thought of.

    Parameters
    ----------
    picture
        The frame, RGB.
    bins
        Histogram bin of each pixel's colour.
    floor
        Log density of the colour under the floor, lit or in shadow.
    strange
        Pixels that neither floor nor shadow explains.
    dark
        Colourless pixels much darker than the floor: a deep shadow or a gray object.
    """

    picture: UInt8[np.ndarray, "height width 3"]
    bins: Integer[np.ndarray, "height width"]
    floor: Float32[np.ndarray, "height width"]
    strange: Bool[np.ndarray, "height width"]
    dark: Bool[np.ndarray, "height width"]


def frame_evidence(picture: UInt8[np.ndarray, "height width 3"], background: Background) -> Evidence:
    """Weigh one frame against the empty floor."""
    noise = max(2.5, 1.2 * background.spread)
    small = (picture // _BIN_WIDTH).astype(np.uint16)
    bins = (small[..., 0] * _LEVELS + small[..., 1]) * _LEVELS + small[..., 2]
    channels = cv2.split(cv2.absdiff(picture, background.rounded))
    departure = cv2.max(cv2.max(channels[0], channels[1]), channels[2])
    lit = -1.5 * np.log(2 * np.pi) - 3 * np.log(noise)
    floor = np.full(picture.shape[:2], lit, dtype=np.float32)
    strange, dark = np.zeros(floor.shape, dtype=bool), np.zeros(floor.shape, dtype=bool)
    rows, columns = np.nonzero(departure > max(_QUIET, 2.5 * noise))
    if len(rows) > 0:
        colour = picture[rows, columns].astype(float)
        density, light, tint = _floor_density(colour, background.picture[rows, columns], noise)
        floor[rows, columns] = np.log(density)
        strange[rows, columns] = np.log(density) < LOG_ANY_COLOUR
        dark[rows, columns] = (light < _DARK) & (tint < 2 * _TINT[1][1])
    strange = cv2.morphologyEx(strange.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)).astype(bool)
    return Evidence(picture, bins, floor, strange, dark)


def _floor_density(
    colour: Float[np.ndarray, "pixel 3"], empty: Float[np.ndarray, "pixel 3"], noise: float
) -> tuple[Float[np.ndarray, "pixel"], Float[np.ndarray, "pixel"], Float[np.ndarray, "pixel"]]:
    """Density of colours under floor or shadow, share of the floor's light, and departure from the floor's tint."""
    strength = np.maximum((empty**2).sum(axis=1), 1.0)
    light = (colour * empty).sum(axis=1) / strength
    tint = np.linalg.norm(colour - light[:, None] * empty, axis=1)
    exact = np.exp(-((colour - empty) ** 2).sum(axis=1) / (2 * noise**2)) / ((2 * np.pi) ** 1.5 * noise**3)
    range_of_light = (1.02 - _DARKEST_SHADOW) * np.sqrt(strength)
    along = ((light < 1.02) & (light > _DARKEST_SHADOW)) / range_of_light
    across = sum(share * np.exp(-(tint**2) / (2 * width**2)) / (2 * np.pi * width**2) for share, width in _TINT)
    density = (1 - _SHADOW_SHARE) * exact + _SHADOW_SHARE * along * across + 1e-3 / 256.0**3
    return density, light, tint
