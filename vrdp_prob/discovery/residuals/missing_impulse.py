"""Impulses that a model may miss at contacts: patterns over the approach speed, the slip, the place and the time."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.residuals.contact_patterns import WHERE, contacts_of
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight_patterns import Scales
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.models.simulator.events import RolloutEventKind

SYMBOLS = (
    "SI units; n the normal, towards the body that is pushed, l is n turned to the left, s against the slip w of the "
    "touching points, v_n approach speed, J_n normal impulse, J_0 the impulse that ends the approach, m reduced mass, "
    "t time since the first frame"
)
"""What the symbols of formulas mean."""
KINDS = {RolloutEventKind.COLLISION: "", RolloutEventKind.WALL: " [wall]"}
"""What bodies touch, and how a formula says so."""

Factor = Callable[[FittedContacts], Float[np.ndarray, "contact"]]


@dataclass(frozen=True)
class ImpulsePattern:
    """A pattern of impulses.

    Parameters
    ----------
    kind
        What the bodies touch.
    impulse
        Impulses (kg m/s) on the second body or wall of each contact, for amplitude 1.
    formula
        The impulse as part of a formula in SI units (see `SYMBOLS`).
    """

    kind: RolloutEventKind
    impulse: Callable[[FittedContacts], Float[np.ndarray, "contact 2"]]
    formula: str


@dataclass(frozen=True)
class MissingImpulse:
    """Patterns of impulses, and what they do to the residuals.

    Parameters
    ----------
    patterns
        The patterns.
    rows
        What each does to the data's residuals of each video.
    anything
        What kicks of all bodies do at contacts of which nobody knows the direction.
    """

    patterns: tuple[ImpulsePattern, ...]
    rows: Sequence[Float[np.ndarray, "_ pattern"]]
    anything: Sequence[Float[np.ndarray, "_ _"]]

    @classmethod
    def of(cls, model: ResidualModel, scales: Scales) -> "MissingImpulse":
        """All patterns that the contacts of some videos can show."""
        found = {WHERE[where]: some for where, some in contacts_of(model).items()}
        clear = {kind: [one.where(one.known_normal) for one in some] for kind, some in found.items()}
        chosen = [one for kind, some in clear.items() if any(map(len, some)) for one in _patterns(kind, some, scales)]
        rows, anything = [], []
        for index, video in enumerate(model.videos):
            columns = [
                (some := clear[one.kind][index]).pushed_apart(one.impulse(some)[..., None])[..., 0] for one in chosen
            ]
            empty = np.zeros((*video.motion.speed.shape, 3, 0))
            rows.append(video.rows(np.stack(columns, axis=-1) if columns else empty))
            vague = [one[index].where(~one[index].known_normal).pushed_anyhow() for one in found.values()]
            anything.append(video.rows(np.concatenate(vague, axis=-1)))
        return cls(tuple(chosen), rows, anything)


def _patterns(kind: RolloutEventKind, contacts: Sequence[FittedContacts], scales: Scales) -> Iterator[ImpulsePattern]:
    """Patterns of the contacts of one kind."""
    usual = float(np.median(np.concatenate([one.events.closing_speed for one in contacts])))
    for factor, words in _restitutions(max(usual, 1e-3), scales):
        yield _along_normal(kind, factor, f"{words} J_0 n".strip())
    yield _along_tangent(kind, lambda one: one.rubbing * one.events.impulse, "J_n s")
    yield _along_tangent(kind, lambda one: -one.slip * one.common_mass, "m |w| s")
    yield _along_tangent(kind, lambda one: one.events.impulse, "J_n l")


def _restitutions(usual: float, scales: Scales) -> Iterator[tuple[Factor, str]]:
    """What restitution may depend on, and the words of a formula for it."""
    yield lambda one: np.ones(len(one)), ""
    yield lambda one: one.log_speed, "log(v_n)"
    yield lambda one: np.exp(-((one.events.closing_speed / usual) ** 2)), f"exp(-(v_n/{usual:.2g})^2)"
    for axis in scales.axes:
        yield _place(scales, axis), scales.place_words[axis]
    yield lambda one: one.events.time - one.motion.times[0], "t"


def _place(scales: Scales, axis: int) -> Factor:
    return lambda one: one.events.point[:, axis] - scales.middle[axis]


def _along_normal(kind: RolloutEventKind, factor: Factor, words: str) -> ImpulsePattern:
    def impulse(contacts: FittedContacts) -> Float[np.ndarray, "contact 2"]:
        return (factor(contacts) * contacts.stopping)[:, None] * contacts.events.normal

    return ImpulsePattern(kind, impulse, words + KINDS[kind])


def _along_tangent(kind: RolloutEventKind, size: Factor, words: str) -> ImpulsePattern:
    return ImpulsePattern(kind, lambda one: size(one)[:, None] * one.tangent, words + KINDS[kind])
