"""What figures show of one fit: what it leaves, and how it is drawn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.neighbours import roughness
from vrdp_prob.discovery.residuals.contact_patterns import ContactScore
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.missing_acceleration import Windows, missing_acceleration
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import SharedFit

REPLICAS = 60
"""Replicas of noise that tell how far it scatters."""
LONGEST_NAME = 24
"""Letters of a video's name for which there is room."""


@dataclass(frozen=True)
class Seen:
    """One fit, asked as the checks ask it.

    Parameters
    ----------
    fit
        The fit.
    colour, name
        How it is drawn, and what it is called.
    """

    fit: SharedFit
    colour: str
    name: str

    @cached_property
    def model(self) -> ResidualModel:
        """What it leaves."""
        return ResidualModel.of(self.fit).without_beliefs

    @cached_property
    def flight(self) -> FreeFlight:
        """The same in free flight."""
        return FreeFlight.of(self.model)

    @cached_property
    def windows(self) -> Windows:
        """Accelerations that it misses."""
        return missing_acceleration(self.flight.model, roughness(self.model))

    @cached_property
    def contacts(self) -> Sequence[FittedContacts]:
        """Contacts of bodies with each other, video by video."""
        return [FittedContacts.of(video.motion) for video in self.model.videos]

    @cached_property
    def at_contacts(self) -> ContactScore | None:
        """What acts at each contact; None without contacts."""
        return ContactScore.of(self.model, self.flight, each=True)

    @cached_property
    def replicas(self) -> Sequence[Float[np.ndarray, "_ replica"]]:
        """What noise alone leaves of each video."""
        return self.model.replicas(REPLICAS, np.random.default_rng(0))


Figure = Callable[[Sequence[Seen]], str]
"""An SVG element that shows something of all fits; empty where there is nothing to show."""


def shortened(name: str) -> str:
    """The end of a video's name, if it is long."""
    return name if len(name) <= LONGEST_NAME else f"…{name[1 - LONGEST_NAME :]}"
