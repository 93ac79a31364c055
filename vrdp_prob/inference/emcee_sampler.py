"""Sampling with emcee: independent ensembles of walkers, each merged into one chain before anything is judged.

Moves along the gradient do most of the mixing; differential evolution and proposals that forget the place jump between
what gradients do not connect.

Walkers of one ensemble propose from one another, so they are no independent chains; whole ensembles are.
No snooker moves: in emcee 3.1.6 they shrink a Gaussian's standard deviation to 0.77 of what it is.
Source: Foreman-Mackey, Hogg, Lang and Goodman, emcee: The MCMC Hammer, PASP 125 (2013); ter Braak, A Markov chain
Monte Carlo version of the genetic algorithm differential evolution, Statistics and Computing 16 (2006).
"""

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.diagnostics import Reported, drift, joined, ordered, settled
from vrdp_prob.inference.draws.samples import ESS_GOAL, R_HAT_GOAL, LogDensity, Samples
from vrdp_prob.inference.runs.checkpoint import Checkpoint, kept
from vrdp_prob.inference.samplers.emcee_ensemble import Ensemble
from vrdp_prob.inference.samplers.mixture import Jumps, Mixture
from vrdp_prob.inference.samplers.mode_weights import doubts, weights_from_chains
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.samplers.shaping import Shaped, shaped, starting_places
from vrdp_prob.models.simulator.work import metered, work_sentence
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

ENSEMBLES = 4
FEWEST_WALKERS = 40
WARM_UP = 16
"""Steps that tune the Hamiltonian move and are thrown away."""
ROUND = 16
"""Steps after which the draws are judged and kept on disk."""
STEPS_TOGETHER = 2
"""Steps after which the ensembles, one thread each, wait for one another, so that an interruption is soon noticed."""
MOST_STEPS = 900
WORK_LIMIT = 40_000_000
"""Work (see `work.py` of the simulator) after which sampling stops; a minute on two cores of 2020. It is no time,
so that the same seed gives the same draws on every machine."""
PER_WALKER = 3.0
"""Effective draws that each walker needs: one that never moves counts as about 1.5, so that many of them look well."""
MARGIN = 1.15
"""Effective draws beyond the goal at which it stops, so that thinning does not fall short of it."""


def sample_emcee(
    density: LogDensity,
    start: Mixture,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    checkpoint: Checkpoint | None = None,
    reported: Reported | None = None,
    form: Shaped | None = None,
    jumps: Jumps | None = None,
    rate_steps: RateSteps | None = None,
    most_steps: int = MOST_STEPS,
    work_limit: int = WORK_LIMIT,
) -> Samples:
    """Draw with several independent ensembles.

    Parameters
    ----------
    density
        The log posterior, differentiable.
    start
        A cloud per mode.
    draws
        Number of draws that are wanted over all ensembles; ensembles are run until they have converged, which mostly
        gives more, and a note says where it gives fewer.
    generator
        Source of randomness.
    progress
        Told how many steps are done.
    checkpoint
        Where to keep what is done, and to go on from.
    reported
        Quantities that have to be known well enough; the coordinates where None.
    form
        The clouds in the posterior's shape, where that is known already.
    jumps
        Proposals that reach what lies beyond the clouds, and places there, if anything does.
    rate_steps
        Steps that trade rates of slowing down, if there are any.
    most_steps, work_limit
        Steps of every ensemble and work of all after which sampling stops even if it has not converged.

    Returns
    -------
    One chain per ensemble, walker after walker so that autocorrelation within a walker shows; all steps after warm-up.
    The R-hat that goes with it compares the ensembles' earlier with their later steps.
    """
    with metered() as meter:
        form = form or _kept_form(density, start, generator, checkpoint)
        walkers = max(2 * (start.dimension + 1), FEWEST_WALKERS)
        ensembles = [
            Ensemble(
                density,
                form.mixture,
                _places(density, form, jumps, walkers, generator),
                int(generator.integers(2**31)),
                checkpoint.path(f"ensemble_{index}.h5") if checkpoint is not None else None,
                jumps=None if jumps is None else jumps.mixture,
                rate_steps=rate_steps,
            )
            for index in range(ENSEMBLES)
        ]
    with (progress or SilentProgress()).stage("Sampling (emcee), at most", total=WARM_UP + most_steps) as advance:
        stopped = _run(ensembles, form.mixture, reported, advance, most_steps=most_steps, work_limit=work_limit)
    points = _points(form.mixture, ensembles)
    by_walker = joined(points)
    log_density = np.stack([ensemble.log_density(WARM_UP) for ensemble in ensembles])
    modes = weights_from_chains(form.mixture, by_walker)
    acceptance_rate = np.broadcast_to([[ensemble.acceptance] for ensemble in ensembles], by_walker.shape[:2])
    return Samples(
        by_walker,
        np.swapaxes(log_density, 1, 2).reshape(len(log_density), -1),
        {"acceptance_rate": acceptance_rate},
        r_hat=drift(ordered(points), reported),
        evaluations=form.evaluations + sum(ensemble.evaluations for ensemble in ensembles),
        gradients=form.gradients + sum(ensemble.gradients for ensemble in ensembles),
        work=meter.rows + sum(ensemble.work for ensemble in ensembles),
        modes=modes,
        notes=(*stopped, *_too_few(by_walker, draws)),
        doubts=doubts(modes),
        ess_goal=_ess_goal(ensembles),
    )


