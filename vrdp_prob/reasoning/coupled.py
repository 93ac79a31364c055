"""Twins of draws: the same in what is kept, anew in all else. What twins agree on hangs on what they share."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.chance import Chance, Purpose, Random

TWIN = 1 << 20
"""Added to the number of a batch for its twin, so that no batch has the same streams."""


@dataclass(frozen=True)
class Coupled:
    """Chance that follows another one in part.

    Parameters
    ----------
    base
        The chance that is followed.
    batch
        Number of the batch whose twin this is.
    kept
        How closely, for each purpose: 1 gives the same draws, 0 (where nothing is said) independent ones, and a
        correlation between them normal numbers that lie as near to those of `base`.
    """

    base: Chance
    batch: int
    kept: Mapping[Purpose, float]

    def numbers(self, purpose: Purpose) -> Random:
        """Random numbers, the same ones each time."""
        correlation = self.kept.get(purpose, 0.0)
        if correlation == 1:
            return self.base.numbers(purpose)
        fresh = self.base.another(self.batch + TWIN).numbers(purpose)
        return fresh if correlation == 0 else _Mixed(self.base.numbers(purpose), fresh, correlation)

    def another(self, batch: int) -> "Coupled":
        """The twin of another batch."""
        return Coupled(self.base.another(batch), batch, self.kept)


@dataclass(frozen=True)
class _Mixed:
    """Normal numbers with a given correlation to others."""

    base: Random
    fresh: Random
    correlation: float

    def standard_normal(self, size: tuple[int, ...], /) -> Float[np.ndarray, "..."]:
        rest = np.sqrt(1 - self.correlation**2)
        return self.correlation * self.base.standard_normal(size) + rest * self.fresh.standard_normal(size)

    def random(self, size: tuple[int, ...], /) -> Float[np.ndarray, "..."]:
        raise TypeError("only normal numbers can be near to others; keep this purpose or draw it anew")

    def choice(self, values: np.ndarray, /, size: int, *, p: np.ndarray) -> np.ndarray:
        raise TypeError("only normal numbers can be near to others; keep this purpose or draw it anew")
