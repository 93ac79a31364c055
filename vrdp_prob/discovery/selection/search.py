"""The search for causes: found one after the other, then each put beside what could take its place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.comparison import Comparison
from vrdp_prob.discovery.selection.forward import ForwardSelection
from vrdp_prob.discovery.selection.gains import OUT_OF_REACH, gain, merit
from vrdp_prob.discovery.selection.leavings import Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.trials import Trial, with_own_population
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.progress import ProgressDisplay, SilentProgress

FALSE_ALARM = 0.05
"""Prior odds that the model lacks something; all causes of the catalogue share them alike."""


@dataclass(frozen=True)
class Search:
    """How a search went.

    Parameters
    ----------
    base
        The model that was given, with the best courses of events that were found, whatever was tried beside it.
    best
        The model with every cause that was found.
    lesser
        For each cause of `best`: the model without it.
    rivals
        For each cause of `best`: models in which another cause takes its place, as far as any came close.
    refits
        What every model leaves, and the refits of it.
    limit
        The limit that ended the search, in a sentence; empty where it ended since nothing more was found.
    """

    base: Trial
    best: Trial
    lesser: tuple[Trial, ...]
    rivals: tuple[tuple[Trial, ...], ...]
    refits: Refits
    limit: str = ""

    @property
    def needed(self) -> float:
        """Gain (nats) in the predictive density that a cause must bring."""
        return self.refits.needed

    @property
    def left(self) -> Left:
        """What the best model leaves."""
        return self.refits.leavings.of(self.best)

    @property
    def overdispersion(self) -> Float[np.ndarray, "video"]:
        """Factor of each video by which gains are divided."""
        return self.left.overdispersion

    def asking(self, catalogue: Sequence[Effect]) -> "Search":
        """The search with what the best model leaves asked for the traces of other causes; none of them is tried."""
        return replace(self, refits=replace(self.refits, catalogue=tuple(catalogue)))

    @property
    def near(self) -> tuple[tuple[Trial, ...], ...]:
        """For each cause of the best model: rivals that may be as probable as that."""
        divisor, least = self.overdispersion, OUT_OF_REACH * self.needed
        return tuple(tuple(one for one in some if gain(self.best, one, divisor)[0] < least) for some in self.rivals)

    def without(self, causes: Sequence[Effect]) -> "Search":
        """The search with a best model that lacks some of its causes, and those that bring too little without these."""
        if not causes:
            return self
        if len(causes) == len(self.best.causes):
            return self._with_best(self.base)
        return self._with_best(self.best.without(*causes).continued())

    def with_rival(self, cause: Effect, believable: Callable[[Trial], bool]) -> "Search | None":
        """The search with another cause in the place of one of the best model; None where none explains as much.

        Parameters
        ----------
        cause
            The cause whose place is taken.
        believable
            Whether a model with a rival in it is one to go on with.
        """
        number = self.best.causes.index(cause)
        for rival in sorted(self.rivals[number], key=merit, reverse=True):
            if gain(self.best, rival, self.overdispersion)[0] < self.needed and believable(rival):
                found = self._with_best(rival.continued())
                if rival.causes[-1] in found.best.causes:
                    return found
        return None

    def _with_best(self, best: Trial) -> "Search":
        """The search with another best model, as far as its causes are established."""
        best, lesser = LesserModels(self.refits).established(best)
        return replace(self, best=best if best.causes else self.base, lesser=lesser, rivals=tuple(() for _ in lesser))


def gain_needed(causes: int) -> float:
    """Gain (nats) in the predictive density that a cause must bring where so many are looked for."""
    return float(np.log(max(causes, 1) / FALSE_ALARM))


def search(
    fit: SharedFit,
    catalogue: Sequence[Effect],
    needed: float,
    *,
    seed: int,
    progress: ProgressDisplay | None = None,
    beginning: Beginning | None = None,
) -> Search:
    """Look for causes that a model lacks, one after the other.

    Parameters
    ----------
    fit
        Fit of the model to all videos.
    catalogue
        Causes that are looked for.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    seed
        Of the null distributions.
    progress
        Told how far the work is.
    beginning
        What the search goes on from; from the model alone where None, or where these causes bring too little.
    """
    with (progress or SilentProgress()).stage("Trying causes", total=None) as advance:
        refits = Refits(tuple(catalogue), seed, needed, advance)
        selection = ForwardSelection(refits, beginning)
        base = Trial((), with_own_population(fit), stated=fit.model.beliefs).continued()
        chain, steps, limit = selection.models(base)
        best = LesserModels(refits).unpatched(chain[-1])
        if best is not chain[-1]:
            chain.append(best)
            steps.append(selection.untried(best))
        best, lesser, rivals = Comparison(refits, beginning).compared(chain, steps)
        if not best.causes:  # what was tried, and what is told, is of the model that was given
            best = chain[0]
    return Search(chain[0], best, lesser, rivals, refits, limit)
