"""Forward selection of causes by how well whole videos are predicted that the model was not fitted to."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vrdp_prob.discovery.proposals import hidden_things
from vrdp_prob.discovery.residual_model import ResidualModel
from vrdp_prob.discovery.scores import CauseScore, score_causes
from vrdp_prob.discovery.trials import Trial, gain
from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.population import with_learned_spreads
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.progress import ProgressDisplay, SilentProgress

SHORTLIST_LEVEL = 0.01
"""Causes whose score chance makes as large more often are not refitted."""
HOPEFUL = 0.2
"""Share of the largest statistic below which a cause cannot be the best one, nor a rival of it."""
MOST_REFITTED, MOST_RIVALS = 5, 2
MOST_CAUSES = 5
MOST_SWAPS = 3
FALSE_ALARM = 0.05
"""Prior odds that the model lacks something; all causes of the catalogue share them alike."""


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    scores
        Scores of all causes before the step, the least probable by chance first.
    tried
        Refits with one more cause, the best first.
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
    lesser
        For each cause of `best`: the model without it.
    rivals
        For each cause of `best`: models in which another cause takes its place, as far as any came close.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    """

    base: Trial
    best: Trial
    steps: tuple[Step, ...]
    lesser: tuple[Trial, ...]
    rivals: tuple[tuple[Trial, ...], ...]
    needed: float


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
    needed = float(np.log(len(catalogue) / FALSE_ALARM))
    fit = fit.under(with_learned_spreads(fit), model_error=False)
    with (progress or SilentProgress()).stage("Trying causes", total=None) as advance:
        searcher = _Searcher(tuple(catalogue), seed, needed, advance)
        chain, steps = [Trial((), fit)], [searcher.first(Trial((), fit))]
        while len(chain) <= MOST_CAUSES:
            step = steps[-1] = searcher.tried(chain[-1], steps[-1])
            if not step.tried or gain(step.tried[0], chain[-1])[0] < needed:
                break
            winner = step.tried[0]
            without = winner.without(winner.causes[-1])
            if gain(without, chain[-1])[0] > needed:
                # The refit has found a better course of events, which is no merit of the cause.
                chain[-1], steps[-1] = without, searcher.first(without)
                continue
            chain.append(winner)
            steps.append(searcher.first(winner))
        best, lesser, rivals = searcher.compared(chain, steps)
    return Search(chain[0], best, tuple(steps), lesser, rivals, needed)


@dataclass(frozen=True)
class _Searcher:
    """What is looked for."""

    catalogue: tuple[Effect, ...]
    seed: int
    needed: float
    advance: Callable[[int], None]

    def first(self, trial: Trial) -> Step:
        """A step in which nothing was tried yet."""
        left = [effect for effect in self.catalogue if effect.name not in trial.names]
        return Step(tuple(score_causes(trial.fit, ResidualModel.of(trial.fit), left, seed=self.seed)), ())

    def tried(self, trial: Trial, step: Step) -> Step:
        """The step with the causes tried that may be the best one.

        Hidden things are tried only where nothing else explains that bodies change their velocity all at once.
        """
        found = self._refitted(trial, _shortlist(step.scores))
        kicks = next((one for one in step.scores if isinstance(one.effect, ExternalImpulse) and one.sites), None)
        if kicks is not None and not self._smooth(trial, found):
            found += self._hidden(trial, found, kicks)
        return Step(step.scores, tuple(sorted(found, key=_merit, reverse=True)))

    def _smooth(self, trial: Trial, found: Sequence[Trial]) -> bool:
        """Whether a cause was found that leaves no sudden change of a velocity, and is not itself one."""
        if not found or gain(found[0], trial)[0] < self.needed:
            return False
        return not isinstance(found[0].causes[-1], ExternalImpulse) and not _kicked(self.first(found[0]).scores)

    def _hidden(self, trial: Trial, found: Sequence[Trial], kicks: CauseScore) -> list[Trial]:
        """Fits with something unseen in the place of kicks."""
        kicked = next((one for one in found if one.causes[-1] is kicks.effect), None)
        kicked = kicked or next(iter(self._refitted(trial, [kicks])), None)
        if kicked is None:
            return []
        left = [effect for effect in self.catalogue if effect.name not in trial.names]
        starts = hidden_things(kicked.fit, left, kicks.p_value)

        def refit(score: CauseScore) -> Trial | None:
            return kicked.with_cause_in_place(score, trial.fit.joint.log_density)

        return self._all(refit, starts)

    def compared(
        self, chain: Sequence[Trial], steps: Sequence[Step]
    ) -> tuple[Trial, tuple[Trial, ...], tuple[tuple[Trial, ...], ...]]:
        """The best model, each of its causes left out, and others in the place of each.

        A cause that was found first may fit worse than another once a further one has joined; then they are swapped.
        """
        best = chain[-1]
        for _ in range(MOST_SWAPS):
            last = chain[-2:-1] if best is chain[-1] else [best.without(cause) for cause in best.causes[-1:]]
            lesser = (*(best.without(cause) for cause in best.causes[:-1]), *last)
            rivals = tuple(self.rivals(best, number, steps[number], one) for number, one in enumerate(lesser))
            better = max((one for some in rivals for one in some), key=_merit, default=best)
            if _merit(better) <= _merit(best):
                break
            best = better
        return best, lesser, rivals

    def rivals(self, best: Trial, number: int, step: Step, lesser: Trial) -> tuple[Trial, ...]:
        """Models in which another cause takes the place of one, as far as it came close when that one was found."""
        others = [one for one in step.tried if one.causes[-1].name not in best.names]
        if len(best.causes) == 1:
            return tuple(others)
        most = max(float(one.log_density.sum()) for one in step.tried)
        least = HOPEFUL * (most - float(lesser.log_density.sum()))
        close = {one.causes[-1].name for one in others if gain(one, lesser)[0] > least}
        return tuple(self._refitted(lesser, [one for one in step.scores if one.effect.name in close][:MOST_RIVALS]))

    def _refitted(self, trial: Trial, scores: Sequence[CauseScore]) -> list[Trial]:
        """Fits with one cause more, the best first."""
        return self._all(trial.with_cause, scores)

    def _all(self, refit: Callable[[CauseScore], Trial | None], scores: Sequence[CauseScore]) -> list[Trial]:
        def done(score: CauseScore) -> Trial | None:
            found = refit(score)
            self.advance(1)
            return found

        found = [one for one in in_parallel(done, scores) if one is not None]
        return sorted(found, key=_merit, reverse=True)


def _merit(trial: Trial) -> float:
    """By which models are ordered: what they predict of left-out videos, less what their causes are believed less."""
    return float(trial.log_density.sum()) + trial.log_prior


def _shortlist(scores: Sequence[CauseScore]) -> list[CauseScore]:
    """Causes that may be the best one, or come near it."""
    largest = max((one.size for one in scores), default=0.0)
    hopeful = [one for one in scores if one.p_value < SHORTLIST_LEVEL and one.size > HOPEFUL * largest]
    return sorted(hopeful, key=lambda one: -one.size)[:MOST_REFITTED]


def _kicked(scores: Sequence[CauseScore]) -> bool:
    """Whether some body changes its velocity all at once, by what its residuals say."""
    return any(isinstance(one.effect, ExternalImpulse) and one.sites for one in scores)
