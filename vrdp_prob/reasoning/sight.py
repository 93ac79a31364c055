"""What the tracks of a video tell before anything is drawn: contacts, rests, and who is in the picture when."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.reasoning.contacts import Contact, SeenMotion, see
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.rest import Rest, possible_rests
from vrdp_prob.reasoning.smoother import body_tracks
from vrdp_prob.scene import Tracks

LATE_FRAMES = 3
"""Without a camera an object enters when it is first seen this many frames after the start, or later."""

NEGLIGIBLE_LOG_ODDS = -6.0
"""Doubtful contacts below these log odds are left out."""


@dataclass(frozen=True)
class Sight:
    """A video as its tracks tell it, with what they leave open.

    Parameters
    ----------
    tracks
        The measured positions.
    """

    tracks: Tracks

    @cached_property
    def seen(self) -> SeenMotion:
        """Contacts and the motion between them."""
        return see(self.tracks.bodies, body_tracks(self.tracks))

    @cached_property
    def universe(self) -> EventUniverse:
        """The possible events."""
        return EventUniverse(tuple(body.id for body in self.tracks.bodies))

    @cached_property
    def presence(self) -> Int[np.ndarray, "body 2"]:
        """First frame in view, and first frame after that not in view (the number of frames if there is none).

        With a camera, the motion is continued beyond the first and the last frame in which an object was seen, for as
        long as its centre stays in the picture: rows may be missing, and a hidden object has not left.
        """
        frames = len(self.tracks.times)
        spans = np.empty((len(self.tracks.bodies), 2), dtype=int)
        for body in range(len(self.tracks.bodies)):
            seen = np.flatnonzero(self.tracks.seen[:, body])
            inside = self._inside(body, seen)
            first, last = int(seen[0]), int(seen[-1])
            while first > 0 and inside[first - 1]:
                first -= 1
            while last + 1 < frames and inside[last + 1]:
                last += 1
            spans[body] = first, last + 1
        return spans

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts worth a thought, sure and doubtful, in order of time."""
        doubtful = [contact for contact in self.seen.doubtful if contact.log_odds > NEGLIGIBLE_LOG_ODDS]
        return tuple(sorted((*self.seen.contacts, *doubtful), key=lambda contact: contact.time))

    @cached_property
    def rests(self) -> tuple[tuple[Rest, ...], ...]:
        """Where each body may lie still."""
        end = float(self.tracks.times[-1])
        return tuple(possible_rests(smoother, until=end) for smoother in self.seen.smoothers)

    def _inside(self, body: int, seen: Int[np.ndarray, "seen"]) -> Bool[np.ndarray, "frame"]:
        """Whether the centre of a body is in the picture, at every frame."""
        camera, times = self.tracks.camera, self.tracks.times
        if camera is not None:
            return np.asarray(camera.in_view(self.seen.smoothers[body].state(times)[0]))
        inside = np.ones(len(times), dtype=bool)
        if seen[0] > LATE_FRAMES:
            inside[: seen[0]] = False
        if seen[-1] < len(times) - 1 - LATE_FRAMES:
            inside[seen[-1] + 1 :] = False
        return inside
