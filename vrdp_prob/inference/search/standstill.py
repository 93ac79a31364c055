"""Other explanations of a body that stands still in a fit while it is seen to move.

What slows a body may be friction, or a force that drives it back once it has stopped. Up to the stop both may give the
same motion, and then the world with friction has no slope towards the other one: a body that friction holds does not
begin to move for a small force.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool

from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.hypothesis import Hypothesis
from vrdp_prob.inference.search.least_squares import Minimum
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import ROLLING_RESISTANCE, SLIDING_FRICTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind

FRICTION = (SLIDING_FRICTION.name, ROLLING_RESISTANCE.name)
LESS = (0.3, 0.03)
"""Factors by which friction may be smaller."""
DEVIATION = 2.0
"""Root mean square residual, in units of the noise, from which a body does not stand still."""
FIRST_ITERATIONS, THEN_ITERATIONS = 10, 10
"""Steps in which something else takes the place of friction before the stop, and then in all coordinates."""


def _drives(model: PhysicsModel) -> bool:
    """Whether a model has forces beyond those of the base model, which only slow bodies."""
    usual = {effect.name for effect in PhysicsModel.base().effects}
    added = [effect for effect in model.effects if effect.name not in usual]
    return any(effect.overrides("acceleration") or effect.overrides("pair_force") for effect in added)


def first_false_stop(likelihood: Likelihood, hypothesis: Hypothesis, frame_count: int, previous: int) -> float | None:
    """When the first body stopped (s) that is seen to move in frames in which it stands still; None without such.

    None, too, where no force of the model could have moved it.
    """
    if not _drives(likelihood.model):
        return None
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(hypothesis.point[None]), frame_count)
    stops = rollout.events.of_kind(RolloutEventKind.STOP)
    still = (rollout.velocity[0, -1, :, :2] == 0).all(dim=-1).numpy()
    observations = likelihood.observations
    seen = observations.frame < frame_count
    squares = (likelihood.residuals(hypothesis.point[None], frame_count)[0][: 2 * seen.sum()] ** 2).reshape(-1, 2)
    new = observations.frame[seen] >= previous
    times = []
    for body in np.flatnonzero(still).tolist():
        deviating = squares[new & (observations.body[seen] == body)]
        if len(deviating) and deviating.mean() > DEVIATION**2 and (stops.first == body).any():
            times.append(float(stops.time[stops.first == body].max()))
    return min(times, default=None)


def moving_on(
    descent: Descent,
    hypothesis: Hypothesis,
    stop: float,
    frame_count: int,
    active: Bool[np.ndarray, "dimension"],
    *,
    threshold: float,
) -> Sequence[Minimum]:
    """Refined explanations of the first frames in which friction is less and something else has slowed the bodies.

    Parameters
    ----------
    descent
        How starts are refined.
    hypothesis
        What explains the frames so far.
    stop
        Time (s) of the stop after which a body is seen to move.
    frame_count
        Frames that count.
    active
        Coordinates that may move.
    threshold
        Residuals beyond it count linearly.
    """
    likelihood = descent.likelihood
    friction = likelihood.coordinates.mask(FRICTION)
    held = likelihood.coordinates.mask((*FRICTION, FRICTION_RATIO.name))
    before = int(np.searchsorted(likelihood.tracks.times[:frame_count], stop))
    starts = np.tile(hypothesis.before(stop).point, (len(LESS), 1))
    starts[:, friction] += np.log(LESS)[:, None]
    first = descent(
        starts, active & ~held, frame_count=before, iterations=FIRST_ITERATIONS, tolerance=0.05, threshold=threshold
    )
    return descent(
        np.array([one.point for one in first]),
        active,
        frame_count=frame_count,
        iterations=THEN_ITERATIONS,
        tolerance=0.05,
        threshold=threshold,
    )
