"""Which quantity or event an answer hangs on most."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.explanation.information import (
    Information,
    answer_entropy,
    chance_information,
    information,
)
from vrdp_prob.reasoning.explanation.quantities import Kind, Quantity

SHUFFLES = 40
"""Permutations of the draws that tell what chance alone would find."""

SURELY = 0.95
"""Share of the permutations whose best quantity must tell less."""

SAME = 0.9
"""A simulated event that tells this share of the answer's entropy is the answer itself in other words."""

MOST = 3
"""Hinges that are told."""

SMALLEST_SIDE = 0.05
"""Least share of the draws on each side of a split."""


@dataclass(frozen=True)
class Hinge:
    """A quantity that an answer hangs on, with the split of the draws by it that tells most.

    Parameters
    ----------
    kind, name, unit
        See `Quantity`.
    information
        What the quantity tells about the answer, in nats.
    error
        Monte Carlo standard error of that.
    condition
        The split in words: `above 1.3 kg`, `it does`.
    threshold
        Where the split is; None for an event.
    inside, outside
        Probability of the answer where the condition holds, and where it does not.
    """

    kind: Kind
    name: str
    unit: str
    information: float
    error: float
    condition: str
    threshold: float | None
    inside: float
    outside: float

    @property
    def sentence(self) -> str:
        """As a clause: `the mass of the blue cube: 0.90 if above 1.3 kg, else 0.20`."""
        name = self.name if self.name.startswith("whether") else f"the {self.name}"
        return f"{name}: {self.inside:.2f} if {self.condition}, else {self.outside:.2f}"


def hinges(
    quantities: Sequence[Quantity],
    codes: Int[np.ndarray, "draw"],
    wanted: int,
    generator: np.random.Generator,
) -> tuple[Hinge, ...]:
    """The quantities that tell most about an answer, more than chance would find among so many.

    Parameters
    ----------
    quantities
        What may be told of.
    codes
        The answer of each draw.
    wanted
        The answer whose probability is told on each side of a split.
    generator
        Source of the permutations.
    """
    whole = answer_entropy(codes)
    orders = [generator.permutation(len(codes)) for _ in range(SHUFFLES)]
    best_by_chance = np.zeros(SHUFFLES)
    found = []
    for quantity in quantities:
        weights = quantity.neighbours()
        told, by_chance = information(weights, codes), chance_information(weights, codes, orders)
        best_by_chance = np.maximum(best_by_chance, by_chance)
        same = quantity.kind is Kind.EVENT and quantity.measurement is None and told.nats > SAME * whole
        if told.nats > by_chance.max() and not same:
            found.append(_hinge(quantity, told, codes == wanted))
    bar = float(np.quantile(best_by_chance, SURELY))
    surely = [hinge for hinge in found if hinge is not None and hinge.information > bar]
    return tuple(sorted(surely, key=lambda hinge: -hinge.information)[:MOST])


def _hinge(quantity: Quantity, told: Information, yes: Bool[np.ndarray, "draw"]) -> Hinge | None:
    split = _split(quantity, yes)
    if split is None:
        return None
    condition, threshold, mask = split
    inside, outside = (float(yes[side].mean()) for side in (mask, ~mask))
    return Hinge(
        quantity.kind, quantity.name, quantity.unit, told.nats, told.error, condition, threshold, inside, outside
    )


def _split(
    quantity: Quantity, yes: Bool[np.ndarray, "draw"]
) -> tuple[str, float | None, Bool[np.ndarray, "draw"]] | None:
    """The condition that tells most, in words, its threshold, and the draws where it holds; None where none does."""
    if quantity.labels:
        codes = quantity.values.astype(int)
        masks = [codes == code for code in range(len(quantity.labels))]
        told = [_told(mask, yes) for mask in masks]
        # of two values either tells the same: the one that speaks for the answer is told, of yes and no the yes
        speaks = [len(masks) == 2 or (mask.any() and yes[mask].mean() > yes.mean()) for mask in masks]
        best = max(range(len(masks)), key=lambda place: (speaks[place] * told[place], place))
        return quantity.labels[best], None, masks[best]
    edges = np.unique(np.quantile(quantity.values, np.linspace(SMALLEST_SIDE, 1 - SMALLEST_SIDE, 61)))
    # where many draws share the largest value no draw is above it
    edges = edges[edges < quantity.values.max()]
    if not len(edges):
        return None
    told = [_told(quantity.values > edge, yes) for edge in edges]
    threshold = float(edges[int(np.argmax(told))])
    unit = "" if quantity.unit == "" else quantity.unit if quantity.unit == "°" else f" {quantity.unit}"
    return f"above {threshold:.3g}{unit}", threshold, quantity.values > threshold


def _told(mask: Bool[np.ndarray, "draw"], yes: Bool[np.ndarray, "draw"]) -> float:
    """Information in nats of one yes or no about another, from their shares."""
    sides = [side for side in (mask, ~mask) if side.any()]
    return _binary_entropy(yes) - sum(float(side.mean()) * _binary_entropy(yes[side]) for side in sides)


def _binary_entropy(yes: Bool[np.ndarray, "draw"]) -> float:
    return entropy(np.array([yes.mean(), 1 - yes.mean()]))
