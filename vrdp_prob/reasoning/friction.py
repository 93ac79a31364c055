"""Friction of each body by itself, read off its own free flights.

The model may let all bodies of a video share one friction; rubber and metal, sliding and rolling differ by factors of
two to twenty, and the tracks show it. What is simulated in an answer therefore uses, for each body, the shared friction
times a ratio that its own flights tell.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.models.effects.body_friction import FRICTION_RATIO, BodyFriction
from vrdp_prob.models.effects.dry_friction import DryFriction
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.motion import slips
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import Random
from vrdp_prob.reasoning.flight import Flight, scaled_friction
from vrdp_prob.reasoning.smoother import BodyTrack, Smoother
from vrdp_prob.scene import Shape

PRIOR_SD = 0.8
"""Standard deviation of the log friction ratio of a body before its flights are looked at."""

FLIGHT_SPREAD = 0.2
"""Standard deviation by which the log friction ratio differs between flights of a body: spheres slip, then roll."""

SHORTEST_FLIGHT = 8
LONGEST_FLIGHT = 40
"""Frames of a flight that is used, at least and at most (the last ones)."""

SLOWEST = 0.15
"""Flights whose fastest speed in m/s is below this tell nothing."""

PAUSE, SETTLING = 0.02, 0.15
"""Time in s after and before a contact that is left out; after one of a sphere that slips before it rolls."""


@dataclass(frozen=True)
class OwnFriction:
    """Friction ratio of each body, in every draw.

    Parameters
    ----------
    log_ratio
        Logarithm of its friction over the shared friction.
    sd
        Standard deviation of that, as the flights tell it.
    """

    log_ratio: Float[np.ndarray, "draw body"]
    sd: Float[np.ndarray, "body"]


@dataclass(frozen=True)
class ToldFriction:
    """What the flights tell of the friction ratio of each body.

    Parameters
    ----------
    mean, sd
        Mean and standard deviation of its logarithm.
    """

    mean: Float[np.ndarray, "body"]
    sd: Float[np.ndarray, "body"]

    def draw(self, draws: int, numbers: Random) -> OwnFriction:
        """Draws of the ratios."""
        return OwnFriction(self.mean + self.sd * numbers.standard_normal((draws, len(self.mean))), self.sd)


def with_friction_ratio(worlds: Worlds, model: PhysicsModel) -> tuple[Worlds, PhysicsModel] | None:
    """The same worlds and model with a ratio for each body (1 so far); None for a model without dry friction."""
    names = [effect.name for effect in model.effects]
    if DryFriction.name not in names:
        return None
    if BodyFriction.name in names:
        return worlds, model
    ratio = torch.ones_like(worlds.mass)
    extended = replace(worlds, parameters={**worlds.parameters, FRICTION_RATIO.name: ratio})
    return extended, model.with_effect(BodyFriction())


def told_friction(smoothers: Sequence[Smoother], world: Worlds, model: PhysicsModel) -> ToldFriction:
    """Friction ratio of each body from its free flights.

    Parameters
    ----------
    smoothers
        The motion of each body, with its contacts.
    world
        One world in the middle of the posterior, with a friction ratio.
    model
        The physics, with the effect of that ratio.
    """
    mean, sd = np.zeros(len(smoothers)), np.full(len(smoothers), PRIOR_SD)
    for body, smoother in enumerate(smoothers):
        told = [
            _one_flight(smoother, world, model, body, track)
            for track in flights(smoother, settling(model, world.shapes[body]))
        ]
        weights = np.array([1 / (1 / precision + FLIGHT_SPREAD**2) for _, precision in told if precision > 0])
        values = np.array([value for value, precision in told if precision > 0])
        total = weights.sum() + PRIOR_SD**-2
        mean[body], sd[body] = (weights * values).sum() / total, total**-0.5
    return ToldFriction(mean, sd)


def apply_friction(worlds: Worlds, log_ratio: Float[np.ndarray, "draw body"]) -> Worlds:
    """The same worlds with the friction of every body multiplied."""
    for body in range(log_ratio.shape[1]):
        worlds = scaled_friction(worlds, body, log_ratio[:, body])
    return worlds


def settling(model: PhysicsModel, shape: Shape) -> float:
    """Time in s after a contact from which on a body slides, or rolls, as it then goes on to do."""
    return SETTLING if shape is Shape.SPHERE and slips(model.effects) else PAUSE


def flights(smoother: Smoother, pause: float) -> list[BodyTrack]:
    """Parts of a track between contacts and a pause (s) after them in which the body moves: the last frames of each."""
    track = smoother.track
    bounds = [float(track.times[0]) - PAUSE, *smoother.kicks, float(track.times[-1]) + PAUSE]
    found = []
    for start, stop in pairwise(bounds):
        rows = np.flatnonzero((track.times >= start + pause - 1e-9) & (track.times <= stop - PAUSE + 1e-9))
        rows = rows[-LONGEST_FLIGHT:]
        if len(rows) < SHORTEST_FLIGHT:
            continue
        if np.linalg.norm(smoother.state(track.times[rows])[1], axis=1).max() > SLOWEST:
            found.append(BodyTrack(track.times[rows], track.positions[rows], track.noise[rows]))
    return found


def _one_flight(
    smoother: Smoother, world: Worlds, model: PhysicsModel, body: int, track: BodyTrack
) -> tuple[float, float]:
    """Log friction ratio that a flight tells, prior aside, and its precision."""
    begin = float(track.times[0])
    state = np.concatenate([array[0] for array in smoother.state(np.array([begin]))])
    flight = Flight(world, model, body, track=track, begin=begin)
    fitted = flight.fit(state[None], np.zeros(1), PRIOR_SD, None)
    precision = float(fitted.precision[0])
    # the fit is pulled to the prior's zero: undo it
    return float(fitted.log_ratio[0]) * (1 + PRIOR_SD**-2 / max(precision, 1e-9)), precision
