"""The fast way: draws from curved clouds around the modes, corrected by Pareto-smoothed importance sampling.

Clouds do not follow the ridge along which friction and drag trade for each other to its ends, and a tail that no draw
has hit leaves no trace in the weights. So every resampled draw then takes some Metropolis steps along that ridge
(resample-move; Gilks and Berzuini, Following a moving target, J. Royal Statistical Society B 63, 2001).

Where the weights cannot be trusted it says so and hands on to emcee, which sets out from what it has learned.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.diagnostics import Reported, weighted_statistics
from vrdp_prob.inference.draws.samples import ESS_GOAL, PARETO_K_GOAL, LogDensity, Samples
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.inference.samplers.importance import (
    Weighted,
    effective_count,
    evaluated_in_batches,
    flattened,
    resampled,
    smoothed_weights,
)
from vrdp_prob.inference.samplers.mixture import Jumps, Mixture
from vrdp_prob.inference.samplers.mode_weights import doubts, weights_from_importance
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.samplers.shaping import shaped
from vrdp_prob.models.simulator.work import metered
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

ROUND = 4000
"""Proposals after which it is seen whether there are enough."""
FEWEST_ROUNDS = 4
"""A long tail that none of a few thousand draws has hit leaves no trace in their weights: of six times 8000 draws that
looked well (k 0.34 to 0.5) one gave an air drag a standard deviation that was too small by five standard errors."""
MOST_ROUNDS = 10
"""Proposals that leave fewer effective draws than the goal by then miss something, whatever Pareto k says: on practice
video 0 (k 0.58, 135 effective of 24 000) the mean of a drag was off by 0.36 standard deviations."""
FEWEST = 100.0
"""Where the weights leave fewer effective draws than this and nobody goes on they are flattened, so that the draws at
least spread."""
FAR = 0.7
"""Share of the proposals that jumps make, where there are any."""
TRADES = 30
"""Steps of each draw along the ridge of friction and drag."""
MARGIN = 1.1
"""Effective draws beyond the goal at which it stops, so that resampling does not fall short of it."""


def sample_laplace(
    density: LogDensity,
    start: Mixture,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    checkpoint: Checkpoint | None = None,
    reported: Reported | None = None,
    jumps: Jumps | None = None,
    rate_steps: RateSteps | None = None,
    hand_on: bool = True,
) -> Samples:
    """Draw by importance sampling around the modes.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    start
        A cloud per mode.
    draws
        Number of draws to hand back, resampled by their smoothed weights.
    generator
        Source of randomness.
    progress
        Told how many worlds were simulated.
    checkpoint
        Where emcee keeps what it has done, if it comes to that; the fast way itself is done in seconds.
    reported
        Quantities that have to be known well enough; the coordinates where None.
    jumps
        Proposals that reach what lies beyond the clouds, if anything does.
    rate_steps
        Steps that trade rates of slowing down, which the draws take in the end, and emcee, if it comes to that.
    hand_on
        Whether emcee goes on where the weights cannot be trusted. If not, the draws are handed back as they are, and
        their Pareto k says that they are not to be trusted.

    Returns
    -------
    One chain of draws, with Pareto k-hat and what they are worth; or those of emcee, with the reason in `notes`.
    """
    with metered() as meter, (progress or SilentProgress()).stage("Importance sampling") as advance:
        form = shaped(density, start, generator, advance)
        proposal = form.mixture if jumps is None else form.mixture.joined(jumps.mixture, FAR)
        drawn = Weighted.drawn(density, proposal, ROUND, generator, advance)
        weights, pareto_k = smoothed_weights(drawn.log_ratio)
        known = weighted_statistics(drawn.points, weights, reported)
        for done in range(1, MOST_ROUNDS):
            worth = min(known.ess_bulk, known.ess_tail)
            if worth * MOST_ROUNDS * ROUND < ESS_GOAL * len(weights):
                break  # more of the same would not do
            if done >= FEWEST_ROUNDS and pareto_k <= PARETO_K_GOAL and worth >= MARGIN * ESS_GOAL:
                break
            drawn = drawn.joined(Weighted.drawn(density, proposal, ROUND, generator, advance))
            weights, pareto_k = smoothed_weights(drawn.log_ratio)
            known = weighted_statistics(drawn.points, weights, reported)
    enough = min(known.ess_bulk, known.ess_tail) >= ESS_GOAL
    if hand_on and not (pareto_k <= PARETO_K_GOAL and enough):
        reason = (
            f"The fast way could not be trusted (Pareto k {pareto_k:.2f}, {min(known.ess_bulk, known.ess_tail):.0f} "
            f"effective of {len(weights)} draws for {known.worst}), so emcee went on from what it had learned."
        )
        samples = sample_emcee(
            density,
            start,
            draws=draws,
            generator=generator,
            progress=progress,
            checkpoint=checkpoint,
            reported=reported,
            form=form,
            jumps=jumps,
            rate_steps=rate_steps,
        )
        return replace(
            samples,
            evaluations=samples.evaluations + len(weights),
            work=samples.work + meter.rows,
            notes=(reason, *samples.notes),
            sampler="emcee",
        )
    modes = weights_from_importance(form.mixture, drawn.points, weights)
    if effective_count(weights) < FEWEST:
        weights = flattened(drawn.log_ratio, FEWEST)
    chosen = resampled(weights, draws, generator)
    points, log_density, trades = drawn.points[chosen], drawn.log_density[chosen], 0
    with metered() as trading:
        if rate_steps is not None:
            trades = TRADES * draws
            with (progress or SilentProgress()).stage("Trading friction for drag", total=trades) as advance:
                points, log_density = _traded(
                    density, rate_steps, points, log_density, generator=generator, advance=advance
                )
    return Samples(
        points[None],
        log_density[None],
        {"log_weight": np.log(np.maximum(weights[chosen], 1e-300))[None]},
        pareto_k=pareto_k,
        known=known,
        evaluations=len(drawn.log_ratio) + form.evaluations + trades,
        gradients=form.gradients,
        work=meter.rows + trading.rows,
        modes=modes,
        doubts=doubts(modes),
    )


def _traded(
    density: LogDensity,
    rate_steps: RateSteps,
    points: Float[np.ndarray, "draw dimension"],
    log_density: Float[np.ndarray, "draw"],
    *,
    generator: np.random.Generator,
    advance: Advance,
) -> tuple[Float[np.ndarray, "draw dimension"], Float[np.ndarray, "draw"]]:
    """Draws after some steps of each that trade rates of slowing down, with their log densities."""
    for _ in range(TRADES):
        moved, volume = rate_steps.moved(points, generator)
        value = evaluated_in_batches(density, moved, advance)
        taken = np.log(generator.random(len(points))) < value + volume - log_density
        points = np.where(taken[:, None], moved, points)
        log_density = np.where(taken, value, log_density)
    return points, log_density
