"""Patterns of missing acceleration in the residuals of a joint fit, and how strongly each shows beside the others.

Everything that the fit can absorb is taken out of a pattern: states at the release, masses, frictions, and the
velocities right after each contact, so that a wrong contact does not look like a push.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.residuals.fitted_motion import Kicks
from vrdp_prob.discovery.residuals.free_flight_patterns import Pattern, Scales, patterns
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.simulator.events import CONTACTS, RolloutEventKind

FRICTION = FRICTION_RATIO.name
"""Name of the parameter that is a body's own friction, in units of what the bodies share."""


@dataclass(frozen=True)
class FreeFlight:
    """How strongly patterns of missing acceleration show.

    Parameters
    ----------
    model
        The residuals where velocities after contacts are free.
    scales
        Typical numbers of the videos.
    patterns
        The patterns.
    rows
        What each does to the residuals of each video.
    score
        How strongly each shows, beside what a friction of its own may do to every body.
    fields
        The patterns' accelerations (per amplitude) of all bodies at all frames at which they move and are seen.
    """

    model: ResidualModel
    scales: Scales
    patterns: tuple[Pattern, ...]
    rows: Sequence[Float[np.ndarray, "_ pattern"]]
    score: Score
    fields: Float[np.ndarray, "place 2 pattern"]

    @classmethod
    def of(cls, model: ResidualModel) -> "FreeFlight":
        """All patterns in the residuals of a fit."""
        motions = [video.motion for video in model.videos]
        own = any(entry.field == FRICTION for v in model.videos for entry in v.likelihood.coordinates.entries)
        scales = Scales.of(motions, own_friction=own)
        chosen = tuple(patterns(scales))
        fields = [np.stack([one.field(motion) for one in chosen], axis=-1) for motion in motions]
        rows = [v.rows(v.motion.pushed(field)) for v, field in zip(model.videos, fields, strict=True)]
        seen = [motion.moving & motion.tracks.seen for motion in motions]
        places = np.concatenate([field[where] for field, where in zip(fields, seen, strict=True)])
        freed = after_contacts_freed(model)
        asked = frictions_freed(freed) if own else freed
        return cls(freed, scales, chosen, rows, asked.score(rows), places)

    @cached_property
    def beside(self) -> ResidualModel:
        """The residuals where every contact may leave any velocity, and patterns may show."""
        return self.model.sharing(self.rows_beside_contacts)

    @property
    def rows_beside_contacts(self) -> list[Float[np.ndarray, "_ pattern"]]:
        """What the patterns do that may show where something else is asked."""
        kept = [k for k, one in enumerate(self.patterns) if one.beside_contacts]
        return [rows[:, kept] for rows in self.rows]

    def numbers(self, names: Sequence[str]) -> list[int]:
        """Places of patterns whose names begin with one of some names and are no longer words."""
        return [k for k, one in enumerate(self.patterns) if any(_matches(one.name, name) for name in names)]

    def part(self, names: Sequence[str], given: Sequence[str] = ()) -> "Part":
        """Some of the patterns, where some others may show as well."""
        chosen = self.numbers(names)
        score = self.score.of(chosen, self.numbers(given))
        return Part(tuple(self.patterns[k] for k in chosen), score, self.fields[..., chosen])


@dataclass(frozen=True)
class Part:
    """Some patterns of missing acceleration, what is known of their amplitudes, and their fields."""

    patterns: tuple[Pattern, ...]
    score: Score
    fields: Float[np.ndarray, "place 2 pattern"]

    @property
    def size(self) -> float:
        """Root mean square of the estimated acceleration in m/s^2."""
        found = self.fields @ self.score.estimate
        return float(np.sqrt((found**2).sum(axis=1).mean())) if len(found) else 0.0

    @property
    def visible(self) -> float:
        """Root mean square acceleration (m/s^2) of one pattern that would have shown (95 %)."""
        squares = (self.fields**2).sum(axis=1).mean(axis=0) if len(self.fields) else np.zeros(len(self.patterns))
        return WITHIN_95 * float(np.sqrt(np.max(squares * self.score.sd**2, initial=0.0)))

    def estimate(self, name: str) -> float:
        """Estimated amplitude of a pattern; 0 where the videos cannot show it."""
        names = [one.name for one in self.patterns]
        return float(self.score.estimate[names.index(name)]) if name in names else 0.0


def after_contacts_freed(model: ResidualModel) -> ResidualModel:
    """The model of a fit in which every contact may leave any velocity."""
    columns = []
    for video in model.videos:
        events = video.motion.events
        touching = events.where(np.isin(events.kind, CONTACTS))
        both = touching.kind == RolloutEventKind.COLLISION
        times = np.concatenate([touching.time, touching.time[both]])
        bodies = np.concatenate([touching.first, touching.second[both]])
        columns.append(video.rows(video.motion.kicked(Kicks.single(times, bodies))))
    return model.freed(columns)


def frictions_freed(model: ResidualModel) -> ResidualModel:
    """The model of a fit in which every body may be slowed or sped up along its velocity by a constant of its own.

    The logarithm of a friction follows noise that asks for more of it, and none that asks for less than nothing: where
    tables hardly brake, what is left of both would be an acceleration along the velocity.
    """
    columns = []
    for video in model.videos:
        bodies = np.eye(video.motion.speed.shape[1])
        columns.append(video.rows(video.motion.pushed(video.motion.direction[..., None] * bodies[:, None])))
    return model.freed(columns)


def _matches(name: str, wanted: str) -> bool:
    return name == wanted or (wanted.endswith(" material") and name.startswith(wanted))
