"""What a fit leaves, drawn against what a failing check asks about, with what noise alone would leave."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.contacts import DISTANCE
from vrdp_prob.discovery.checks.measurement import DISTORTION, LOST, SINGLE
from vrdp_prob.discovery.page.plots import Plot, side_by_side
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import NORMAL_95
from vrdp_prob.discovery.residuals.residual_model import ResidualModel, VideoResiduals
from vrdp_prob.report.axes import linear_axis

REPLICAS = 60
"""Replicas of noise that tell how far the means of groups scatter."""
GROUPS, FEWEST = 10, 5
"""Groups of observations whose means are drawn, at most, and observations in each, at least."""

Numbers = Float[np.ndarray, "observation"]
Vectors = Float[np.ndarray, "observation 2"]
Groups = list[tuple[float, float, float]]


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


@dataclass(frozen=True)
class Remainder:
    """What one fit leaves.

    Parameters
    ----------
    model
        Its residuals.
    colour, name
        How it is drawn, and what it is called.
    """

    model: ResidualModel
    colour: str
    name: str

    @cached_property
    def replicas(self) -> Sequence[Float[np.ndarray, "_ replica"]]:
        """What noise alone leaves of each video."""
        return self.model.replicas(REPLICAS, np.random.default_rng(0))


def panels(remainders: Sequence[Remainder], failing: Collection[str]) -> dict[str, str]:
    """A figure for each of the checks that fail and have one: SVG elements by their titles."""
    found = {name: [_groups(one, panel) for one in remainders] for name, panel in PANELS.items() if name in failing}
    return {
        f"Residuals: {name}": _figure(remainders, PANELS[name], groups)
        for name, groups in found.items()
        if all(len(some) > 1 for some in groups)
    }


def _figure(remainders: Sequence[Remainder], panel: Panel, found: Sequence[Groups]) -> str:
    x = linear_axis([place for groups in found for place, *_ in groups])
    y = linear_axis(
        [end for groups in found for _, mean, sd in groups for end in (mean, NORMAL_95 * sd, -NORMAL_95 * sd)]
    )
    plots = []
    for one, groups in zip(remainders, found, strict=True):
        plot = Plot(x, y, panel.label, f"{panel.component}, noise sd", one.name, width=360)
        plot.band([(place, -NORMAL_95 * sd, NORMAL_95 * sd) for place, _, sd in groups])
        plot.level(0.0)
        for place, mean, _ in groups:
            plot.point(place, mean, None, one.colour)
        plots.append(plot)
    words = (
        f"Means of the residuals {panel.component} against {panel.label}; grey: the middle 95 % of what noise leaves."
    )
    return side_by_side(plots, words)


def _groups(one: Remainder, panel: Panel) -> Groups:
    """Mean place, mean residual, and its standard deviation by chance, of each group of observations."""
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
    if not len(place):
        return []
    edges = np.unique(np.quantile(place, np.linspace(0, 1, GROUPS + 1)[1:-1]))
    group_of = np.searchsorted(edges, place, side="right")
    groups = [group for k in range(len(edges) + 1) if len(group := np.flatnonzero(group_of == k)) >= FEWEST]
    return [
        (float(place[group].mean()), float(value[group].mean()), float(chance[group].mean(axis=0).std()))
        for group in groups
    ]


def _observed(
    values: Float[np.ndarray, "time body *numbers"], video: VideoResiduals
) -> Float[np.ndarray, "_ *numbers"]:
    observations = video.likelihood.observations
    return values[observations.frame, observations.body]


def _spin(video: VideoResiduals) -> Numbers:
    return _observed(video.motion.spin, video)


def _mass(video: VideoResiduals) -> Numbers:
    return _observed(np.broadcast_to(video.motion.mass, video.motion.speed.shape), video)


def _time(video: VideoResiduals) -> Numbers:
    return video.motion.times[video.likelihood.observations.frame]


def _along(video: VideoResiduals) -> Vectors:
    return _observed(video.motion.direction, video)


def _across(video: VideoResiduals) -> Vectors:
    return _observed(video.motion.sideways, video)


def _to_nearest(video: VideoResiduals) -> Float[np.ndarray, "time body 2"]:
    """From each body to the nearest other one, in m; 0 where there is none."""
    place = video.motion.position
    apart = place[:, None] - place[:, :, None]
    distance = np.linalg.norm(apart, axis=-1)
    distance[:, np.arange(place.shape[1]), np.arange(place.shape[1])] = np.inf
    distance[np.broadcast_to(~_there(video)[:, None], distance.shape)] = np.inf
    nearest = distance.argmin(axis=2)
    found = np.take_along_axis(apart, nearest[:, :, None, None], axis=2)[:, :, 0]
    known = np.isfinite(distance.min(axis=2))
    return np.where(known[..., None], found, 0.0)


def _there(video: VideoResiduals) -> np.ndarray:
    tracks = video.motion.tracks
    return np.asarray(tracks.times[:, None] >= tracks.first_seen)


def _distance(video: VideoResiduals) -> Numbers:
    return np.linalg.norm(_observed(_to_nearest(video), video), axis=1)


def _towards(video: VideoResiduals) -> Vectors:
    return _unit(_observed(_to_nearest(video), video))


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


def _outwards(video: VideoResiduals) -> Vectors:
    return _unit(_from_middle(video))


def _from_middle(video: VideoResiduals) -> Vectors:
    """Places seen from the middle of the region where bodies were, in m."""
    tracks = video.motion.tracks
    return _observed(tracks.positions, video) - np.median(tracks.positions[tracks.seen], axis=0)


def _unit(vectors: Vectors) -> Vectors:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), 0.0)


PANELS: Mapping[str, Panel] = {
    "acceleration along the velocity against spin": Panel("spin (rad/s)", _spin, "along the velocity", _along),
    "acceleration across the velocity against spin": Panel("spin (rad/s)", _spin, "to the left", _across),
    "acceleration along the velocity against mass": Panel("mass (kg)", _mass, "along the velocity", _along),
    "acceleration against the distance to other bodies": Panel(
        "distance to the nearest body (m)", _distance, "towards it", _towards
    ),
    DISTANCE: Panel(
        "time since a contact (s)",
        lambda video: _observed(_after_contact(video), video)[:, 0],
        "away from the partner",
        lambda video: _observed(_after_contact(video), video)[:, 1:],
    ),
    LOST: Panel("time (s)", _time, "along the velocity", _along),
    SINGLE: Panel("time (s)", _time, "along the velocity", _along),
    DISTORTION: Panel(
        "distance from the middle (m)", lambda video: np.linalg.norm(_from_middle(video), axis=1), "outwards", _outwards
    ),
}
"""How what a check is about is shown, by its name."""
