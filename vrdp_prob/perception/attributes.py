"""Colour, material and shape of an object, each as probabilities gathered over the frames that show it best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from vrdp_prob.scene.body import Shape

_HUES: Mapping[str, float] = {
    "red": 0.0,
    "brown": 28.0,
    "yellow": 55.0,
    "green": 112.0,
    "cyan": 180.0,
    "blue": 228.0,
    "purple": 275.0,
}
"""Hue in degrees of CLEVRER's colours, whose names these are."""
_HUE_SPREAD = 8.0
"""Standard deviation in degrees of an object's main hue under a renderer's lights."""
_GRAY_SATURATION, _SATURATION_SPREAD = 0.2, 0.035

_SHAPE_SHARPNESS = 5.0
"""Log odds per unit of mean outline misfit between two shapes."""
_SHAPE_FRAMES = 2.0
"""Frames after which the evidence for a shape counts in full: frames of one video share their errors."""

_WASHED, _BRIGHT = 0.13, 1.62
"""Loss of saturation and gain of brightness of an object's brightest spots that tell metal from rubber on a sphere."""
_FLAT_WASHED, _FLAT_BRIGHT = 0.2, 1.75
"""The same for solids with faces, whose faces differ in brightness by themselves."""
_WASHED_SHARPNESS, _BRIGHT_SHARPNESS = 40.0, 6.0
_STRONGEST = 4.0
_FEWEST_ON_FACE = 20
"""Pixels of a face that its brightness is read from."""
_DARK_LID, _LID_SHARPNESS = 1.05, 40.0
"""Brightness of the top over the sides below which a solid mirrors: lit from above, a matt top is the brighter one."""
_NO_MIRROR = -0.2
"""Log odds of metal for a solid with flat faces that shows no highlight: a face need not reflect a lamp at all."""


@dataclass(frozen=True)
class Look:
    """What the pixels well inside one object's picture say in one frame.

    Parameters
    ----------
    hue
        Sum of unit hue vectors weighted by colourfulness.
    saturation
        Median saturation, 0 to 1.
    washed
        How much of the saturation the most washed-out spots lose, 0 to 1.
    bright
        Brightness of the brightest spots over the median's.
    lid
        Brightness of a flat top over that of the sides, NaN where not both are in sight.
    """

    hue: complex
    saturation: float
    washed: float
    bright: float
    lid: float = float("nan")


def look(pixels: UInt8[np.ndarray, "pixel 3"], on_lid: Bool[np.ndarray, "pixel"] | None = None) -> Look:
    """Summarise the RGB pixels of one object in one frame; `on_lid` tells those of its flat top."""
    values = pixels.astype(float)
    highest, lowest = values.max(axis=1), values.min(axis=1)
    colourful = highest - lowest
    saturation = colourful / np.maximum(highest, 1.0)
    hue = cv2.cvtColor(pixels[None].astype(np.float32) / 255, cv2.COLOR_RGB2HSV)[0, :, 0]
    middle = float(np.median(saturation))
    brightness = values.mean(axis=1)
    typical = max(float(np.median(brightness)), 1.0)
    lid = np.nan
    if on_lid is not None and min(on_lid.sum(), (~on_lid).sum()) >= _FEWEST_ON_FACE:
        lid = float(np.median(brightness[on_lid]) / max(np.median(brightness[~on_lid]), 1.0))
    return Look(
        hue=complex((colourful * np.exp(1j * np.radians(hue))).sum() / max(colourful.sum(), 1e-9)),
        saturation=middle,
        washed=1 - float(np.percentile(saturation, 2)) / max(middle, 1e-3),
        bright=float(np.percentile(brightness, 99.5)) / typical,
        lid=lid,
    )


def color_probabilities(looks: Sequence[Look]) -> dict[str, float]:
    """Probability of each of CLEVRER's colours."""
    saturation = float(np.median([item.saturation for item in looks]))
    hue = float(np.degrees(np.angle(sum(item.hue for item in looks))))
    gray = 1 / (1 + np.exp(np.clip((saturation - _GRAY_SATURATION) / _SATURATION_SPREAD, -30, 30)))
    distances = np.array([abs((hue - place + 180) % 360 - 180) for place in _HUES.values()])
    shares = _softmax(-((distances / _HUE_SPREAD) ** 2) / 2)
    result = {"gray": float(gray)}
    return result | {name: float((1 - gray) * share) for name, share in zip(_HUES, shares, strict=True)}


def material_probabilities(looks: Sequence[Look], shape: Shape) -> dict[str, float]:
    """Probability of metal and rubber from highlights and mirror images.

    A sphere always has a spot that mirrors a lamp towards the camera, so a missing highlight speaks for rubber; on flat
    faces it says next to nothing. A flat top that is darker than the sides mirrors what is above it.
    """
    lids = [item.lid for item in looks if np.isfinite(item.lid)]
    washed = float(np.median([item.washed for item in looks]))
    bright = float(np.median([item.bright for item in looks]))
    colourless = float(np.median([item.saturation for item in looks])) < _GRAY_SATURATION
    least_washed, least_bright = (_WASHED, _BRIGHT) if shape is Shape.SPHERE else (_FLAT_WASHED, _FLAT_BRIGHT)
    signs = [
        0.0 if colourless else _WASHED_SHARPNESS * (washed - least_washed),
        _BRIGHT_SHARPNESS * (bright - least_bright),
    ]
    if lids:
        signs.append(_LID_SHARPNESS * (_DARK_LID - float(np.median(lids))))
    parts = np.clip(signs, -_STRONGEST, _STRONGEST)
    odds = float(parts.sum() if shape is Shape.SPHERE else max(parts.max(), _NO_MIRROR))
    metal = float(1 / (1 + np.exp(-odds)))
    return {"metal": metal, "rubber": 1 - metal}


def shape_probabilities(scores: Mapping[Shape, float], frames: int) -> dict[Shape, float]:
    """Probability of each shape from the summed outline misfits (negative) of a number of frames."""
    names = list(scores)
    mean = np.array([scores[name] for name in names]) / max(frames, 1)
    full = min(1.0, frames / _SHAPE_FRAMES)
    return dict(zip(names, _softmax(_SHAPE_SHARPNESS * full * mean).tolist(), strict=True))


def _softmax(values: Float[np.ndarray, "value"]) -> Float[np.ndarray, "value"]:
    raised = np.exp(values - values.max())
    return raised / raised.sum()
