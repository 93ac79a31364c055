"""What models leave, and which further causes may be behind it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.scores import CauseScore, happens_once, score_causes
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.overdispersion import overdispersion
from vrdp_prob.discovery.selection.shortlist import SHORTLIST_LEVEL
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.second_look import most_astray, trusted
from vrdp_prob.models.effects.effect import Effect

LOUD = 20.0
"""Gain beside chance, in those that are needed, from which a law is tried before videos are searched anew; few videos
on wrong courses promise as much."""


@dataclass(frozen=True)
class Left:
    """What a model leaves, by the causes that may be behind it.

    Parameters
    ----------
    scores
        Scores of all further causes, the least probable by chance first, where all that is left is noise.
    beside_chance
        The same beside what the model leaves to chance.
    overdispersion
        Of each video, by what the model leaves unexplained.
    """

    scores: tuple[CauseScore, ...]
    beside_chance: tuple[CauseScore, ...]
    overdispersion: Float[np.ndarray, "video"]


@dataclass(frozen=True)
class Leavings:
    """What each model leaves, worked out the first time that it is asked for.

    Parameters
    ----------
    catalogue
        Causes that are looked for.
    seed
        Of the null distributions.
    """

    catalogue: tuple[Effect, ...]
    seed: int
    _left: dict[Trial, Left] = field(default_factory=dict)
    _checks: dict[Trial, tuple[Check, ...]] = field(default_factory=dict)
    _checks_of_trusted: dict[Trial, tuple[Check, ...]] = field(default_factory=dict)
    _ended: dict[Trial, Trial] = field(default_factory=dict)

    def of(self, trial: Trial) -> Left:
        """What a model leaves."""
        if trial not in self._left:
            further = self.further(trial)
            found = trial.unexplained
            scores = beside = score_causes(trial.fit, found.plain, further, seed=self.seed)
            independent = found.independent()
            if found.accelerated:
                beside = score_causes(trial.fit, independent, further, seed=self.seed)
            self._left[trial] = Left(tuple(scores), tuple(beside), overdispersion(independent, seed=self.seed))
        return self._left[trial]

    def further(self, trial: Trial) -> list[Effect]:
        """Causes that may be added to a model: those that it lacks, a second thing of a kind only beside the first."""
        there = {effect.name for effect in trial.fit.model.effects}
        return [one for one in self.catalogue if one.name not in there and one.follows in {None, *there}]

    def checks(self, trial: Trial) -> tuple[Check, ...]:
        """Checks of what a model leaves."""
        if trial not in self._checks:
            self._checks[trial] = run_checks(trial.fit, seed=self.seed)
        return self._checks[trial]

    def checks_of_trusted(self, trial: Trial) -> tuple[Check, ...]:
        """Checks of what a model leaves in the videos whose fits are not far worse than those of the others.

        What a video that has lost its course of events leaves at contacts is no law.
        """
        reliable = np.flatnonzero(trusted(trial.fit.fits))
        if len(reliable) == len(trial.fit.fits):
            return self.checks(trial)
        if trial not in self._checks_of_trusted:
            self._checks_of_trusted[trial] = run_checks(trial.fit.part(reliable.tolist()), seed=self.seed)
        return self._checks_of_trusted[trial]

    def own(self, trial: Trial, cause: Effect) -> tuple[Check, ...]:
        """Checks of what a model leaves of what a cause does.

        Where one that happens once has happened again, the fit is far worse than those of other videos.
        """
        return self.checks(trial) if happens_once(cause) else self.checks_of_trusted(trial)

    def at_the_end(self, trial: Trial) -> Trial:
        """A model whose fit was not followed to its end, since it is worse in any case, at its end."""
        if trial not in self._ended:
            self._ended[trial] = trial.continued()
        return self._ended[trial]

    def something(self, trial: Trial) -> bool:
        """Whether a model leaves what chance explains less well than some cause may."""
        return any(True for _ in self._calling(trial))

    def called_for(self, trial: Trial) -> list[Effect]:
        """Causes that may explain better than chance what a model leaves, the least probable by chance first."""
        return [one.effect for one in self._calling(trial)]

    def suspects(self, trial: Trial) -> list[int]:
        """Videos that may have taken a wrong course of events: few, in which alone some cause is called for."""
        most = most_astray(len(trial.fit.videos))
        few = [some for _, some in self._called_for_in(trial) if len(some) <= most]
        return list(dict.fromkeys(video for some in few for video in some))

    def most_call_for_a_law(self, trial: Trial, needed: float) -> bool:
        """Whether a law is called for in most videos, and loudly (see `laws`): no wrong course of single ones does."""
        most = most_astray(len(trial.fit.videos))
        called = {effect for effect, some in self._called_for_in(trial) if len(some) > most}
        return any(law in called for law in self.laws(trial, needed))

    def laws(self, trial: Trial, needed: float) -> list[Effect]:
        """Laws that what a model leaves beside chance calls for louder than a few wrong courses do.

        Parameters
        ----------
        trial
            The model.
        needed
            Gain (nats) in the predictive density that a cause must bring.
        """
        left = self.of(trial).beside_chance
        return [one.effect for one in left if one.size > 2 * LOUD * needed and not happens_once(one.effect)]

    def _called_for_in(self, trial: Trial) -> Iterator[tuple[Effect, list[int]]]:
        """Causes that are called for, and the fewest videos without which they are not."""
        level = SHORTLIST_LEVEL / max(len(self.of(trial).beside_chance), 1)
        return ((one.effect, one.few_videos(level)) for one in self._calling(trial))

    def _calling(self, trial: Trial) -> Iterator[CauseScore]:
        """Scores that chance makes as large too rarely, where it had as many causes to do so."""
        left = self.of(trial).beside_chance
        return (one for one in left if one.p_value * len(left) <= SHORTLIST_LEVEL)
