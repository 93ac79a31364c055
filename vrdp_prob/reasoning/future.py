"""What happens after a video: which frames that is, and which contacts count."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.reasoning.stretch import Stretch
from vrdp_prob.reasoning.timeline import Timeline, WorldDraws
from vrdp_prob.scene import Tracks

FUTURE_FRAMES = 58
"""Frames after the video that predictive questions ask about: 128 to 185 of a CLEVRER video."""


def future_times(tracks: Tracks) -> Float[np.ndarray, "frame"]:
    """Times in s of the frames after the last one of the video."""
    return float(tracks.times[-1]) + np.arange(1, FUTURE_FRAMES + 1) / tracks.frame_rate


def after_the_video(sight: Sight, stretch: Stretch, seen: EventTable) -> WorldDraws:
    """What happens after the video in a simulation of some draws.

    Parameters
    ----------
    sight
        What the tracks tell.
    stretch
        The simulation; of its contacts those after the video count.
    seen
        What happened in the video in these draws: pairs that met meet no more.
    """
    timeline = Timeline(sight.universe, len(seen.happens), sight.tracks.camera)
    collisions = sight.universe.collisions
    timeline.met[:, collisions] = seen.happens[:, collisions]
    end = float(sight.tracks.times[-1])
    for meeting in stretch.meetings():
        timeline.note_meeting(meeting, meeting.time > end)
    timeline.note_crossings(stretch.times, stretch.position, stretch.exists, np.ones_like(timeline.collided))
    return timeline.of(stretch)
