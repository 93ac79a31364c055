"""From what was seen of an object or a pair to the feature that concepts are compared with."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

APPEARANCE = 256
"""Length D of an appearance feature."""
_WINDOW_FEATURE = 64
_SLIDES_HIDDEN = 0.3
"""Share of the objects whose slides training hides, so that what shows in the picture is learned from the picture."""


class AppearanceEncoder(nn.Module):
    """One learned layer on the statistics of each crop and of the object's slides; then the mean over the crops.

    Parameters
    ----------
    statistics, slides
        Number of statistics of a crop, and of the slides.
    dropout
        Share of the statistics, and of the features, that training hides.
    """

    mean: Float[Tensor, "statistic"]

    def __init__(self, statistics: int, slides: int, *, dropout: float = 0.1) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(statistics))
        self.layer = nn.Linear(statistics + slides, APPEARANCE)
        self.dropout = nn.Dropout(dropout)

    def forward(
        self,
        statistics: Float[Tensor, "crop statistic"],
        there: Bool[Tensor, "object view"],
        slides: Float[Tensor, "object slide"],
    ) -> Float[Tensor, "object feature"]:
        """Appearance feature of each object; `statistics` are those of the crops that are there, object by object."""
        if self.training:
            slides = slides * (torch.rand(len(slides), 1, device=slides.device) >= _SLIDES_HIDDEN)
        owner = there.nonzero()[:, 0]
        seen = torch.cat([self.dropout(statistics - self.mean), slides[owner]], dim=1)
        features = self.dropout(torch.relu(self.layer(seen)))
        total = features.new_zeros((len(there), APPEARANCE)).index_add(0, owner, features)
        return total / there.sum(dim=1, keepdim=True).clamp_min(1)


class WindowEncoder(nn.Module):
    """One learned layer on window features of unit variance.

    Parameters
    ----------
    features
        Their number.
    """

    mean: Float[Tensor, "feature"]
    scale: Float[Tensor, "feature"]

    length = _WINDOW_FEATURE

    def __init__(self, features: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(features))
        self.register_buffer("scale", torch.ones(features))
        self.layer = nn.Linear(features, self.length)

    def forward(self, windows: Float[Tensor, "*rest feature"]) -> Float[Tensor, "*rest encoded"]:
        """Encode windows."""
        return torch.relu(self.layer((windows - self.mean) / self.scale))

    def measure(self, windows: Float[Tensor, "window feature"]) -> None:
        """Take the mean and the scale of the features from some windows."""
        self.mean.copy_(windows.mean(dim=0))
        self.scale.copy_(windows.std(dim=0) + 1e-3)
