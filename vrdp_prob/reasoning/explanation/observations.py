"""What observation would settle an answer: the expected fall of its entropy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.reasoning.explanation.information import answer_entropy, information, smooth_weights
from vrdp_prob.reasoning.explanation.quantities import Quantity

MOST = 3
"""Observations that are told."""

SURE_ERRORS = 2.0
"""An observation is told where its gain is so many standard errors above zero."""

SMALLEST_GAIN = 0.03
"""An observation that is worth less (nats) is not told."""

MOST_FEATURES = 3
"""Numbers of a film that are used together, the most telling ones: with more, the draws are too few."""


@dataclass(frozen=True)
class Observation:
    """An observation that could be made, and what it would be worth.

    Parameters
    ----------
    words
        What is done: `weighing the blue cube to 5 %`.
    entropy
        Expected entropy of the answer afterwards, in nats.
    error
        Monte Carlo standard error of that.
    before
        Entropy of the answer now, in nats.
    """

    words: str
    entropy: float
    error: float
    before: float

    @property
    def sentence(self) -> str:
        """As a sentence."""
        start = f"{self.words[:1].upper()}{self.words[1:]}"
        return f"{start} would lower the answer's entropy from {self.before:.2f} to {self.entropy:.2f} nats (expected)."


@dataclass(frozen=True)
class Film:
    """Something that would be seen in many numbers at once.

    Parameters
    ----------
    words
        As in `Observation`.
    features
        What would be seen in each draw, with noise.
    """

    words: str
    features: Float[np.ndarray, "draw feature"]


def observations(
    quantities: Sequence[Quantity],
    films: Sequence[Film],
    codes: Int[np.ndarray, "draw"],
    generator: np.random.Generator,
) -> tuple[Observation, ...]:
    """The observations that would lower an answer's entropy most.

    Every draw is taken for the truth in turn: the observation is made in it, with its error, and the other draws are
    weighted by how well they fit (see `information`).

    Parameters
    ----------
    quantities
        What could be measured; those without a measurement are passed over.
    films
        What else could be seen.
    codes
        The answer of each draw.
    generator
        Source of the errors of measurement.
    """
    before = answer_entropy(codes)
    found = []
    for quantity in quantities:
        if quantity.measurement is None:
            continue
        found.append((quantity.measurement.words, information(quantity.neighbours(generator), codes)))
    found += [(film.words, information(_best_weights(film.features, codes), codes)) for film in films]
    sure = [(words, told) for words, told in found if told.nats > max(SURE_ERRORS * told.error, SMALLEST_GAIN)]
    sure.sort(key=lambda item: -item[1].nats)
    return tuple(Observation(words, max(before - told.nats, 0.0), told.error, before) for words, told in sure[:MOST])


def _best_weights(
    features: Float[np.ndarray, "draw feature"], codes: Int[np.ndarray, "draw"]
) -> Float[np.ndarray, "width draw draw"]:
    """Weights by the features that tell most together, found one after the other."""
    chosen: list[int] = []
    best, weights = -1.0, smooth_weights(features[:, :1])
    while len(chosen) < min(MOST_FEATURES, features.shape[1]):
        left = [place for place in range(features.shape[1]) if place not in chosen]
        tried = [smooth_weights(features[:, [*chosen, place]]) for place in left]
        told = [information(one, codes).nats for one in tried]
        if max(told) <= best:
            break
        number = int(np.argmax(told))
        best, weights = told[number], tried[number]
        chosen.append(left[number])
    return weights
