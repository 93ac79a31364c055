"""Sampling with Pyro's NUTS on the log posterior, whitened: several chains in every mode, weighted by its evidence.

A chain that follows gradients hardly ever finds its way from one mode to another. So each mode has chains of its own,
and importance sampling says what it weighs. Chains come in groups whose gradients are computed in one batch.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.diagnostics import Reported, drift, joined, ordered, settled
from vrdp_prob.inference.draws.samples import (
    ESS_GOAL,
    PARETO_K_GOAL,
    R_HAT_GOAL,
    LogDensity,
    ModeWeight,
    Samples,
    evaluate,
)
from vrdp_prob.inference.runs.checkpoint import Checkpoint, kept
from vrdp_prob.inference.samplers.importance import Weighted, smoothed_weights
from vrdp_prob.inference.samplers.mixture import Jumps, Mixture
from vrdp_prob.inference.samplers.mode_weights import doubts, weights_from_chains, weights_from_importance
from vrdp_prob.inference.samplers.nuts_chain import Courses
from vrdp_prob.inference.samplers.nuts_groups import Group, GroupRun
from vrdp_prob.inference.samplers.nuts_worker import workers
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.inference.samplers.shaping import Shaped, shaped, starting_places
from vrdp_prob.models.simulator.work import metered, work_sentence
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.spread import evenly_spread

GROUPS = 2
"""Groups of chains per mode..."""
TOGETHER = 8
"""...and chains per group, whose gradients are computed together."""
CHAINS = GROUPS * TOGETHER
RESULTS = 4
"""Chains that are handed back, each of several that are joined."""
WARM_UP = 30
"""Transitions that only adapt the step size: the mass matrix is the whitening, which other draws have shaped."""
CHUNK = 25
"""Transitions per chain after which the draws are judged and kept on disk."""
TRIAL_SHARE = 0.5
"""Share of the budgets from which on steps are no longer shortened."""
MOST_GRADIENTS = 150_000
"""Gradients of all chains after which sampling stops; a minute on two cores of 2020."""
WORK_LIMIT = 40_000_000
"""Simulated work after which sampling stops, for worlds of which one gradient costs as much as a hundred of others."""
MARGIN = 1.1
"""Effective draws beyond the goal at which it stops."""
EVIDENCE_DRAWS, EVIDENCE_ROUNDS = 4000, 6
"""Weighted draws that tell what modes weigh, and how often so many more are drawn until that is known as well as all
else."""
FEWEST_IN_MODE = 16
"""Draws of every result that must be in a mode for it not to be missed."""
HARDLY_ANY = 0.01
"""Weight below which a mode gets no chains."""
MOST_PROCESSES = GROUPS


def sample_nuts(
    density: LogDensity,
    start: Mixture,
    *,
    draws: int,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    checkpoint: Checkpoint | None = None,
    reported: Reported | None = None,
    warm_up: int = WARM_UP,
    most_gradients: int = MOST_GRADIENTS,
    work_limit: int = WORK_LIMIT,
    processes: int | None = None,
    jumps: Jumps | None = None,
    rate_steps: RateSteps | None = None,
    courses: Courses | None = None,
) -> Samples:
    """Draw with several NUTS chains in every mode.

    Parameters
    ----------
    density
        The log posterior, differentiable. Chains run in processes of their own if it can be pickled.
    start
        A cloud per mode.
    draws
        Number of draws over all chains that there are to be at least; chains are run until they have converged.
    generator
        Source of randomness.
    progress
        Told how many gradients are done.
    checkpoint
        Where to keep what is done, and to go on from.
    reported
        Quantities that have to be known well enough; the coordinates where None.
    warm_up
        Adaptation steps per chain.
    most_gradients, work_limit
        Gradients and work of all chains after which sampling stops even if it has not converged.
    processes
        How many processes to use; as many as there are cores, at most 2, where None. The draws do not depend on it.
    jumps
        Proposals that reach what lies beyond the clouds, and places there. Chains that make them are all in the
        coordinates of the heaviest cloud, and go to and fro between the modes by themselves.
    rate_steps
        Steps that trade rates of slowing down, if there are any.
    courses
        Tells divergences where a contact comes or goes from those within one course of events; None counts all alike.

    Returns
    -------
    Four chains, each of several one after another, from all modes in proportion to the modes' weights, with the number
    of divergences of both kinds. The R-hat that goes with them compares earlier with later draws.
    """
    with metered() as meter:
        form, places = _kept_start(density, start, generator, checkpoint)
        if jumps is not None:
            places = jumps.starts(CHAINS, generator)[None]
        weighed = _Weighed() if jumps else _kept_weights(density, form.mixture, generator, checkpoint)
    modes, doubtful = weighed.modes, weighed.doubts
    seed = int(generator.integers(2**31))
    inhabited = [index for index in range(len(places)) if len(places) == 1 or modes[index].weight >= HARDLY_ANY]
    far = None if jumps is None else jumps.mixture
    groups = [
        Group(
            form.mixture.components[mode],
            mode,
            number,
            places[mode, number * TOGETHER :][:TOGETHER],
            seed,
            far,
            rate_steps,
            courses,
        )
        for mode in inhabited
        for number in range(GROUPS)
    ]
    count = min(os.cpu_count() or 1, MOST_PROCESSES) if processes is None else processes
    stage = (progress or SilentProgress()).stage("Sampling (NUTS), at most", total=most_gradients)
    with stage as advance, workers(count) as pool:
        run = GroupRun(density, groups, checkpoint, pool, advance)
        run.further(warm_up)
        while True:
            run.further(CHUNK)
            if max(run.gradients / most_gradients, run.work / work_limit) < TRIAL_SHARE and run.with_shorter_steps():
                continue
            drawn = _in_proportion(run, form.mixture, inhabited, modes, np.random.default_rng(seed))
            enough = drawn.by_chain[..., 0].size >= draws and not drawn.missed
            if enough and settled(
                drawn.by_chain, drawn.by_time, reported, r_hat=R_HAT_GOAL, effective=MARGIN * ESS_GOAL
            ):
                stopped: tuple[str, ...] = ()
                break
            if run.gradients >= most_gradients:
                stopped = (f"It stopped at its budget of {most_gradients} gradients.",)
                break
            if run.work >= work_limit:
                stopped = (work_sentence(work_limit),)
                break
    if jumps is not None:
        modes = weights_from_chains(form.mixture, drawn.by_chain)
        doubtful = doubts(modes)
    return Samples(
        drawn.by_chain,
        np.stack([evaluate(density, chain) for chain in drawn.by_chain]),
        r_hat=drift(drawn.by_time, reported),
        divergences=run.divergences,
        cliffs=run.cliffs,
        transitions=run.transitions,
        evaluations=form.evaluations + weighed.evaluations + run.gradients,
        gradients=form.gradients + run.gradients,
        work=meter.rows + run.work,
        modes=modes,
        notes=stopped,
        doubts=(*doubtful, *_missed(modes, drawn.missed)),
    )


@dataclass(frozen=True)
class _Drawn:
    """Draws of all modes in proportion to what these weigh.

    Parameters
    ----------
    by_chain
        The draws of each result, those of its chains one after another.
    by_time
        The same draws, earlier ones first.
    missed
        Modes with a weight of which the chains hold hardly anything.
    """

    by_chain: Float[np.ndarray, "result draw dimension"]
    by_time: Float[np.ndarray, "result draw dimension"]
    missed: tuple[int, ...] = ()


def _in_proportion(
    run: GroupRun,
    mixture: Mixture,
    inhabited: list[int],
    modes: tuple[ModeWeight, ...],
    generator: np.random.Generator,
) -> _Drawn:
    """The draws of each result's chains, thinned to the modes' weights.

    A draw counts for the mode that it is in, whichever its chain set out from: chains are restricted, not trusted to
    stay.
    """
    chains = [run.points(mode) for mode in inhabited]
    by_result = np.concatenate([one.reshape(RESULTS, -1, *one.shape[1:]) for one in chains], axis=1)
    if len(inhabited) == 1:
        return _Drawn(joined(by_result), ordered(by_result))
    regions = mixture.regions(by_result.reshape(-1, mixture.dimension)).reshape(by_result.shape[:3])
    counts = np.array([(regions == mode).sum(axis=(1, 2)).min() for mode in inhabited])
    weights = np.array([modes[mode].weight for mode in inhabited])
    there = counts >= FEWEST_IN_MODE
    held, missed = np.array(inhabited)[there], tuple(np.array(inhabited)[~there].tolist())
    if not there.any():
        return _Drawn(joined(by_result), ordered(by_result), missed)
    wanted = np.floor(weights[there] * (counts[there] / weights[there]).min()).astype(int)
    labels = generator.permutation(np.repeat(held, wanted))
    shape = (RESULTS, len(labels), mixture.dimension)
    drawn = _Drawn(np.empty(shape), np.empty(shape), missed)
    for points, where, by_chain, by_time in zip(by_result, regions, drawn.by_chain, drawn.by_time, strict=True):
        for mode, count in zip(held, wanted.tolist(), strict=True):
            chain, time = np.nonzero(where == mode)
            chosen = evenly_spread(count, len(chain))
            chain, time = chain[chosen], time[chosen]
            by_chain[labels == mode] = points[chain, time]
            earlier = np.argsort(time, kind="stable")
            by_time[labels == mode] = points[chain[earlier], time[earlier]]
    return drawn


def _missed(modes: tuple[ModeWeight, ...], missed: tuple[int, ...]) -> tuple[str, ...]:
    """A sentence for every mode that the draws leave out."""
    return tuple(
        f"Hardly a draw is in mode {mode + 1}, which holds {modes[mode].weight:.2f} of the posterior."
        for mode in missed
    )


def _kept_start(
    density: LogDensity, start: Mixture, generator: np.random.Generator, checkpoint: Checkpoint | None
) -> tuple[Shaped, Float[np.ndarray, "mode chain dimension"]]:
    """The clouds in the posterior's shape, and places of every mode for its chains to set out from."""

    def compute() -> Mapping[str, np.ndarray]:
        form = shaped(density, start, generator, lambda _worlds: None)
        places = [starting_places(density, form, CHAINS, generator, mode=mode) for mode in range(len(start.components))]
        return {**form.arrays(), "starts": np.stack(places)}

    arrays = kept(checkpoint, "form", generator, compute)
    return Shaped.of_arrays(arrays, start), arrays["starts"]


