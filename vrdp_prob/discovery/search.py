"""Forward selection of causes by how well whole videos are predicted that the model was not fitted to."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vrdp_prob.discovery.linear import LinearFit
from vrdp_prob.discovery.proposals import proposals
from vrdp_prob.discovery.scores import CauseScore, score_causes
from vrdp_prob.discovery.trials import Trial, gain
from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.progress import ProgressDisplay, SilentProgress

SHORTLIST_LEVEL = 0.01
"""Causes whose score chance makes as large more often are not refitted..."""
MOST_REFITTED = 6
"""...nor more of them than this in one step."""
MOST_CAUSES = 5
FALSE_ALARM = 0.05
"""Prior probability that the model lacks anything that is not there, shared by all causes."""


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    scores
        Scores of all causes before the step.
    tried
        Refits, the best first.
    """

    scores: tuple[CauseScore, ...]
    tried: tuple[Trial, ...]


@dataclass(frozen=True)
class Search:
    """How a search went.

    Parameters
    ----------
    base
        The model that was given.
    best
        The model with every cause that was found.
    steps
        The steps, the last of which added nothing.
    rivals
        For each cause of `best` by name: models of the same size in which another cause takes its place.
    lesser
        For each cause of `best` by name: the model without it.
    """

    base: Trial
    best: Trial
    steps: tuple[Step, ...]
    rivals: dict[str, list[Trial]] = field(default_factory=dict)
    lesser: dict[str, Trial] = field(default_factory=dict)


def search(
    fit: SharedFit, catalogue: Sequence[Effect], *, seed: int, progress: ProgressDisplay | None = None
) -> Search:
    """Look for causes that a model lacks, one after the other.

    Parameters
    ----------
    fit
        Fit of the model to all videos.
    catalogue
        Causes that are looked for.
    seed
        Of the null distributions.
    progress
        Told how far the work is.
    """
    base = best = Trial((), fit)
    needed = float(np.log(len(catalogue) / FALSE_ALARM))
    steps: list[Step] = []
    while len(best.causes) < MOST_CAUSES:
        left = [effect for effect in catalogue if effect.name not in best.names]
        step = _step(best, left, seed, progress, len(steps))
        steps.append(step)
        if not step.tried or gain(step.tried[0], best)[0] < needed:
            break
        best = step.tried[0]
    lesser = {one.name: best.without(one) for one in best.causes} if len(best.causes) > 1 else {}
    lesser |= {one.name: base for one in best.causes[:1] if len(best.causes) == 1}
    return Search(base, best, tuple(steps), _rivals(best, steps, lesser), lesser)


def _step(best: Trial, catalogue: Sequence[Effect], seed: int, progress: ProgressDisplay | None, number: int) -> Step:
    linear = LinearFit.of(best.fit)
    scores = score_causes(best.fit, linear, catalogue, seed=seed)
    shortlist = [one for one in scores if one.p_value < SHORTLIST_LEVEL][:MOST_REFITTED]
    if shortlist:
        shortlist += proposals(best.fit, scores, catalogue)
    label = "Trying causes" if number == 0 else f"Trying further causes ({number + 1})"
    with (progress or SilentProgress()).stage(label, total=len(shortlist)) as advance:

        def tried(score: CauseScore) -> Trial | None:
            found = best.with_cause(score)
            advance(1)
            return found

        trials = [one for one in in_parallel(tried, shortlist) if one is not None]
    return Step(tuple(scores), tuple(sorted(trials, key=lambda one: -float(one.log_density.sum()))))


def _rivals(best: Trial, steps: Sequence[Step], lesser: dict[str, Trial]) -> dict[str, list[Trial]]:
    """Models in which another cause takes the place of one."""
    if len(best.causes) == 1:
        return {best.causes[0].name: [one for one in steps[0].tried if one is not best]}
    return {}
