"""How the contacts that were seen differ from the law of the model: by an impulse that is turned, larger or smaller.

The impulse of a contact is a vector, and so is what the model makes of the same approach. Their ratio, as complex
numbers, is the deviation: its logarithm holds the change of size and the turn, of one scale s. How large s is on this
table, the turns tell: mass and restitution cannot make up for them, as they do for sizes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.contacts import Contact
from vrdp_prob.reasoning.refit import Turning
from vrdp_prob.reasoning.scales import Examples, ScalePrior
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.stretch import Meeting, State, Stretch, advance, around

LEAD = 0.1
"""Time in s before a seen contact at which the model's contact sets out, on a straight line."""
LEAST_SHARE = 0.5
"""Share of the draws that must touch where a contact was seen, for the contact to say anything."""
FEWEST_DRAWS = 10
"""Draws below which nobody can say how exactly the tracks tell a deviation."""
LARGEST_TURN = np.pi / 2
"""Turn from which an impulse is not that of the model's contact at all: a graze on the other side."""
LARGEST_SIZE = 0.7
"""Largest change of the logarithm of an impulse taken at face value: a graze has hardly an impulse to compare with."""
USUAL_IMPULSE, USUAL_ACCELERATION = ScalePrior(0.02, 1.2), ScalePrior(0.02, 1.2)
"""What is believed of deviations where nothing is known of the table."""


@dataclass(frozen=True)
class DeviationModel:
    """What is believed of how the motion deviates from the model, before a video is looked at.

    Parameters
    ----------
    impulse
        Scale of the deviations of impulses: relative size, and turn in rad.
    acceleration
        Strength of the white acceleration between contacts, in m/s^1.5.
    reused
        Whether a contact that takes place as one that was seen has the deviation that was seen.
    """

    impulse: ScalePrior = USUAL_IMPULSE
    acceleration: ScalePrior = USUAL_ACCELERATION
    reused: bool = True


@dataclass(frozen=True)
class Deviation:
    """What one seen contact did beyond the model, in every draw.

    Parameters
    ----------
    first, second
        The bodies, first < second.
    touches
        Draws in which the model's bodies touch as well; the others say nothing.
    normal
        Unit vector from the first to the second body in the model's contact.
    approach
        Velocity in m/s of the second relative to the first before it.
    log_ratio
        Logarithm of the size, and turn in rad, of the seen impulse relative to the model's.
    """

    first: int
    second: int
    touches: Bool[np.ndarray, "draw"]
    normal: Float[np.ndarray, "draw 2"]
    approach: Float[np.ndarray, "draw 2"]
    log_ratio: Float[np.ndarray, "draw 2"]

    def select(self, draws: np.ndarray) -> "Deviation":
        """The deviation in some of the draws."""
        parts = (array[draws] for array in (self.touches, self.normal, self.approach, self.log_ratio))
        return Deviation(self.first, self.second, *parts)

    @property
    def mean(self) -> Float[np.ndarray, "2"]:
        """Mean of `log_ratio`."""
        return np.asarray(self.log_ratio[self.touches].mean(axis=0))

    @property
    def variance(self) -> Float[np.ndarray, "2"]:
        """How uncertain the tracks (and, for the size, masses and restitutions) leave it."""
        return np.asarray(self.log_ratio[self.touches].var(axis=0))


def seen_deviations(seen: SeenVideo, worlds: Worlds, model: PhysicsModel, turning: Turning) -> tuple[Deviation, ...]:
    """The deviations of the contacts that were seen for certain, in order of time.

    Parameters
    ----------
    seen
        What the tracks tell.
    worlds
        Masses, restitutions and parameters of each draw.
    model
        The physics.
    turning
        Gives angle (rad) and spin (rad/s) of a body at a time (s).
    """
    found = (_deviation(contact, seen, worlds, model, turning) for contact in seen.seen.contacts)
    return tuple(one for one in found if one is not None)


def turns(deviations: Sequence[Deviation]) -> Examples:
    """What the turns of contacts say of the scale of deviations."""
    return [(float(one.mean[1]), float(one.variance[1])) for one in deviations]