def _too_few(points: Float[np.ndarray, "chain draw dimension"], draws: int) -> tuple[str, ...]:
    made = points.shape[0] * points.shape[1]
    return (f"emcee made {made} draws, fewer than the {draws} that were asked for.",) if made < draws else ()


def _run(
    ensembles: list[Ensemble],
    mixture: Mixture,
    reported: Reported | None,
    advance: Advance,
    *,
    most_steps: int,
    work_limit: int,
) -> tuple[str, ...]:
    """Run ensembles until they have converged, or say at which limit they have stopped."""
    with ThreadPoolExecutor(max_workers=min(ENSEMBLES, os.cpu_count() or 1)) as workers:

        def run_to(end: int, *, tune: bool) -> None:
            while any(ensemble.steps < end for ensemble in ensembles):
                behind = [ensemble for ensemble in ensembles if ensemble.steps < end]
                list(workers.map(lambda one: one.run(min(STEPS_TOGETHER, end - one.steps), tune=tune), behind))
                advance(STEPS_TOGETHER)
            for ensemble in ensembles:
                ensemble.keep()

        # Ensembles that were killed while they were kept may be a round apart.
        done = max(ensemble.steps for ensemble in ensembles)
        advance(done)
        run_to(WARM_UP, tune=True)
        end = max(WARM_UP + min(ROUND, most_steps), done)
        while True:
            run_to(end, tune=False)
            points = _points(mixture, ensembles)
            effective = MARGIN * _ess_goal(ensembles)
            if settled(joined(points), ordered(points), reported, r_hat=R_HAT_GOAL, effective=effective):
                return ()
            work = sum(ensemble.work for ensemble in ensembles)
            if work >= work_limit:
                return (work_sentence(work_limit),)
            if end >= WARM_UP + most_steps:
                return (f"It stopped after {most_steps} steps.",)
            end = min(end + ROUND, WARM_UP + most_steps)


def _places(
    density: LogDensity, form: Shaped, jumps: Jumps | None, count: int, generator: np.random.Generator
) -> Float[np.ndarray, "walker dimension"]:
    """Places for walkers to set out from: those that jumps know, where there are any."""
    if jumps is None:
        return starting_places(density, form, count, generator)
    return jumps.starts(count, generator)


def _kept_form(
    density: LogDensity, start: Mixture, generator: np.random.Generator, checkpoint: Checkpoint | None
) -> Shaped:
    def compute() -> Mapping[str, np.ndarray]:
        return shaped(density, start, generator, lambda _worlds: None).arrays()

    return Shaped.of_arrays(kept(checkpoint, "form", generator, compute), start)


def _ess_goal(ensembles: list[Ensemble]) -> float:
    """Effective draws that are enough, and more than walkers that never move would look like."""
    return max(ESS_GOAL, PER_WALKER * sum(ensemble.walkers for ensemble in ensembles))


def _points(mixture: Mixture, ensembles: list[Ensemble]) -> Float[np.ndarray, "ensemble walker step dimension"]:
    whitened = np.stack([ensemble.chain(WARM_UP) for ensemble in ensembles])
    return np.swapaxes(mixture.components[0].points(whitened), 1, 2)
