"""What a crop says of colour, outline and shine, in fixed numbers: a first layer with nothing to learn.

From 200 objects and a few hundred answers no network learns to see from pixels alone. These statistics are general:
they know of hue, brightness and outline, but of no word.
"""

import math
from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

_HUES = 24
_QUANTILES = (0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98, 0.995)
_GRID = 8
_INSIDE = 0.5
_SMALLEST = 1e-3

STATISTICS = _HUES + 2 * len(_QUANTILES) + 1 + 2 * _GRID**2
"""Number of statistics."""

Picture = Float[Tensor, "crop 3 row column"]
Mask = Float[Tensor, "crop row column"]
Statistics = Float[Tensor, "crop statistic"]


def crop_statistics(crops: Float[Tensor, "crop 4 row column"]) -> Float[Tensor, "crop statistic"]:
    """Statistics of crops, each group of them scaled so that no group outweighs the others.

    Parameters
    ----------
    crops
        Red, green, blue, and the probability that a pixel shows the object; all 0 to 1.
    """
    picture, mask = crops[:, :3], crops[:, 3]
    inner = _eroded(mask)
    groups = [part(picture, mask, inner) for part in _PARTS]
    return torch.cat([group / math.sqrt(group.shape[1]) for group in groups], dim=1)


def _hues(picture: Picture, mask: Mask, inner: Mask) -> Statistics:
    """Histogram of hues, each pixel by its colourfulness, shared between two bins; gray objects hardly have one."""
    del mask
    red, green, blue = picture.unbind(dim=1)
    hue = torch.atan2(math.sqrt(3) * (green - blue), 2 * red - green - blue)
    place = (hue % (2 * math.pi)).flatten(start_dim=1) * (_HUES / (2 * math.pi))
    colourful = (inner * _saturation(picture)).flatten(start_dim=1)
    lower, above = place.floor().long() % _HUES, place % 1
    histogram = colourful.new_zeros((len(picture), _HUES))
    histogram = histogram.scatter_add(1, lower, colourful * (1 - above))
    histogram = histogram.scatter_add(1, (lower + 1) % _HUES, colourful * above)
    return 10 * histogram / inner.sum(dim=(1, 2))[:, None].clamp_min(1)


def _saturations(picture: Picture, mask: Mask, inner: Mask) -> Statistics:
    del mask
    return 5 * _quantiles(_saturation(picture), inner)


def _shine(picture: Picture, mask: Mask, inner: Mask) -> Statistics:
    """Brightness against its median, and how much saturation the brightest pixels lose."""
    del mask
    brightness = _relative_brightness(picture, inner)
    quantiles = _quantiles(brightness, inner)
    top = inner * (brightness >= quantiles[:, -2, None, None])
    mean, bright = (_mean(_saturation(picture), weight) for weight in (inner, top))
    return torch.cat([2 * torch.log(quantiles.clamp_min(0.1)), 5 * (mean - bright)[:, None]], dim=1)


def _outline(picture: Picture, mask: Mask, inner: Mask) -> Statistics:
    del picture, inner
    return 2 * _coarse(mask)


def _shading(picture: Picture, mask: Mask, inner: Mask) -> Statistics:
    """Where in its picture an object is brighter and darker than its median."""
    del mask
    brightness = torch.log(_relative_brightness(picture, inner).clamp(0.2, 5))
    return 4 * _coarse(inner * brightness)


_PARTS: tuple[Callable[[Picture, Mask, Mask], Statistics], ...] = (_hues, _saturations, _shine, _outline, _shading)


def _saturation(picture: Picture) -> Mask:
    highest, lowest = picture.amax(dim=1), picture.amin(dim=1)
    return (highest - lowest) / highest.clamp_min(0.02)


def _relative_brightness(picture: Picture, inner: Mask) -> Mask:
    brightness = picture.mean(dim=1)
    middle = _quantiles(brightness, inner)[:, _QUANTILES.index(0.5)]
    return brightness / middle.clamp_min(0.02)[:, None, None]


def _eroded(mask: Mask) -> Mask:
    """Pixels inside the object whose neighbours are inside too: those on the edge mix its colour with others."""
    inside = (mask > _INSIDE).to(mask.dtype)
    return -functional.max_pool2d(-inside[:, None], 3, stride=1, padding=1)[:, 0]


def _coarse(values: Mask) -> Statistics:
    return functional.adaptive_avg_pool2d(values[:, None], _GRID).flatten(start_dim=1)


def _mean(values: Mask, weight: Mask) -> Float[Tensor, "crop"]:
    return (values * weight).sum(dim=(1, 2)) / weight.sum(dim=(1, 2)).clamp_min(_SMALLEST)


def _quantiles(values: Mask, inside: Mask) -> Statistics:
    """Quantiles over the pixels inside."""
    flat, known = values.flatten(start_dim=1), inside.flatten(start_dim=1) > _INSIDE
    ranked = torch.where(known, flat, torch.full_like(flat, torch.inf)).sort(dim=1).values
    count = known.sum(dim=1, keepdim=True)
    shares = torch.tensor(_QUANTILES, dtype=flat.dtype, device=flat.device)
    places = (shares * (count - 1).clamp_min(0)).round().long()
    return torch.where(count > 0, ranked.gather(1, places), torch.zeros_like(shares))
