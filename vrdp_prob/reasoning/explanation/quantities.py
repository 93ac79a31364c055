"""What an answer may hang on: quantities and events that differ from draw to draw, with words for them."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.reasoning.explanation.information import alike_weights, smooth_weights

RARE = 0.01
"""What is otherwise in at most this share of the draws is certain."""


class Kind(StrEnum):
    """What sort of thing an answer hangs on."""

    PARAMETER = "parameter"
    MOTION = "motion"
    EVENT = "event"
    ATTRIBUTE = "attribute"
    MEANING = "meaning"


@dataclass(frozen=True)
class Measurement:
    """How a quantity could be observed.

    Parameters
    ----------
    words
        As a gerund: `weighing the blue cube to 5 %`.
    sd
        Standard deviation of the observation, in the quantity's unit, or relative where the quantity is.
    """

    words: str
    sd: float = 0.0


@dataclass(frozen=True)
class Quantity:
    """Something that differs from draw to draw.

    Parameters
    ----------
    kind
        What sort of thing it is.
    name
        What it is called: `mass of the blue cube`, or `whether the blue cube hits the red sphere`.
    values
        Its value in each draw; the place in `labels` where there are any.
    unit
        Unit of the values, empty where they have none.
    relative
        Whether its errors are relative: it is then compared by its logarithm.
    labels
        Its values in words, for one with few values, as a condition: `it does`, `it does not`.
    measurement
        How it could be observed; None where it cannot.
    """

    kind: Kind
    name: str
    values: Float[np.ndarray, "draw"]
    unit: str = ""
    relative: bool = False
    labels: tuple[str, ...] = ()
    measurement: Measurement | None = None

    @property
    def varies(self) -> bool:
        """Whether draws differ in it by more than rounding."""
        if self.labels:
            share = np.bincount(self.values.astype(int)) / len(self.values)
            return bool(share.max() < 1 - RARE)
        return float(np.ptp(self.values)) > 1e-9 * max(float(np.abs(self.values).max()), 1e-9)

    def of_draws(self, chosen: Int[np.ndarray, "chosen"]) -> "Quantity":
        """The quantity in some of the draws."""
        return replace(self, values=self.values[chosen])

    def neighbours(self, generator: np.random.Generator | None = None) -> Float[np.ndarray, "width draw draw"]:
        """Weights by which draws resemble each other in it (see `information`); as measured, with a generator.

        A measurement shows every draw's value with an error drawn by the generator; which of a few labels holds is seen
        without error.
        """
        if self.labels:
            return alike_weights(self.values.astype(int))
        values = np.log(self.values) if self.relative else self.values
        if generator is not None and self.measurement is not None:
            values = values + self.measurement.sd * generator.standard_normal(len(values))
        return smooth_weights(values[:, None])