@dataclass(frozen=True)
class _Weighed:
    """What modes weigh, sentences if that is not known well enough, and the densities that it took."""

    modes: tuple[ModeWeight, ...] = ()
    doubts: tuple[str, ...] = ()
    evaluations: int = 0


def _kept_weights(
    density: LogDensity, mixture: Mixture, generator: np.random.Generator, checkpoint: Checkpoint | None
) -> _Weighed:
    """What the modes weigh."""
    if len(mixture.components) == 1:
        return _Weighed()

    def compute() -> Mapping[str, np.ndarray]:
        def more() -> Weighted:
            return Weighted.drawn(density, mixture, EVIDENCE_DRAWS, generator, lambda _worlds: None)

        drawn = more()
        for done in range(1, EVIDENCE_ROUNDS + 1):
            weights, pareto_k = smoothed_weights(drawn.log_ratio)
            modes = weights_from_importance(mixture, drawn.points, weights)
            known = all(one.effective >= ESS_GOAL for one in modes if one.weight >= HARDLY_ANY)
            if known or done == EVIDENCE_ROUNDS:
                break
            drawn = drawn.joined(more())
        return {
            "modes": np.array([[mode.weight, mode.error] for mode in modes]),
            "pareto_k": np.array(pareto_k),
            "evaluations": np.array(len(drawn.points)),
        }

    found = kept(checkpoint, "evidence", generator, compute)
    modes = tuple(ModeWeight(float(weight), float(error)) for weight, error in found["modes"])
    doubtful = doubts(modes)
    if float(found["pareto_k"]) > PARETO_K_GOAL:
        doubtful = (
            f"The {len(modes)} modes could not be weighted well: the importance weights behind their weights have "
            f"Pareto k {float(found['pareto_k']):.2f}.",
        )
    return _Weighed(modes, doubtful, int(found["evaluations"]))
