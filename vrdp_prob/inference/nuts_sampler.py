"""Sampling with Pyro's NUTS on the log posterior, whitened: several chains in every mode, weighted by its evidence.

A chain that follows gradients hardly ever finds its way from one mode to another. So each mode has chains of its own,
and importance sampling says what it weighs. Chains come in groups whose gradients are computed in one batch.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.checkpoint import Checkpoint, kept
from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.diagnostics import Reported, drift, joined, settled
from vrdp_prob.inference.importance import Weighted, smoothed_weights
from vrdp_prob.inference.mixture import Jumps, Mixture
from vrdp_prob.inference.mode_weights import doubts, weights_from_chains, weights_from_importance
from vrdp_prob.inference.nuts_chain import Piece, Task
from vrdp_prob.inference.nuts_worker import Workers, workers
from vrdp_prob.inference.rate_steps import RateSteps
from vrdp_prob.inference.samples import (
    ESS_GOAL,
    PARETO_K_GOAL,
    R_HAT_GOAL,
    LogDensity,
    ModeWeight,
    Samples,
    evaluate,
)
from vrdp_prob.inference.shaping import Shaped, shaped, starting_places
from vrdp_prob.models.simulator.work import metered
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

GROUPS = 2
"""Groups of chains per mode, one process each..."""
TOGETHER = 8
"""...and chains per group, whose gradients are computed together."""
CHAINS = GROUPS * TOGETHER
RESULTS = 4
"""Chains that are handed back, each of several that are joined."""
WARM_UP = 30
"""Transitions that only adapt the step size: the mass matrix is the whitening, which other draws have shaped."""
CHUNK = 25
"""Transitions per chain after which the draws are judged and kept on disk."""
MOST_GRADIENTS = 150_000
"""Gradients of all chains after which sampling stops; a minute on two cores of 2020."""
WORK_LIMIT = 40_000_000
"""Simulated work after which sampling stops, for worlds of which one gradient costs as much as a hundred of others."""
MARGIN = 1.1
"""Effective draws beyond the goal at which it stops."""
EVIDENCE_DRAWS = 4000
FEWEST_IN_MODE = 4
"""Draws of every chain that must be in a mode for it to count among the modes."""
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

    Returns
    -------
    Four chains, each of several one after another, from all modes in proportion to the modes' weights, with the number
    of divergences. The R-hat that goes with them compares earlier with later draws.
    """
    with metered() as meter:
        form, places = _kept_start(density, start, generator, checkpoint)
        if jumps is not None:
            places = jumps.starts(CHAINS, generator)[None]
        modes, doubtful = ((), ()) if jumps else _kept_weights(density, form.mixture, generator, checkpoint)
    seed = int(generator.integers(2**31))
    inhabited = [index for index in range(len(places)) if len(places) == 1 or modes[index].weight >= HARDLY_ANY]
    far = None if jumps is None else jumps.mixture
    groups = [
        _Group(
            form.mixture.components[mode],
            mode,
            number,
            places[mode, number * TOGETHER :][:TOGETHER],
            seed,
            far,
            rate_steps,
        )
        for mode in inhabited
        for number in range(GROUPS)
    ]
    count = min(os.cpu_count() or 1, MOST_PROCESSES) if processes is None else processes
    stage = (progress or SilentProgress()).stage("Sampling (NUTS), at most", total=most_gradients)
    with stage as advance, workers(count) as pool:
        run = _Run(density, form.mixture, groups, checkpoint, pool, advance)
        run.further(warm_up, adapt=True)
        while True:
            run.further(CHUNK, adapt=False)
            points = _in_proportion(run, inhabited, modes, np.random.default_rng(seed))
            chains = points.reshape(RESULTS, -1, *points.shape[1:])
            if points[..., 0].size >= draws and settled(
                chains, reported, r_hat=R_HAT_GOAL, effective=MARGIN * ESS_GOAL
            ):
                stopped: tuple[str, ...] = ()
                break
            if run.gradients >= most_gradients:
                stopped = (f"It stopped at its budget of {most_gradients} gradients.",)
                break
            if run.work >= work_limit:
                stopped = (
                    f"It stopped at its budget of simulated work ({work_limit:.3g} pieces of motion and events).",
                )
                break
    evaluations = form.evaluations + (EVIDENCE_DRAWS if len(places) > 1 else 0)
    if jumps is not None:
        modes = weights_from_chains(form.mixture, joined(chains))
        doubtful = doubts(modes)
    return Samples(
        joined(chains),
        np.stack([evaluate(density, chain) for chain in joined(chains)]),
        r_hat=drift(chains, reported),
        divergences=run.divergences,
        evaluations=evaluations + run.gradients,
        gradients=form.gradients + run.gradients,
        work=meter.rows + run.work,
        modes=modes,
        notes=(*stopped, *doubtful),
    )


