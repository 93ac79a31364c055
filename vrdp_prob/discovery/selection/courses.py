"""Videos of models that are searched anew for another course of events."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.second_look import may_take_another_course


@dataclass(frozen=True)
class Courses:
    """Searches of videos for another course of events, each begun only where the last one may have left something.

    Parameters
    ----------
    seed
        Of the first search of a video.
    """

    seed: int
    _searched: dict[Trial, tuple[frozenset[int], int]] = field(default_factory=dict)

    def searched_anew(self, trial: Trial, videos: Sequence[int]) -> Trial:
        """A model with some videos searched anew, as far as they may take another course.

        A course for which other videos lose theirs, and do not find it again, is a wrong one; one with which others
        are a little less probable and explained still is none. A video of which a search has found nothing better is
        not searched again; where it has, a further search takes another seed.
        """
        settled, passed = self._searched.get(trial, (frozenset(), 0))
        now = [one for one in videos if one not in settled and may_take_another_course(trial.fit.fits[one])]
        found = trial.mended(now, seed=self.seed + passed, thorough=True) if now else trial
        if found is not trial and (fallen := found.fallen_from(trial)):
            found = found.mended(fallen, seed=self.seed + passed)
            found = trial if found.loses_videos_of(trial) else found
        settled |= frozenset(now).difference([] if found is trial else trial.fallen_from(found))
        self._searched[trial] = self._searched[found] = (settled, passed + 1)
        return found