def turned(
    kick: Float[np.ndarray, "*shape 2"], log_ratio: Float[np.ndarray, "*shape 2"]
) -> Float[np.ndarray, "*shape 2"]:
    """Vectors that are made larger and turned."""
    size, cosine, sine = np.exp(log_ratio[..., 0]), np.cos(log_ratio[..., 1]), np.sin(log_ratio[..., 1])
    x, y = kick[..., 0], kick[..., 1]
    return np.stack([size * (cosine * x - sine * y), size * (sine * x + cosine * y)], axis=-1)


def _deviation(
    contact: Contact, seen: SeenVideo, worlds: Worlds, model: PhysicsModel, turning: Turning
) -> Deviation | None:
    """The deviation of one contact; None where the model's bodies hardly touch."""
    pair = (contact.first, contact.second)
    time = float(np.clip(contact.time, seen.tracks.times[0], seen.tracks.times[-1]))
    before, after = (_velocities(seen, pair, time, before=flag) for flag in (True, False))
    state = _approach(seen, pair, time, turning)
    met = _first_meeting(advance(worlds, state, np.array([time + LEAD]), model), pair)
    if not len(met.draws):
        return None
    own = worlds.select(met.draws.tolist())
    moments = around(own, state.select(met.draws), met.time, model)
    mass = own.mass.detach().numpy()[:, list(pair)]
    simulated = _impulse(moments.kick[:, list(pair)], mass)
    observed = _impulse((after - before)[met.draws], mass)
    # the model's as a divisor is never 0: a contact that gives no impulse is none
    ratio = (observed[:, 0] + 1j * observed[:, 1]) * (simulated[:, 0] - 1j * simulated[:, 1])
    ratio /= np.maximum((simulated**2).sum(axis=1), 1e-12)
    touches = np.zeros(seen.draws, dtype=bool)
    touches[met.draws] = np.abs(np.angle(ratio)) < LARGEST_TURN
    if touches.sum() < max(LEAST_SHARE * seen.draws, FEWEST_DRAWS):
        return None
    normal, approach, log_ratio = (np.zeros((seen.draws, 2)) for _ in range(3))
    normal[met.draws], approach[met.draws] = met.normal, before[met.draws, 1] - before[met.draws, 0]
    size = np.clip(np.log(np.maximum(np.abs(ratio), 1e-9)), -LARGEST_SIZE, LARGEST_SIZE)
    log_ratio[met.draws] = np.stack([size, np.angle(ratio)], axis=1)
    return Deviation(*pair, touches, normal, approach, log_ratio)


def _velocities(seen: SeenVideo, pair: tuple[int, int], time: float, *, before: bool) -> Float[np.ndarray, "draw 2 2"]:
    """Velocities (draw, body of the pair, axis) as seen, on one side of a contact."""
    return np.stack([seen.drawn[body].state(np.array([time]), before=before)[1][:, 0] for body in pair], axis=1)


def _approach(seen: SeenVideo, pair: tuple[int, int], time: float, turning: Turning) -> State:
    """The two bodies shortly before a contact, on the straight lines that lead to where they were seen in it."""
    state = State.nowhere((seen.draws, len(seen.drawn)), time - LEAD)
    for body in pair:
        position, velocity = (array[:, 0] for array in seen.drawn[body].state(np.array([time]), before=True))
        angle, spin = turning(body, time)
        state.position[:, body], state.velocity[:, body] = position - LEAD * velocity, velocity
        state.angle[:, body], state.spin[:, body] = angle - LEAD * spin, spin
        state.rolling[:, body], state.present[:, body] = velocity, True
    return state


def _first_meeting(stretch: Stretch, pair: tuple[int, int]) -> Meeting:
    """The first contact of each draw in which the two bodies touch."""
    first = next(stretch.meetings(), stretch.contacts)
    return first.where((first.first == pair[0]) & (first.second == pair[1]))


def _impulse(kick: Float[np.ndarray, "draw 2 2"], mass: Float[np.ndarray, "draw 2"]) -> Float[np.ndarray, "draw 2"]:
    """Impulse in kg m/s on the second body, as both velocity changes tell it."""
    momentum = kick * mass[:, :, None]
    return (momentum[:, 1] - momentum[:, 0]) / 2
