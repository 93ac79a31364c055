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

from vrdp_prob.inference.checkpoint import Checkpoint, kept
from vrdp_prob.inference.diagnostics import Reported, drift, joined, ordered, settled
from vrdp_prob.inference.emcee_ensemble import Ensemble
from vrdp_prob.inference.mixture import Jumps, Mixture
from vrdp_prob.inference.mode_weights import doubts, weights_from_chains
from vrdp_prob.inference.rate_steps import RateSteps
from vrdp_prob.inference.samples import ESS_GOAL, R_HAT_GOAL, LogDensity, Samples
from vrdp_prob.inference.shaping import Shaped, clouds_arrays, clouds_of, reshaped, shaped, starting_places
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
RESHAPED_AFTER = (96, 256)
"""Steps after which ensembles that have not converged give the clouds their shape, and begin anew where they are; none
where they jump between islands, whose common shape is that of none of them."""
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
        Number of draws that are wanted over all ensembles; ensembles are run until they have converged, which gives
        more.
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
    One chain per ensemble, walker after walker so that autocorrelation within a walker shows; all steps after warm-up,
    and after the clouds have taken their last shape.
    The R-hat that goes with it compares the ensembles' earlier with their later steps.
    """
    del draws
    with metered() as meter:
        form = form or _kept_form(density, start, generator, checkpoint)
        walkers = max(2 * (start.dimension + 1), FEWEST_WALKERS)
        places = [_places(density, form, jumps, walkers, generator) for _ in range(ENSEMBLES)]
    mixture, past = form.mixture, list[Ensemble]()
    with (progress or SilentProgress()).stage("Sampling (emcee), at most", total=WARM_UP + most_steps) as advance:
        for turn, until in enumerate(_turns(most_steps, changing=jumps is None)):
            ensembles = [
                Ensemble(
                    density,
                    mixture,
                    begin,
                    int(generator.integers(2**31)),
                    None if checkpoint is None else checkpoint.path(_file(index, turn)),
                    jumps=None if jumps is None else jumps.mixture,
                    rate_steps=rate_steps,
                )
                for index, begin in enumerate(places)
            ]
            steps = until - sum(one.steps for one in past[::ENSEMBLES])
            worked = sum(ensemble.work for ensemble in past)
            settled_now = _run(ensembles, mixture, reported, advance, steps=steps, work_limit=work_limit - worked)
            past += ensembles
            work = sum(ensemble.work for ensemble in past)
            if settled_now or work >= work_limit or until == WARM_UP + most_steps:
                break
            mixture, places = _kept_turn(mixture, ensembles, turn, generator, checkpoint)
    stopped: tuple[str, ...] = ()
    if not settled_now:
        stopped = (work_sentence(work_limit) if work >= work_limit else f"It stopped after {most_steps} steps.",)
    points = _points(mixture, ensembles)
    by_walker = joined(points)
    log_density = np.stack([ensemble.log_density(WARM_UP) for ensemble in ensembles])
    modes = weights_from_chains(mixture, by_walker)
    acceptance_rate = np.broadcast_to([[ensemble.acceptance] for ensemble in ensembles], by_walker.shape[:2])
    return Samples(
        by_walker,
        np.swapaxes(log_density, 1, 2).reshape(len(log_density), -1),
        {"acceptance_rate": acceptance_rate},
        r_hat=drift(ordered(points), reported),
        evaluations=form.evaluations + sum(ensemble.evaluations for ensemble in past),
        gradients=form.gradients + sum(ensemble.gradients for ensemble in past),
        work=meter.rows + work,
        modes=modes,
        notes=stopped,
        doubts=doubts(modes),
        ess_goal=_ess_goal(ensembles),
    )


def _turns(most_steps: int, *, changing: bool) -> list[int]:
    """Steps, those of warm-up and of earlier turns included, at which each turn ends."""
    ends = [end for end in RESHAPED_AFTER if changing and end <= most_steps / 2]
    return [WARM_UP + end for end in (*ends, most_steps)]


def _file(index: int, turn: int) -> str:
    return f"ensemble_{index}_{turn}.h5" if turn else f"ensemble_{index}.h5"


def _kept_turn(
    mixture: Mixture,
    ensembles: list[Ensemble],
    turn: int,
    generator: np.random.Generator,
    checkpoint: Checkpoint | None,
) -> tuple[Mixture, list[Float[np.ndarray, "walker dimension"]]]:
    """The clouds in the shape of the draws so far, and the places where the walkers are."""
    points = _points(mixture, ensembles)
    later = points[:, :, points.shape[2] // 2 :]

    def compute() -> Mapping[str, np.ndarray]:
        independent = float(later.shape[0] * later.shape[1])
        return clouds_arrays(reshaped(mixture, later.reshape(-1, later.shape[-1]), independent))

    found = clouds_of(kept(checkpoint, f"turn_{turn + 1}", generator, compute), mixture)
    return found, [one[:, -1] for one in points]


def _run(
    ensembles: list[Ensemble],
    mixture: Mixture,
    reported: Reported | None,
    advance: Advance,
    *,
    steps: int,
    work_limit: int,
) -> bool:
    """Run ensembles until they have converged, for so many steps or so much work; whether they have."""
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
        end = min(max(WARM_UP + ROUND, done), steps)
        while True:
            run_to(end, tune=False)
            points = _points(mixture, ensembles)
            effective = MARGIN * _ess_goal(ensembles)
            if settled(joined(points), ordered(points), reported, r_hat=R_HAT_GOAL, effective=effective):
                return True
            if end >= steps or sum(ensemble.work for ensemble in ensembles) >= work_limit:
                return False
            end = min(end + ROUND, steps)


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
