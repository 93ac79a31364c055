"""The stages of a discovery: fits, the search for causes, courses that were missed, and some videos before all."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass

from vrdp_prob.discovery.candidates.dropped_frames import frames_unknown_to
from vrdp_prob.discovery.candidates.scores import happens_once
from vrdp_prob.discovery.candidates.surfaces import surfaces_unknown_to
from vrdp_prob.discovery.finding import Verdict
from vrdp_prob.discovery.outcome import Outcome, outcome_of
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.believed import extended_model
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.search import Search, gain_needed, search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.discovery.selection.tried import tried_causes
from vrdp_prob.discovery.words import title
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.second_look import explained, loses_single_videos, most_astray
from vrdp_prob.inference.several_videos.spin_islands import with_other_spins
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.plain_words import listed
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks
from vrdp_prob.spread import evenly_spread


@dataclass(frozen=True)
class Asked:
    """What is asked of all videos, where causes were looked for in some of them.

    Parameters
    ----------
    causes
        Effects that were found there, or could be seen in all.
    searched, videos
        Numbers of the videos in which all causes were looked for, and of all.
    beginning
        What the search in all goes on from; None where nothing was found that acts in all.
    """

    causes: tuple[Effect, ...]
    searched: int
    videos: int
    beginning: Beginning | None

    def sentences(self, found: Search) -> list[str]:
        """What was asked where, and what the best model leaves that calls for something else.

        Parameters
        ----------
        found
            The search in all videos, asking the whole catalogue.
        """
        asked, known = "none of them shows there, so that none was asked of all", _cause_names(self.causes)
        if known:
            asked = f"only {_names(self.causes)} {'was' if len(known) == 1 else 'were'} asked of all"
        sentences = [f"Causes were looked for in {self.searched} of the {self.videos} videos; {asked}."]
        calling = found.refits.leavings.called_for(found.best)
        if further := [effect for effect in calling if effect.cause_name() not in known]:
            sentences.append(
                f"What is left in all videos may be {_names(further)}, for which the searched ones did not call: look "
                "for causes in more videos."
            )
        return sentences


@dataclass(frozen=True)
class Stages:
    """What is done with some videos, from their fit to what is believed of it.

    Parameters
    ----------
    model
        The physics that is put to the test.
    catalogue
        Causes that are looked for.
    seed
        Of all randomness.
    progress
        Told how far the work is.
    """

    model: PhysicsModel
    catalogue: tuple[Effect, ...]
    seed: int
    progress: ProgressDisplay | None

    def asked_of_all(self, videos: Sequence[Tracks], searched: int) -> Asked:
        """What is asked of all videos after causes were looked for in some, which are spread evenly over them.

        These are the causes that were found or come near to one of these, and others that would bring enough in all
        videos if they brought as much in each. Whether they are to be doubted is asked of all videos.
        """
        some = [videos[index] for index in evenly_spread(searched, len(videos))]
        fit = self._fit(some, self.catalogue)
        found = self._search(fit, self.catalogue)
        if not found.best.causes:
            better = self._with_better_courses(fit, self._believed(found))
            found = found if better is fit else self._search(better, self.catalogue)
        near = {one.causes[-1].cause_name() for rivals in found.near for one in rivals}
        further = {
            one.name
            for one in tried_causes(found, (), seed=self.seed)
            if one.gain * len(videos) / len(some) >= one.gain_needed
        }
        asked = found.best.cause_names | near | further
        causes = tuple(effect for effect in self.catalogue if effect.cause_name() in asked)
        return Asked(causes, searched, len(videos), _beginning(found))

    def outcome(self, videos: Sequence[Tracks], asked: Asked | None = None) -> Outcome:
        """What is found in videos, and what is believed of it.

        Parameters
        ----------
        videos
            The videos.
        asked
            What is asked of them; the whole catalogue where None.
        """
        causes, beginning = (self.catalogue, None) if asked is None else (asked.causes, asked.beginning)
        fit = self._fit(videos, causes)
        outcome = self._believed(self._search(fit, causes, beginning))
        better = self._with_better_courses(fit, outcome)
        return outcome if better is fit else self._believed(self._search(better, causes, beginning))

    def _fit(self, videos: Sequence[Tracks], causes: Sequence[Effect]) -> SharedFit:
        """The fit of the model; single lost videos are searched anew, unless it lacks something."""
        fit = fit_together(videos, model=self.model, seed=self.seed, model_error=False, progress=self.progress)
        if loses_single_videos(fit.fits) and not self._lacks_something(fit, causes):
            with self._stage("Searching lost videos anew"):
                fit = fit.with_lost_courses(seed=self.seed)
        return fit

    def _with_better_courses(self, fit: SharedFit, outcome: Outcome) -> SharedFit:
        """The fit with videos searched anew, if something is left that no cause explains.

        Beside causes these are the few that stray under the best model, as on a wrong course of events or island of
        yaw; where none was found, all. It is the same fit where the model does not explain most videos, or where the
        searches find nothing better.
        """
        if outcome.verdict is not Verdict.UNKNOWN or not explained(fit.fits):
            return fit
        best = outcome.found.best
        if not best.causes:
            with self._stage("Searching all videos anew"):
                return with_other_spins(fit, seed=self.seed).with_other_courses(seed=self.seed)
        straying = best.unexplained.videos
        if not 0 < len(straying) <= most_astray(len(fit.fits)):
            return fit
        with self._stage("Searching videos that stray anew"):
            return fit.with_other_courses(seed=self.seed, among=straying)

    def _lacks_something(self, fit: SharedFit, causes: Sequence[Effect]) -> bool:
        """Whether tracks show what videos are lost for, or most videos call for a law: no course is to blame then."""
        if surfaces_unknown_to(fit, causes) or frames_unknown_to(fit, causes):
            return True
        return Leavings(tuple(causes), self.seed).most_call_for_a_law(Trial((), fit), self._needed)

    def _search(self, fit: SharedFit, causes: Sequence[Effect], beginning: Beginning | None = None) -> Search:
        """What is found under a fit."""
        return search(fit, causes, self._needed, seed=self.seed, progress=self.progress, beginning=beginning)

    def _believed(self, found: Search) -> Outcome:
        """What is believed of what is found."""
        return outcome_of(found, asked=set(_cause_names(self.catalogue)), seed=self.seed, progress=self.progress)

    @property
    def _needed(self) -> float:
        """Gain (nats) that a cause must bring, which is that where all are asked of these videos."""
        return gain_needed(sum(effect.follows is None for effect in self.catalogue))

    def _stage(self, description: str) -> AbstractContextManager[Advance]:
        return (self.progress or SilentProgress()).stage(description)


def _beginning(found: Search) -> Beginning | None:
    """What a search in some videos has told; None where nothing was found that acts in all of them."""
    causes = tuple(cause for cause in found.best.causes if not happens_once(cause))
    if not causes:
        return None
    rivals = {
        cause.name: tuple(one.start_with(one.causes[-1]) for one in others)
        for cause, others in zip(found.best.causes, found.near, strict=True)
    }
    return Beginning(causes, extended_model(found.best, found.overdispersion), rivals)


def _names(causes: Sequence[Effect]) -> str:
    """Causes as a list in a sentence."""
    return listed(f"'{title(name)}'" for name in _cause_names(causes))


def _cause_names(causes: Sequence[Effect]) -> list[str]:
    return list(dict.fromkeys(effect.cause_name() for effect in causes))
