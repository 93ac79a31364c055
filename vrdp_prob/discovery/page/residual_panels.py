"""Residuals against what a failing check asks about, with what noise alone would leave."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.contacts import DISTANCE
from vrdp_prob.discovery.checks.measurement import DISTORTION
from vrdp_prob.discovery.page.scatter import Banded, with_bands
from vrdp_prob.discovery.page.seen import Figure, Seen
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.residual_model import VideoResiduals

GROUPS, FEWEST = 10, 5
"""Groups of observations whose means are drawn, at most, and observations in each, at least."""

Numbers = Float[np.ndarray, "observation"]
Vectors = Float[np.ndarray, "observation 2"]


@dataclass(frozen=True)
class Panel:
    """How the residuals that a check is about are shown.

    Parameters
    ----------
    label, against
        Against what, with its unit, and its value at each observation.
    component, direction
        Which component of the residuals, and its direction at each observation (0 where there is none).
    """

    label: str
    against: Callable[[VideoResiduals], Numbers]
    component: str
    direction: Callable[[VideoResiduals], Vectors]


def _figure(seen: Sequence[Seen], check: str) -> str:
    panel = PANELS[check]
    return with_bands(
        seen,
        [means(one, panel) for one in seen],
        (panel.label, f"{panel.component}, noise sd"),
        f"Means of the residuals {panel.component} against {panel.label}.",
    )


def means(one: Seen, panel: Panel) -> Banded | None:
    """Mean residuals of groups of observations, and what chance makes of them; None where there are too few."""
    at, seen, drawn = [], [], []
    for video, left, noise in zip(one.model.videos, one.model.left, one.replicas, strict=True):
        direction = panel.direction(video)
        shown = np.flatnonzero(np.linalg.norm(direction, axis=1) > 0)
        # residuals are predicted less observed
        rows = -np.concatenate([left[:, None], noise], axis=1)[: video.positions].reshape(-1, 2, noise.shape[1] + 1)
        values = np.einsum("oj,ojr->or", direction, rows)[shown]
        at.append(panel.against(video)[shown])
        seen.append(values[:, 0])
        drawn.append(values[:, 1:])
    place, value, chance = np.concatenate(at), np.concatenate(seen), np.concatenate(drawn)
    edges = np.unique(np.quantile(place, np.linspace(0, 1, GROUPS + 1)[1:-1])) if len(place) else np.zeros(0)
    group_of = np.searchsorted(edges, place, side="right")
    groups = [group for k in range(len(edges) + 1) if len(group := np.flatnonzero(group_of == k)) >= FEWEST]
    if len(groups) < 2:
        return None
    return Banded.about_nothing(
        np.array([place[group].mean() for group in groups]),
        np.array([value[group].mean() for group in groups]),
        np.array([chance[group].mean(axis=0).std() for group in groups]),
    )


def _observed(
    values: Float[np.ndarray, "time body *numbers"], video: VideoResiduals
) -> Float[np.ndarray, "_ *numbers"]:
    observations = video.likelihood.observations
    return values[observations.frame, observations.body]


def _after_contact(video: VideoResiduals) -> Float[np.ndarray, "time body 3"]:
    """Time in s since the last contact of each body with another one, and the direction away from that one."""
    contacts = FittedContacts.of(video.motion)
    found = np.zeros((*video.motion.speed.shape, 3))
    for contact in np.argsort(contacts.events.time):
        later = video.motion.times > contacts.events.time[contact]
        for side, body in zip(contacts.sides, contacts.bodies[contact], strict=True):
            found[later, body, 0] = video.motion.times[later] - contacts.events.time[contact]
            found[later, body, 1:] = side * contacts.events.normal[contact]
    return found


def _from_middle(video: VideoResiduals) -> Vectors:
    """Places seen from the middle of the region where bodies were, in m."""
    tracks = video.motion.tracks
    return _observed(tracks.positions, video) - np.median(tracks.positions[tracks.seen], axis=0)


def _outwards(video: VideoResiduals) -> Vectors:
    vectors = _from_middle(video)
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), 0.0)


PANELS: Mapping[str, Panel] = {
    DISTANCE: Panel(
        "time since a contact (s)",
        lambda video: _observed(_after_contact(video), video)[:, 0],
        "away from the partner",
        lambda video: _observed(_after_contact(video), video)[:, 1:],
    ),
    DISTORTION: Panel(
        "distance from the middle (m)", lambda video: np.linalg.norm(_from_middle(video), axis=1), "outwards", _outwards
    ),
}
"""How what a check is about is shown, by its name."""
RESIDUAL_FIGURES: Mapping[str, Figure] = {check: partial(_figure, check=check) for check in PANELS}
