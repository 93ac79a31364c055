"""What some of many videos have told of the causes that all of them need, from which the search in all goes on."""

from collections.abc import Mapping
from dataclasses import dataclass

from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.selection.gains import gain
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.second_look import explained, lost_videos
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.physics import PhysicsModel


@dataclass(frozen=True)
class Beginning:
    """Causes that some videos were found to need.

    Parameters
    ----------
    causes
        The causes, none of which happens once in a video.
    believed
        The model with them that believes what these videos tell.
    rivals
        By the name of a cause: effects that could take its place in these videos, as they were there.
    """

    causes: tuple[Effect, ...]
    believed: PhysicsModel
    rivals: Mapping[str, tuple[FirstGuess, ...]]

    def fitted(self, base: Trial, refits: Refits) -> Trial | None:
        """A model with the causes, fitted to all videos from the beginning; None where it brings too little.

        What some videos tell is where the fit begins, and no part of it in the end. Single videos that it loses are
        searched anew.
        """
        found = refits.extensions.from_the_beginning(base, self.causes, self.believed)
        if found is None or gain(found, base)[0] < refits.needed:
            return None
        few = explained(found.fit.fits)
        return refits.courses.searched_anew(found, lost_videos(found.fit.fits)) if few else found
