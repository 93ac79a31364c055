"""A video as soft operations see it: probabilities of attributes, events and motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.reasoning.events import EventTable, EventUniverse
from vrdp_prob.reasoning.facts import Facts, Motion
from vrdp_prob.scene.body import ATTRIBUTES


@dataclass(frozen=True)
class SoftEvents:
    """How probable each event of a video is, and when it is if it is.

    Parameters
    ----------
    universe
        The possible events.
    happens
        Probability of each.
    time
        Time in s of each, NaN where there is none to tell.
    """

    universe: EventUniverse
    happens: Float[Tensor, "event"]
    time: Float[Tensor, "event"]

    @classmethod
    def of(cls, table: EventTable) -> "SoftEvents":
        """Shares of draws, and the mean times where the events happen."""
        share = table.happens.mean(axis=0)
        times = np.where(table.happens, table.time, 0.0).sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(share > 0, times / table.happens.sum(axis=0), np.nan)
        return cls(table.universe, torch.from_numpy(share), torch.from_numpy(mean))

    @cached_property
    def takes_part(self) -> Float[Tensor, "event body"]:
        """1 where a body takes part in an event."""
        return torch.from_numpy(self.universe.takes_part.astype(np.float64))

    @cached_property
    def ancestors(self) -> Float[Tensor, "event event_other"]:
        """Probability that `event_other` is reached from `event`; see `EventTable.ancestors`."""
        size = self.universe.size
        unlinked = torch.ones((size, size), dtype=self.happens.dtype)
        for body in range(len(self.universe.bodies)):
            unlinked = unlinked * (1 - self._previous(body))
        reached = 1 - unlinked
        for _ in range(max(size - 1, 1).bit_length()):
            reached = 1 - (1 - reached) * (1 - reached[:, :, None] * reached[None, :, :]).prod(dim=1)
        return reached

    def _previous(self, body: int) -> Float[Tensor, "event event_other"]:
        """Probability that `event_other` is the event of a body just before its `event`."""
        own = np.flatnonzero(self.universe.takes_part[:, body])
        times = np.where(np.isnan(self.time.numpy()[own]), np.inf, self.time.numpy()[own])
        order = torch.from_numpy(own[np.argsort(times, kind="stable")])
        happens = self.happens[order]
        count = len(order)
        places = torch.arange(count)
        between = (places[None, None, :] > places[None, :, None]) & (places[None, None, :] < places[:, None, None])
        nothing = torch.where(between, 1 - happens, torch.ones_like(happens)).prod(dim=-1)
        links = torch.tril(happens[:, None] * happens[None, :] * nothing, diagonal=-1)
        table = torch.zeros((self.universe.size,) * 2, dtype=links.dtype)
        return table.index_put((order[:, None], order[None, :]), links)


@dataclass(frozen=True)
class SoftMotion:
    """How probable it is that an object is in view, and that it moves there, in each frame.

    Parameters
    ----------
    times
        Times in s of the frames.
    in_view
        Probability to be in the picture.
    moving
        Probability to be in the picture and to move.
    """

    times: Float[np.ndarray, "frame"]
    in_view: Float[Tensor, "frame body"]
    moving: Float[Tensor, "frame body"]

    @classmethod
    def of(cls, motion: Motion) -> "SoftMotion":
        """Shares of draws."""
        in_view, moving = (torch.from_numpy(np.asarray(part.mean(axis=0))) for part in (motion.in_view, motion.moving))
        return cls(motion.times, in_view, moving)

    def frames(self, time: Float[Tensor, "event"]) -> Tensor:
        """Index of the frame nearest to each time; the first frame for events without a time."""
        whole = torch.nan_to_num(time, nan=float(self.times[0])).numpy()
        empty = np.zeros((1, len(self.times), 0), dtype=bool)
        return torch.from_numpy(Motion(self.times, empty, empty).frame(whole))


@dataclass(frozen=True)
class SoftFacts:
    """A video as soft operations see it.

    Parameters
    ----------
    attributes
        Probability of each value of each attribute, by its name.
    values
        The values of each attribute.
    events
        What happens in the video.
    motion
        Who moves when.
    """

    attributes: Mapping[str, Float[Tensor, "body value"]]
    values: Mapping[str, tuple[str, ...]]
    events: SoftEvents
    motion: SoftMotion

    @classmethod
    def of(cls, facts: Facts) -> "SoftFacts":
        """Shares of the draws of exact facts."""
        attributes, values = {}, {}
        for name in ATTRIBUTES:
            labels = facts.attribute(name)
            values[name] = labels[0].names
            shares = [np.bincount(label.index, minlength=len(label.names)) / facts.draws for label in labels]
            attributes[name] = torch.from_numpy(np.stack(shares))
        return cls(attributes, values, SoftEvents.of(facts.events()), SoftMotion.of(facts.motion()))

    def attribute(self, name: str, value: str) -> Float[Tensor, "body"]:
        """Probability of each object to have a value of an attribute; zero for a value that nobody knows."""
        if value not in self.values[name]:
            return torch.zeros(self.bodies, dtype=torch.double)
        return self.attributes[name][:, self.values[name].index(value)]

    @property
    def bodies(self) -> int:
        """Number of objects."""
        return len(self.events.universe.bodies)
