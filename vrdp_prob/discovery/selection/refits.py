"""Which causes are tried on a model, in which order, and with what lost or hidden things beside them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.dropped_frames import Dropped, frames_unknown_to
from vrdp_prob.discovery.candidates.scores import CauseScore, happens_once, mends_any_course
from vrdp_prob.discovery.candidates.single_videos import causes_of_lost_videos
from vrdp_prob.discovery.candidates.surfaces import Placed, surfaces_unknown_to
from vrdp_prob.discovery.checks.false_discovery import something_left
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.doubts import HELD_BY_BODIES, causes_with_own_check_failing
from vrdp_prob.discovery.selection.extensions import Extensions, explaining
from vrdp_prob.discovery.selection.gains import OUT_OF_REACH, gain, merit, weights
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.shortlist import CLOSE, SHORTLIST_LEVEL, lasting, shortlist
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.second_look import (
    explained,
    loses_single_videos,
    lost_videos,
    most_astray,
    outweigh,
    trusted,
)
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.progress import Advance

ESTABLISHED = 0.8
"""Probability that a cause must have beside the model without it."""
FIRST_SHARE = 0.2
"""Share of what a model lacks that a cause must bring to be gone on from before all others are tried."""
NEARLY = 0.8
"""Share of what a jump of the clock brings from which a law comes first."""
PLAIN_TURNS = 4
"""Turns from which walls and discs that explain them need no comparison with what else may have been there."""
MOST_SEARCHED = 12
"""Number of videos up to which all are searched anew where checks fail in the end."""
SEARCHES = 3
"""How often the lost videos of a cause are searched anew, as long as that finds something."""


@dataclass(frozen=True)
class Refits:
    """The refits of models with one more cause, each made the first time that it is asked for.

    Parameters
    ----------
    catalogue
        Causes that are looked for.
    seed
        Of the null distributions and of searches.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    advance
        Told of each refit.
    """

    catalogue: tuple[Effect, ...]
    seed: int
    needed: float
    advance: Advance
    _made: dict[Trial, list[Trial]] = field(default_factory=dict)
    _searched: set[Trial] = field(default_factory=set)
    _shown: dict[Trial, list[Effect]] = field(default_factory=dict)
    _explain_worst: dict[tuple[Trial, Trial], bool] = field(default_factory=dict)

    @cached_property
    def leavings(self) -> Leavings:
        """What models leave."""
        return Leavings(self.catalogue, self.seed)

    @cached_property
    def extensions(self) -> Extensions:
        """What makes the refits."""
        return Extensions(self.leavings, self.needed, self.advance)

    @cached_property
    def courses(self) -> Courses:
        """What searches videos anew."""
        return Courses(self.seed)

    def of(self, trial: Trial) -> list[Trial]:
        """Refits of a model, the best first."""
        if trial not in self._made:
            dropped = self._dropped(trial)
            taken = self.extensions.with_dropped_frames(trial, dropped) if dropped else None
            if taken is not None and self.settled(trial, [taken]):
                return self._keep(trial, [taken])
            placed = self._placed(trial)
            met = self.extensions.with_surfaces(trial, placed) if placed else None
            found = [one for one in (taken, met) if one is not None]
            plain = sum(one.seen.turns for one in placed) >= PLAIN_TURNS
            self._shown[trial] = [one.effect for one in placed] if plain else []
            self._keep(trial, [*found, *(self._new(trial) if met is None else self._beside(met, trial, plain=plain))])
        return self._made[trial]

    def made(self, trial: Trial) -> list[Trial]:
        """Refits of a model as far as any were made, the best first."""
        return self._made.get(trial, [])

    def _keep(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Refits of a model, the best first, as which they count from now on."""
        self._made[trial] = sorted(found, key=merit, reverse=True)
        return self._made[trial]

    def _new(self, trial: Trial) -> list[Trial]:
        """Refits in any order; hidden things are tried only where nothing explains the videos better than kicks do.

        Beside a cause that loses no video none is tried for its score where none stands out from what is left to
        chance: beside that is counted, too, what refits bring.
        """
        by_chance = all(one.p_value >= SHORTLIST_LEVEL for one in self.leavings.of(trial).beside_chance)
        if trial.causes and by_chance and not lost_videos(trial.fit.fits):
            return self._with_traced(trial, [])
        found = self._asked_by_most(trial)
        if found and (self.settled(trial, found) or any(not lost_videos(one.fit.fits) for one in found)):
            return found
        known = {one.causes[-1].name for one in found}
        scores = [one for one in self.leavings.of(trial).scores if one.effect.name not in known]
        likely = shortlist(scores)
        close = shortlist(scores, CLOSE)
        found += self.extensions.made_of(trial, close, beside=found)
        found.sort(key=merit, reverse=True)
        if len(close) < len(likely) and not self.settled(trial, found):
            found = self._with_best_searched(trial, found)
        found = self._with_traced(trial, self._with_fainter(trial, found, close, likely))
        kicks = _kicks_among(scores)
        if kicks is not None and (not found or found[0].causes[-1].name == kicks.effect.name):
            found += self._hidden(trial, found, kicks)
        return found

    def _with_fainter(
        self, trial: Trial, found: Sequence[Trial], close: Sequence[CauseScore], likely: Sequence[CauseScore]
    ) -> list[Trial]:
        """Refits, the best first; where they leave something, with the likely causes that are not close ones, too."""
        if self.settled(trial, found):
            return list(found)
        fainter = self.extensions.made_of(trial, [one for one in likely if one not in close], beside=found)
        return sorted([*found, *fainter], key=merit, reverse=True)

    def _beside(self, met: Trial, trial: Trial, *, plain: bool) -> list[Trial]:
        """Refits beside walls and discs that the tracks show: none where these are plain.

        Where they leave nothing, or no video lost that was, no law does what they do, but what else bodies may have met
        there. What laws do beside them is asked of the model that has them.
        """
        if plain and not self.doubted(met, trial, self.leavings.of(met).overdispersion):
            return []
        kicks = _kicks_among(self.leavings.of(trial).scores)
        if kicks is None or not (_finds_lost_videos(met, trial) or self.settled(trial, [met])):
            return self._new(trial)
        kicked = self.extensions.made_of(trial, [kicks])
        return [*kicked, *self._hidden(trial, kicked, kicks)]

    def _with_traced(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Refits, the best first; where none explains enough, with causes, too, for whose own traces a check fails.

        Beside a cause, and where kicks mend what is left, these are causes that residuals hardly show.
        """
        if any(one.brought(trial) >= self.needed for one in explaining(found)):
            return list(found)
        traced = causes_with_own_check_failing(self.leavings.checks(trial)) - {one.causes[-1].name for one in found}
        if trial.causes or any(one.brought(trial) >= self.needed for one in found):
            traced &= HELD_BY_BODIES
        scores = [one for one in self.leavings.of(trial).scores if one.effect.name in traced]
        return sorted([*found, *self.extensions.made_of(trial, scores, beside=found)], key=merit, reverse=True)

    def provisional(self, trial: Trial, found: Sequence[Trial]) -> Trial | None:
        """The cause that brings most where all else is noise, but for kicks: enough, and a good part of what lacks.

        What happens once is found where it seems to have happened for want of a law, and is held there: a law that
        brings nearly as much comes first. Walls and discs that the tracks show plainly are there, however much they
        leave.
        """
        possible = [one for one in explaining(found) if not one.loses_most_of(trial)]
        brings = partial(_brings, trial=trial)
        first = max(possible, key=brings, default=trial)
        laws = (one for one in possible if not happens_once(one.causes[-1]))
        law = max(laws, key=brings, default=first)
        first = law if law.brought(trial) > NEARLY * first.brought(trial) else first
        least = 0.0 if self._is_shown(trial, first) else FIRST_SHARE * trial.lacking
        return None if first.brought(trial) < max(self.needed, least) else first

    def _with_best_searched(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Refits, the best first, with the few lost videos of the one to go on from searched anew.

        A cause may have left videos on courses that they took for want of it; what these leave calls for others.
        """
        first = self.provisional(trial, found)
        lost = [] if first is None else lost_videos(first.fit.fits)
        if first is not None and 0 < len(lost) <= most_astray(len(first.fit.fits)) and explained(first.fit.fits):
            searched = self.courses.searched_anew(first, lost)
            found = [searched if one is first else one for one in found]
        return sorted(found, key=merit, reverse=True)

    def _asked_by_most(self, trial: Trial) -> list[Trial]:
        """Refits with what most videos ask for, the best first, where few others have lost their course by far.

        Where one such video leaves more than all others, it calls for whatever bends its course; given what these ask
        for, its own may be found. None where that is not so. What stands out less beside chance is tried where that
        leaves something: what that video calls for would else come before it.
        """
        fits = trial.fit.fits
        astray = np.flatnonzero(~trusted(fits)).tolist()
        if not 0 < len(astray) <= most_astray(len(fits)) or not outweigh(fits, astray):
            return []
        scores = self.leavings.of(trial).beside_chance
        likely, close = lasting(shortlist(scores)), lasting(shortlist(scores, CLOSE))
        found = self._with_fainter(trial, self.extensions.made_of(trial, close), close, likely)
        searched = [self.courses.searched_anew(one, astray) for one in found[:1]]
        return sorted([*searched, *found[1:]], key=merit, reverse=True)

    def with_lost(self, trial: Trial) -> list[Trial]:
        """The refits, and where these leave something fits from the beginning, which count among them from then on.

        Where nothing was refitted yet, fits from the beginning come first: scores of a fit that has lost videos call
        for many causes, each of which costs more than the search for the one that explains such a video; unless one law
        is called for beside these.
        """
        if trial not in self._made and self.leavings.laws(trial, self.needed):
            self.of(trial)
        refitted, found = trial in self._made, self.made(trial)
        if trial not in self._searched and not self.settled(trial, found):
            self._searched.add(trial)
            found = self._keep(trial, [*found, *self._lost(trial, found)])
            if not refitted and not self.settled(trial, found):
                found = self._keep(trial, [*found, *self._new(trial)])
        return found

    def with_lost_found(self, trial: Trial, one: Trial) -> Trial:
        """One of the refits with its lost videos searched anew, in the place of which it counts from then on.

        What one lost video leaves calls for many causes, of which each costs more to try than the search. Where most
        are lost, the model is fitted from the beginning if that explains them. Where most are explained and something
        is left still that a few videos call for, these are searched, unless it calls for a law loudly, which is tried
        instead.
        """
        found = one if explained(one.fit.fits) else self._from_the_beginning(trial, one)
        for _ in range(SEARCHES):
            kicked = [site.video for score in self.leavings.of(found).scores for site in score.sites if _kicks(score)]
            videos = list(dict.fromkeys([*lost_videos(found.fit.fits), *kicked]))
            before, few = found, len(videos) <= most_astray(len(one.fit.fits))
            found = self.courses.searched_anew(found, videos) if few else found
            if found is before:
                break
        suspects = self.leavings.suspects(found) if explained(found.fit.fits) else []
        if suspects and not self.leavings.laws(found, self.needed):
            other = found.with_other_courses(suspects, seed=self.seed)
            found = found if other.loses_videos_of(found) else other
        if found is not one:
            self._keep(trial, [found if old is one else old for old in self.of(trial)])
        return found

    def searched_where_checks_fail(self, trial: Trial) -> Trial:
        """A model beside which nothing is found, with its videos searched anew if it explains them and checks fail.

        On a wrong course of events a video may be explained as well, where the cause is as strong as that course needs
        it to be; all others are held there, and what shows it are checks of something else. That may be any video.
        """
        fits = trial.fit.fits
        if not trial.causes or len(fits) > MOST_SEARCHED or lost_videos(fits):
            return trial
        if not something_left(self.leavings.checks(trial)):
            return trial
        other = trial.with_other_courses(range(len(fits)), seed=self.seed)
        return trial if other.loses_videos_of(trial) else other

    def _from_the_beginning(self, trial: Trial, one: Trial) -> Trial:
        """One of the refits, fitted from the beginning if its cause explains the worst of its lost videos then.

        A model that has lost most videos has courses in them from which no refit finds the way, and most so where the
        cause that it lacks is strong.
        """
        if trial.choices or not self._explains_worst(trial, one):
            return one
        begun = self.extensions.from_the_beginning(trial, one.beyond(trial))
        return begun if begun is not None and begun.brought(trial) > one.brought(trial) else one

    def leaves_unexplained(self, trial: Trial, one: Trial) -> bool:
        """Whether a refit leaves more than single videos lost, and its cause does not explain the worst of them.

        What scatters positions along the paths, say, takes up some of what wrong courses leave, and explains none.
        Walls and discs that the tracks show plainly are there, however much they leave.
        """
        fits = one.fit.fits
        several = bool(lost_videos(fits)) and not loses_single_videos(fits)
        if not several or trial.choices or self._is_shown(trial, one):
            return False
        return not self._explains_worst(trial, one)

    def _explains_worst(self, trial: Trial, one: Trial) -> bool:
        """Whether the cause of a refit explains the worst of its lost videos, searched by itself, and gains enough.

        It does not where a single video says too little of it.
        """
        key = (trial, one)
        if key not in self._explain_worst:
            cause, worst = one.beyond(trial), lost_videos(one.fit.fits)[:1]
            told = causes_of_lost_videos(
                trial.fit, worst, cause, one.names, self.needed, seed=self.seed, must_explain=True
            )
            self._explain_worst[key] = bool(told)
        return self._explain_worst[key]

    def _is_shown(self, trial: Trial, one: Trial) -> bool:
        """Whether a refit has a wall or a disc that the tracks show plainly."""
        return any(cause in self._shown.get(trial, []) for cause in one.beyond(trial))

    def settled(self, trial: Trial, found: Sequence[Trial]) -> bool:
        """Whether the best cause leaves nothing to explain, and is not a kick in each of several videos."""
        if not found or gain(found[0], trial)[0] < self.needed:
            return False
        return not _mends_several(found[0]) and not self.leavings.something(found[0])

    def _lost(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Fits from the beginning, with causes that explain videos whose course of events nothing else explains.

        Kicks in several videos explain none of them: they mend any course. What acts in all videos, and is missed in
        single ones alone, has to explain them. Where one brings all videos what it promised in single ones, another
        that promised far less is none to begin with.
        """
        if trial.choices:
            return []
        left = self.leavings.further(trial)
        likely = {one.effect.name for one in shortlist(self.leavings.of(trial).scores)}
        reached = {one.causes[-1].name: one.brought(trial) for one in reversed(found)}
        best = next((one.fit.fits for one in found if not _mends_several(one)), trial.fit.fits)
        still_lost = lost_videos(best)
        lost = [one for one in lost_videos(trial.fit.fits) if one in still_lost]
        must = bool(trial.causes) or loses_single_videos(trial.fit.fits)
        told = causes_of_lost_videos(trial.fit, lost, left, likely, self.needed, seed=self.seed, must_explain=must)
        fits: list[Trial] = []
        kept = 0.0
        for causes, promised in told:
            if promised < kept - OUT_OF_REACH * self.needed:
                continue
            brought = reached.get(causes[0].name, 0.0) if len(causes) == 1 else 0.0
            if brought < promised and (begun := self.extensions.from_the_beginning(trial, causes)) is not None:
                fits.append(begun)
                brought = begun.brought(trial)
            kept = max(kept, promised) if brought >= promised else kept
        return fits

    def doubted(self, trial: Trial, lesser: Trial, divisor: Float[np.ndarray, "video"]) -> bool:
        """Whether a cause brings too little, or in too few of the videos that could have been drawn, or may be nothing.

        What a cause brings that may as well vanish, it brings by other numbers, to which it gives room. Of several
        causes one is enough that may not: in the end each is asked beside the others.
        """
        if gain(trial, lesser, divisor)[0] < self.needed or self.is_nothing(trial, lesser, divisor):
            return True
        shares = weights([trial, lesser], [0.0, self.needed], np.random.default_rng(self.seed), overdispersion=divisor)
        return bool(shares[0] < ESTABLISHED)

    @staticmethod
    def is_nothing(trial: Trial, base: Trial, divisor: Float[np.ndarray, "video"]) -> bool:
        """Whether all that a model has beyond another one may as well vanish."""
        further = trial.beyond(base)
        return bool(further) and all(trial.may_vanish(cause, divisor) for cause in further)

    def _placed(self, trial: Trial) -> list[Placed]:
        """Walls and discs that the tracks show, before any cause was found."""
        return [] if trial.causes else surfaces_unknown_to(trial.fit, self.catalogue)

    def _dropped(self, trial: Trial) -> list[Dropped]:
        """Frames that the tracks show to be missing again and again."""
        return frames_unknown_to(trial.fit, self.catalogue)

    def _hidden(self, trial: Trial, found: Sequence[Trial], kicks: CauseScore) -> list[Trial]:
        """Fits with something unseen in the place of kicks."""
        kicked = next((one for one in found if one.causes[-1].name == kicks.effect.name), None)
        kicked = kicked or next(iter(self.extensions.made_of(trial, [kicks])), None)
        return [] if kicked is None else self.extensions.hidden_instead(kicked, kicked.causes[-1], trial)


def _brings(one: Trial, trial: Trial) -> float:
    """Gain of a model over one with less where all else is noise, less what its causes are believed less."""
    return one.brought(trial) + one.log_prior


def _mends_several(trial: Trial) -> bool:
    """Whether the last cause of a model mends any course, and does so in several videos."""
    cause = trial.causes[-1]
    return mends_any_course(cause) and len(trial.acting(cause)) > 1


def _finds_lost_videos(one: Trial, trial: Trial) -> bool:
    """Whether a model has lost videos, and one with more has none."""
    return bool(lost_videos(trial.fit.fits)) and not lost_videos(one.fit.fits)


def _kicks_among(scores: Sequence[CauseScore]) -> CauseScore | None:
    """The score of kicks that have places."""
    return next((one for one in scores if _kicks(one) and one.sites), None)


def _kicks(score: CauseScore) -> bool:
    return isinstance(score.effect, ExternalImpulse)
