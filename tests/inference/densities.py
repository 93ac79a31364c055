"""Densities of which the moments and weights are known; at module level, so that they can be sent to processes."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.stats import norm

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture

FAR = 20.0
"""Distance between two modes in standard deviations of the narrow one."""


def cloud(mean: np.ndarray, scale: float) -> CurvedGaussian:
    return CurvedGaussian.straight(Gaussian(mean, scale * np.eye(len(mean))))


@dataclass(frozen=True)
class TwoModes:
    """A narrow Gaussian at 0 with a weight, and one of three times its width far away; both are skewed a little."""

    weight: float = 0.3
    dimension: int = 4

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        away = torch.zeros(self.dimension, dtype=torch.float64)
        away[0] = FAR
        near, far = (self._component(points - place, scale) for place, scale in ((0 * away, 1.0), (away, 3.0)))
        shares = torch.tensor([self.weight, 1 - self.weight], dtype=torch.float64).log()
        return torch.logaddexp(shares[0] + near, shares[1] + far)

    def _component(self, offset: torch.Tensor, scale: float) -> torch.Tensor:
        """Normalised but for a constant that both share; the second coordinate is that of a log-gamma."""
        z = offset / scale
        rest = torch.cat([z[:, :1], z[:, 2:]], dim=1)
        return 4 * z[:, 1] - 4 * z[:, 1].exp() - (rest**2).sum(dim=1) / 2 - self.dimension * float(np.log(scale))

    @property
    def start(self) -> Mixture:
        """What a fit knows: places and curvatures, weights that are wrong."""
        away = np.zeros(self.dimension)
        away[0] = FAR
        return Mixture.of(cloud(0 * away, 0.8), cloud(away, 2.4), log_weights=np.log([0.6, 0.4]))


@dataclass(frozen=True)
class SmallNeighbour:
    """A round Gaussian, and a small one within reach of its chains; the mixture that it starts from is the density."""

    weight: float = 0.06
    distance: float = 5.0
    scale: float = 0.8

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        away = torch.tensor([self.distance, 0.0], dtype=torch.float64)
        large = -(points**2).sum(dim=1) / 2 + float(np.log1p(-self.weight))
        small = -(((points - away) / self.scale) ** 2).sum(dim=1) / 2 + float(np.log(self.weight / self.scale**2))
        return torch.logaddexp(large, small)

    @property
    def start(self) -> Mixture:
        away = np.array([self.distance, 0.0])
        log_weights = np.log([1 - self.weight, self.weight])
        return Mixture.of(cloud(0 * away, 1.0), cloud(away, self.scale), log_weights=log_weights)

    @property
    def share_beyond(self) -> float:
        """Share of the mass nearer to the small one, by the first coordinate."""
        middle = self.distance / 2
        return float((1 - self.weight) * norm.sf(middle) + self.weight * norm.sf(-middle / self.scale))


@dataclass(frozen=True)
class Needle:
    """A density that is flat and much narrower than the fit knows, so that walkers set out in one place and stay."""

    dimension: int = 8
    width: float = 1e-9

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        return -1e6 * ((points**2).sum(dim=1) / self.width**2 - 1).clamp(0.0, 1.0)

    @property
    def start(self) -> Mixture:
        return Mixture.of(cloud(np.zeros(self.dimension), 1.0))


@dataclass(frozen=True)
class Hopeless:
    """A density that no importance sampling from a Gaussian at its mode can follow: a funnel in many dimensions."""

    dimension: int = 8

    def __call__(self, points: torch.Tensor) -> torch.Tensor:
        neck, rest = points[:, 0], points[:, 1:]
        squares = (rest**2).sum(dim=1) * (-2 * neck).exp()
        return -(neck**2) / 2 - squares / 2 - (self.dimension - 1) * neck

    @property
    def start(self) -> Mixture:
        return Mixture.of(cloud(np.zeros(self.dimension), 0.3))
