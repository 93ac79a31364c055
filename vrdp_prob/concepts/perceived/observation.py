"""One video as concepts are learned from it and applied to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from vrdp_prob.concepts.perceived.crop_statistics import crop_statistics
from vrdp_prob.concepts.perceived.slides import slide_statistics
from vrdp_prob.concepts.perceived.soft_facts import SoftEvents, SoftMotion
from vrdp_prob.concepts.perceived.trajectories import (
    in_sight,
    pair_features,
    trajectories,
    window_features,
    windows_in_sight,
)
from vrdp_prob.perception.crops import Crops
from vrdp_prob.perception.reading import SeenObjects
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.sight import Sight

_DRAWS = 200
"""Draws of what the tracks leave open about events and motion."""

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Observation:
    """What is seen of the objects of one video, and what the tracks tell of events.

    Parameters
    ----------
    crops
        Crops of each object: red, green, blue and mask in steps of 1/255.
    there
        Which of them there are: objects differ in how many.
    slides
        Statistics of each object's slides.
    trajectory
        Picture and floor position in each frame.
    sight
        Frames in which an object is in sight.
    times
        Times in s of the frames.
    happens, event_times
        Probability of each event by the tracks, and its time in s.
    in_view, moving
        Probability by the tracks that an object is in the picture, and that it moves there, in each frame.
    """

    crops: UInt8[Tensor, "object view 4 row column"]
    there: Bool[Tensor, "object view"]
    slides: Float[Tensor, "object statistic"]
    trajectory: Float[Tensor, "frame object 4"]
    sight: Bool[Tensor, "frame object"]
    times: Float[Tensor, "frame"]
    happens: Float[Tensor, "event"]
    event_times: Float[Tensor, "event"]
    in_view: Float[Tensor, "frame object"]
    moving: Float[Tensor, "frame object"]

    @classmethod
    def of(cls, seen: SeenObjects) -> "Observation":
        """What perception saw of a video.

        Raises
        ------
        InputError
            If the tracks have no camera.
        """
        sight = Sight(seen.tracks)
        video = SeenVideo(sight, _DRAWS)
        events, motion = SoftEvents.of(video.events), SoftMotion.of(video.motion)
        crops, there = _stacked(seen.crops)
        return cls(
            torch.from_numpy(crops),
            torch.from_numpy(there),
            torch.from_numpy(slide_statistics(sight)).float(),
            torch.from_numpy(trajectories(seen.tracks)).float(),
            torch.from_numpy(in_sight(seen.tracks)),
            torch.from_numpy(seen.tracks.times.copy()),
            events.happens,
            events.time,
            motion.in_view,
            motion.moving,
        )

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All of it as arrays by name."""
        return {name: getattr(self, name).numpy() for name in self.__dataclass_fields__}

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> "Observation":
        """What `arrays` gave."""
        return cls(**{name: torch.from_numpy(arrays[name]) for name in cls.__dataclass_fields__})

    @cached_property
    def universe(self) -> EventUniverse:
        """The possible events."""
        return EventUniverse(tuple(str(place) for place in range(len(self.there))))

    @cached_property
    def statistics(self) -> Float[Tensor, "crop statistic"]:
        """Statistics of the crops that there are, object by object."""
        return crop_statistics(self.pictures[self.there])

    @property
    def pictures(self) -> Float[Tensor, "object view 4 row column"]:
        """The crops, 0 to 1."""
        return self.crops.float() / 255

    @cached_property
    def windows(self) -> Float[Tensor, "window object feature"]:
        """Window features of each object."""
        return window_features(self.trajectory)

    @cached_property
    def pair_windows(self) -> Float[Tensor, "order window pair feature"]:
        """Window features of each pair, in both orders."""
        return pair_features(self.trajectory, self.universe)

    @cached_property
    def pairs_in_sight(self) -> Bool[Tensor, "window pair"]:
        """Windows in which both objects of a pair are in sight from beginning to end."""
        here = windows_in_sight(self.sight)
        first, second = ([pair[place] for pair in self.universe.pairs] for place in (0, 1))
        return here[:, first] & here[:, second]

    @cached_property
    def events(self) -> SoftEvents:
        """What happens, by the tracks."""
        return SoftEvents(self.universe, self.happens, self.event_times)

    @cached_property
    def motion(self) -> SoftMotion:
        """Who moves when, by the tracks."""
        return SoftMotion(self.times.numpy(), self.in_view, self.moving)


def _stacked(
    crops: Sequence[Crops],
) -> tuple[UInt8[np.ndarray, "object view 4 row column"], Bool[np.ndarray, "object view"]]:
    """The crops of all objects in one array, as long as the longest."""
    most, side = max(map(len, crops)), crops[0].masks.shape[-1]
    table = np.zeros((len(crops), most, 4, side, side), dtype=np.uint8)
    there = np.zeros((len(crops), most), dtype=bool)
    for place, one in enumerate(crops):
        table[place, : len(one), :3] = np.moveaxis(one.pictures, -1, 1)
        table[place, : len(one), 3] = one.masks
        there[place, : len(one)] = True
    return table, there
