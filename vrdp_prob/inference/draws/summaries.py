"""Short summaries of draws: mean, standard deviation, and the middle 90 %."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Summary:
    """A quantity in four numbers, in its own unit: mean, standard deviation, 5 % and 95 % quantiles."""

    mean: float
    sd: float
    q05: float
    q95: float

    @classmethod
    def of(cls, draws: Float[np.ndarray, "..."]) -> "Summary":
        """Summary of the draws along all axes."""
        low, high = np.quantile(draws, [0.05, 0.95])
        return cls(float(np.mean(draws)), float(np.std(draws)), float(low), float(high))

    def to_document(self) -> dict[str, float]:
        """The numbers by name, as a report holds them."""
        return {"mean": self.mean, "sd": self.sd, "q05": self.q05, "q95": self.q95}


@dataclass(frozen=True)
class ParameterSummary:
    """A parameter of a body: its numbers, and what the data say about it.

    `status` is one of `identified`, `ratio_only`, `product_only` and `default`, `partners` the bodies that a ratio or
    product refers to, `contraction` the share of the prior variance that the data take away.
    """

    summary: Summary
    status: str
    partners: tuple[str, ...] = ()
    contraction: float = 0.0

    def to_document(self) -> dict[str, object]:
        """The numbers and the status by name, as a report holds them."""
        document: dict[str, object] = {
            **self.summary.to_document(),
            "status": self.status,
            "contraction": self.contraction,
        }
        if self.partners:
            document["with"] = list(self.partners)
        return document


@dataclass(frozen=True)
class ObjectSummary:
    """Mass (kg) and restitution factor of one body."""

    body: str
    mass: ParameterSummary
    restitution: ParameterSummary


@dataclass(frozen=True)
class PairSummary:
    """A quantity of two bodies that collided: the mass of the first over that of the second, or their restitution.

    `determined` is False where the data say nothing of one of them, or nothing of both together.
    """

    objects: tuple[str, str]
    summary: Summary
    determined: bool = True

    def to_document(self) -> dict[str, object]:
        """The two ids, the numbers, and whether the data tell them, as a report holds them."""
        return {"objects": list(self.objects), **self.summary.to_document(), "determined": self.determined}