@dataclass
class _Group:
    """Chains in one mode, in the coordinates of its cloud."""

    cloud: CurvedGaussian
    mode: int
    number: int
    places: Float[np.ndarray, "chain dimension"]
    seed: int
    jumps: Mixture | None = None
    rate_steps: RateSteps | None = None
    pieces: list[Piece] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the piece that comes next."""
        return f"mode_{self.mode}_group_{self.number}_piece_{len(self.pieces)}"

    def task(self, density: LogDensity, transitions: int, *, adapt: bool) -> Task:
        """The piece that comes next; a step length is shared, since a chain alone finds it in few transitions badly."""
        places = self.pieces[-1].whitened[:, -1] if self.pieces else self.cloud.whitened(self.places)
        own = np.random.SeedSequence([self.seed, self.mode, self.number, len(self.pieces)])
        seeds = tuple(int(one) for one in own.generate_state(len(places)))
        sizes = None if adapt else np.full(len(places), np.median(self.pieces[-1].step_sizes))
        return Task(density, self.cloud, places, sizes, transitions, seeds, self.jumps, self.rate_steps)

    @property
    def points(self) -> Float[np.ndarray, "chain draw dimension"]:
        """All draws after adaptation."""
        return self.cloud.points(np.concatenate([piece.whitened for piece in self.pieces[1:]], axis=1))


@dataclass
class _Run:
    """All groups of chains, and what they have cost."""

    density: LogDensity
    mixture: Mixture
    groups: list[_Group]
    checkpoint: Checkpoint | None
    pool: Workers
    advance: Advance

    def further(self, transitions: int, *, adapt: bool) -> None:
        """One more piece of every group: those that were kept, and the others made now, a few at a time."""
        wanting = []
        for group in self.groups:
            found = self.checkpoint.arrays(group.name) if self.checkpoint is not None else None
            if found is None:
                wanting.append(group)
            else:
                group.pieces.append(Piece.of_arrays(found))
        for begin in range(0, len(wanting), GROUPS):
            several = wanting[begin : begin + GROUPS]
            made = self.pool.make([group.task(self.density, transitions, adapt=adapt) for group in several])
            for group, piece in zip(several, made, strict=True):
                if self.checkpoint is not None:
                    self.checkpoint.keep(group.name, piece.arrays())
                group.pieces.append(piece)
                self.advance(piece.gradients)

    def points(self, mode: int) -> Float[np.ndarray, "chain draw dimension"]:
        """All draws of the chains of a mode."""
        return np.concatenate([group.points for group in self.groups if group.mode == mode])

    @property
    def gradients(self) -> int:
        """Gradients of all chains."""
        return sum(piece.gradients for group in self.groups for piece in group.pieces)

    @property
    def work(self) -> int:
        """Work of all chains."""
        return sum(piece.work for group in self.groups for piece in group.pieces)

    @property
    def divergences(self) -> int:
        """Divergent transitions of all chains."""
        return sum(piece.divergences for group in self.groups for piece in group.pieces)


def _in_proportion(
    run: _Run, inhabited: list[int], modes: tuple[ModeWeight, ...], generator: np.random.Generator
) -> Float[np.ndarray, "chain draw dimension"]:
    """As many chains as a mode has, each of one chain from every mode, in proportion to the modes' weights.

    A draw counts for the mode that it is in, whichever its chain set out from: chains are restricted, not trusted to
    stay. A mode in which hardly any chain stays is left to what the others find of it.
    """
    chains = [run.points(mode) for mode in inhabited]
    if len(inhabited) == 1:
        return chains[0]
    own: list[list[np.ndarray]] = []
    for number in range(CHAINS):
        points = np.concatenate([several[number] for several in chains])
        member = run.mixture.memberships(points).argmax(axis=1)
        own.append([points[member == mode] for mode in inhabited])
    counts = np.array([[len(points) for points in several] for several in own]).min(axis=0)
    shares = np.where(counts >= FEWEST_IN_MODE, [modes[mode].weight for mode in inhabited], 0.0)
    if not shares.any():
        return np.stack([np.concatenate(several)[: counts.sum()] for several in own])
    wanted = np.floor(shares * (counts[shares > 0] / shares[shares > 0]).min()).astype(int)
    joined = []
    for several in own:
        labels = generator.permutation(np.repeat(np.arange(len(inhabited)), wanted))
        chain = np.empty((len(labels), run.mixture.dimension))
        for index, count in enumerate(wanted):
            points = several[index]
            chain[labels == index] = points[np.linspace(0, len(points) - 1, count).round().astype(int)]
        joined.append(chain)
    return np.stack(joined)


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


def _kept_weights(
    density: LogDensity, mixture: Mixture, generator: np.random.Generator, checkpoint: Checkpoint | None
) -> tuple[tuple[ModeWeight, ...], tuple[str, ...]]:
    """What the modes weigh, and a sentence if that is not known well enough."""
    if len(mixture.components) == 1:
        return (), ()

    def compute() -> Mapping[str, np.ndarray]:
        drawn = Weighted.drawn(density, mixture, EVIDENCE_DRAWS, generator, lambda _worlds: None)
        weights, pareto_k = smoothed_weights(drawn.log_ratio)
        modes = weights_from_importance(mixture, drawn.points, weights)
        return {"modes": np.array([[mode.weight, mode.error] for mode in modes]), "pareto_k": np.array(pareto_k)}

    found = kept(checkpoint, "evidence", generator, compute)
    modes = tuple(ModeWeight(float(weight), float(error)) for weight, error in found["modes"])
    if float(found["pareto_k"]) <= PARETO_K_GOAL:
        return modes, doubts(modes)
    return modes, (
        f"The {len(modes)} modes could not be weighted well: the importance weights behind their weights have Pareto k "
        f"{float(found['pareto_k']):.2f}.",
    )
