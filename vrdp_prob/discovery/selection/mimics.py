"""Causes that only follow what something outside the catalogue does.

Kicks, patches and jumps of the clock can be put where a law that the catalogue does not hold leaves most, and predict
left-out videos better than nothing does. What such a law does elsewhere remains then, and shows in the checks. So where
something remains, causes are compared with a law of no particular cause (`unlisted_law`), beside them and in the place
of each: of the motion, of the rebound, or of both, by what remains. With many videos that is asked of some.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.scores import happens_once, score_causes
from vrdp_prob.discovery.candidates.unlisted_law import UnlistedMotion, UnlistedRebound
from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.contacts import REBOUND_AT_WALLS
from vrdp_prob.discovery.checks.measurement import GENERAL
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection.gains import gain, weights
from vrdp_prob.discovery.selection.search import FALSE_ALARM, Search
from vrdp_prob.discovery.selection.trials import EACH_PARAMETER, Trial
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.spread import evenly_spread

BELIEVED = 0.5
"""Probability below which a cause is taken to follow something outside the catalogue."""
MOST = 12
"""Videos in which laws of no particular cause are looked for, which have a score of numbers that each video follows."""
REBOUNDS = {REBOUND, REBOUND_AT_WALLS}
"""Checks of what the law of rebounds is about."""
UNLISTED = float(np.log(FALSE_ALARM))
"""Log prior odds of such a thing."""


@dataclass(frozen=True)
class Unlisted:
    """What a law of no particular cause explains of some videos.

    Parameters
    ----------
    laws
        The parts of it of which the videos say something.
    mimics
        Names of the causes that it explains away, in the order in which they were found.
    gain, error
        Gain (nats) in the predictive density of left-out videos over what the causes of the catalogue explain, and its
        standard error.
    asked
        Number of the videos in which it was looked for, if these are not all: what is gained in all is in proportion.
    """

    laws: tuple[Effect, ...]
    mimics: tuple[str, ...]
    gain: float
    error: float
    asked: int | None = None


def laws_of(left: Sequence[Check]) -> tuple[Effect, ...]:
    """Laws of no particular cause for what checks say is left."""
    failing = {check.name for check in left if check.significant}
    telling = failing - set(GENERAL) or failing
    motion = (UnlistedMotion(),) if telling - REBOUNDS else ()
    return (*motion, UnlistedRebound()) if telling & REBOUNDS else motion


def without_mimics(
    found: Search, laws: Sequence[Effect], *, seed: int, progress: ProgressDisplay | None = None
) -> tuple[Search, Unlisted | None]:
    """A search without the causes that a law of no particular cause explains away, and what that law explains.

    Parameters
    ----------
    found
        A search whose best model leaves something.
    laws
        What it is asked whether they explain it, at least one.
    seed
        Seed of all randomness.
    progress
        Told how far the work is.

    Returns
    -------
    The search with the best model of the other causes, and None where that law explains hardly more than the causes.
    """
    with_laws = partial(_with_laws, laws=tuple(laws), seed=seed)
    with (progress or SilentProgress()).stage("Looking outside the catalogue", total=None) as advance:
        models = _Models.of(found)
        beside = with_laws(models.best)
        advance(1)
        if beside is None or models.merit(beside) < found.needed:
            return found, None
        alone = with_laws(models.base)
        advance(1)
        if alone is not None and models.merit(alone) > 0:
            return found.without(found.best.causes), models.explained(alone, laws, found.best.causes)
        others = [lesser for lesser in models.lesser if lesser is not models.base]
        refitted = in_processes(with_laws, others, advance=advance)
    instead = {models.base: alone, **dict(zip(others, refitted, strict=True))}
    mimics = [
        cause
        for cause, lesser in zip(found.best.causes, models.lesser, strict=True)
        if models.believed(beside, lesser, instead[lesser], found.needed, seed) < BELIEVED
    ]
    return found.without(mimics), models.explained(beside, laws, mimics)


@dataclass(frozen=True)
class _Models:
    """The models that a search has found, fitted to the videos in which laws are put beside them.

    Parameters
    ----------
    found
        The search.
    chosen
        Numbers of the videos; all where None.
    """

    found: Search
    chosen: Sequence[int] | None

    @classmethod
    def of(cls, found: Search) -> "_Models":
        """Those of a search; in some of the videos where these are many, unless what happens once in one is asked."""
        videos = len(found.base.fit.fits)
        all_asked = videos <= MOST or any(happens_once(cause) for cause in found.best.causes)
        return cls(found, None if all_asked else evenly_spread(MOST, videos).tolist())

    @property
    def asked(self) -> int | None:
        """Number of the videos, if these are not all."""
        return None if self.chosen is None else len(self.chosen)

    @cached_property
    def best(self) -> Trial:
        """That with all causes."""
        return self._fitted([self.found.best])[0]

    @property
    def base(self) -> Trial:
        """That with none."""
        return self._others[self.found.base]

    @property
    def lesser(self) -> tuple[Trial, ...]:
        """For each cause: the one without it."""
        return tuple(self._others[one] for one in self.found.lesser)

    @cached_property
    def overdispersion(self) -> Float[np.ndarray, "video"]:
        """Factor of each video by which gains are divided: so much less where a video stands for several."""
        of_all = self.found.overdispersion
        return of_all if self.chosen is None else of_all[list(self.chosen)] * len(self.chosen) / len(of_all)

    @cached_property
    def _others(self) -> dict[Trial, Trial]:
        """By those that the search has fitted: these without some cause, of which most searches ask none."""
        models = list(dict.fromkeys([self.found.base, *self.found.lesser]))
        return dict(zip(models, self._fitted(models), strict=True))

    def _fitted(self, models: Sequence[Trial]) -> Sequence[Trial]:
        return models if self.chosen is None else in_processes(partial(Trial.of_some, chosen=self.chosen), models)

    def merit(self, trial: Trial) -> float:
        """By how much (nats) a model with laws is more probable than the best one without."""
        return self._gain(trial)[0] + trial.log_prior - self.best.log_prior + UNLISTED

    def explained(self, trial: Trial, laws: Sequence[Effect], mimics: Sequence[Effect]) -> Unlisted:
        """What the laws of a model explain, and which causes they explain away."""
        names = tuple(cause.cause_name() for cause in mimics)
        return Unlisted(tuple(law for law in laws if law.name in trial.names), names, *self._gain(trial), self.asked)

    def believed(self, beside: Trial, lesser: Trial, instead: Trial | None, needed: float, seed: int) -> float:
        """Probability of a cause, with the laws beside it or not, against models without it.

        Parameters
        ----------
        beside
            The best model with the laws.
        lesser, instead
            The model without the cause, and that with the laws in its place, if any can begin.
        needed
            Gain (nats) that a cause must bring.
        seed
            Of the draws of videos.
        """
        compared = [(self.best, 0.0), (beside, UNLISTED), (lesser, needed)]
        if instead is not None:
            compared.append((instead, needed + UNLISTED))
        trials = [trial for trial, _ in compared]
        log_prior = [trial.log_prior + odds for trial, odds in compared]
        shares = weights(trials, log_prior, np.random.default_rng(seed), overdispersion=self.overdispersion)
        return float(shares[:2].sum())

    def _gain(self, trial: Trial) -> tuple[float, float]:
        return gain(trial, self.best, self.overdispersion)


def _with_laws(trial: Trial, laws: Sequence[Effect], seed: int) -> Trial | None:
    """A model with laws beside its causes; None where no law promises to bring what it costs, or none can begin."""
    found = trial
    for law in laws:
        scores = score_causes(found.fit, found.unexplained.plain, [law], seed=seed)
        promising = [one for one in scores if one.size / 2 > EACH_PARAMETER * len(law.parameters) - UNLISTED]
        found = (found.with_cause(promising[0]) if promising else None) or found
    return None if found is trial else found.continued()
