"""Crops as they would look under other lights: what a concept must not depend on."""

import torch
from jaxtyping import Float
from torch import Tensor

_GAIN, _GAMMA, _TINT, _SATURATION = 0.25, 0.15, 0.03, 0.15
"""Standard deviations of the logarithms of brightness, contrast, each channel and colourfulness."""
_MIRRORED = 0.5

Crops = Float[Tensor, "object view 4 row column"]


def relit(crops: Crops, generator: torch.Generator) -> Crops:
    """Crops (red, green, blue, mask; 0 to 1) of objects, each under a light of its own, and mirrored or not."""
    objects = len(crops)

    def factor(spread: float, channels: int = 1) -> Tensor:
        return torch.exp(spread * torch.randn(objects, 1, channels, 1, 1, generator=generator))

    picture = crops[:, :, :3].clamp_min(1e-3) ** factor(_GAMMA) * factor(_GAIN) * factor(_TINT, 3)
    gray = picture.mean(dim=2, keepdim=True)
    picture = (gray + (picture - gray) * factor(_SATURATION)).clamp(0, 1)
    lit = torch.cat([picture, crops[:, :, 3:]], dim=2)
    return lit.flip(-1) if torch.rand((), generator=generator).item() < _MIRRORED else lit
