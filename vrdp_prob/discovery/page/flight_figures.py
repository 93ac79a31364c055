"""Accelerations that a model misses in free flight, group by group of what a failing check asks about."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2

from vrdp_prob.discovery.checks.flight import DISTANCE, PUSH, QUESTIONS, SHAKING, phases
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.page.scatter import Banded, Points, with_bands, with_bars
from vrdp_prob.discovery.page.seen import Figure, Seen
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.free_flight_patterns import there, way_travelled
from vrdp_prob.discovery.residuals.residual_model import joined
from vrdp_prob.scene import Body

GROUPS = 6
"""Groups of places, at most, in each of which an acceleration of its own is asked for."""
ALONG, ACROSS, TOWARDS_OTHERS = "along the velocity", "to the left of the velocity", "towards the nearest body"

Values = Float[np.ndarray, "time body"]
Direction = Callable[[FittedMotion], Float[np.ndarray, "time body 2"]]


@dataclass(frozen=True)
class Aspect:
    """One component of what is missing against one thing that it may depend on.

    Parameters
    ----------
    component
        Which component.
    against
        Against what, with its unit.
    value
        Its value for all bodies at all frames.
    kind
        What a body is in a word, if that is what it may depend on.
    """

    component: str
    against: str
    value: Callable[[FittedMotion], Values] = lambda motion: motion.speed
    kind: Callable[[Body], str | None] | None = None


def _along(coordinate: int) -> Direction:
    return lambda motion: np.broadcast_to(np.eye(2)[coordinate], motion.velocity.shape)


def _to_nearest(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    """From each body to the nearest other one, in m; 0 where there is none."""
    place = motion.position
    apart = place[:, None] - place[:, :, None]
    distance = np.linalg.norm(apart, axis=-1)
    distance[:, np.arange(place.shape[1]), np.arange(place.shape[1])] = np.inf
    distance[np.broadcast_to(~there(motion.tracks)[:, None], distance.shape)] = np.inf
    nearest = distance.argmin(axis=2)
    found = np.take_along_axis(apart, nearest[:, :, None, None], axis=2)[:, :, 0]
    return np.where(np.isfinite(distance.min(axis=2))[..., None], found, 0.0)


def _distance(motion: FittedMotion) -> Values:
    distance = np.linalg.norm(_to_nearest(motion), axis=-1)
    return np.where(distance > 0, distance, np.nan)


def _towards_others(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    return _to_nearest(motion) / np.nan_to_num(_distance(motion), nan=1.0)[..., None]


COMPONENTS: Mapping[str, Direction] = {
    ALONG: lambda motion: motion.direction,
    ACROSS: lambda motion: motion.sideways,
    "along x": _along(0),
    "along y": _along(1),
    TOWARDS_OTHERS: _towards_others,
}


def _heading(motion: FittedMotion) -> Values:
    """Direction of motion in degrees, alike for both senses."""
    return np.degrees(np.arctan2(motion.velocity[..., 1], motion.velocity[..., 0])) % 180.0


def _mass(motion: FittedMotion) -> Values:
    return np.broadcast_to(motion.mass, motion.speed.shape)


def _places(component: str) -> tuple[Aspect, ...]:
    return (
        Aspect(component, "x (m)", lambda motion: motion.position[..., 0]),
        Aspect(component, "y (m)", lambda motion: motion.position[..., 1]),
    )


def _kinds(component: str) -> dict[str, tuple[Aspect, ...]]:
    """What bodies are, and how near others are."""
    return {
        DISTANCE: (Aspect(component, "distance to the nearest body (m)", _distance),),
        "shape": (Aspect(component, "shape", kind=lambda body: str(body.shape)),),
        "material": (Aspect(component, "material", kind=lambda body: body.material),),
        "mass": (Aspect(component, "mass (kg)", _mass),),
    }


ASPECTS: Mapping[str, tuple[Aspect, ...]] = {
    "push against speed": tuple(Aspect(component, "speed (m/s)") for component in ("along x", "along y")),
    "acceleration along the velocity against the direction of motion": tuple(
        Aspect(component, "direction of motion (degrees)", _heading) for component in (ALONG, ACROSS)
    ),
    "acceleration along the velocity against place": _places(ALONG),
    "acceleration along the velocity against the way travelled": (Aspect(ALONG, "way travelled (m)", way_travelled),),
    "acceleration along the velocity against spin": (
        Aspect(ALONG, "size of the spin (rad/s)", lambda motion: np.abs(motion.spin)),
    ),
    "acceleration across the velocity against place": _places(ACROSS),
    "acceleration across the velocity against spin": (Aspect(ACROSS, "spin (rad/s)", lambda motion: motion.spin),),
    **{f"acceleration along the velocity against {name}": aspects for name, aspects in _kinds(ALONG).items()},
    **{f"acceleration across the velocity against {name}": aspects for name, aspects in _kinds(ACROSS).items()},
    f"acceleration against {DISTANCE}": _kinds(TOWARDS_OTHERS)[DISTANCE],
}
"""What is drawn for a failing check of free flight, by its name."""
GIVEN = {question.name: question.given for question in QUESTIONS}
"""Patterns that may show beside what a check asks about."""


def _dependence(seen: Sequence[Seen], check: str) -> str:
    """The missing acceleration in each group of what a check asks about."""
    aspects = ASPECTS[check]
    groupings = [_grouping(seen, aspect) for aspect in aspects]
    found = [_estimates(one, fit, check, groupings) for fit, one in enumerate(seen)]
    alike = len({aspect.against for aspect in aspects}) == 1
    titles = [aspect.component if alike else aspect.against for aspect in aspects]
    labels = (aspects[0].against, "m/s²") if alike else ("", f"{aspects[0].component} (m/s²)")
    words = f"Missing acceleration in groups of what the check '{check}' asks about."
    if ALONG in {aspect.component for aspect in aspects}:
        words += " What is the same in all groups is friction, which the model has."
    plots = {title: [points[place] for points in found] for place, title in enumerate(titles)}
    return with_bars(seen, plots, labels, words, names=groupings[0].names)


@dataclass(frozen=True)
class _Grouping:
    """What a check asks about in each video of each fit, the ends between groups of it, and their names if any."""

    values: Sequence[Sequence[Values]]
    edges: Float[np.ndarray, "edge"]
    names: tuple[str, ...] = ()

    def members(self, fit: int, video: int) -> Bool[np.ndarray, "time body group"]:
        """Which group each body at each frame is in, if any."""
        value = self.values[fit][video]
        group = np.searchsorted(self.edges, value, side="right")
        return (group[..., None] == np.arange(len(self.edges) + 1)) & np.isfinite(value)[..., None]


def _grouping(seen: Sequence[Seen], aspect: Aspect) -> _Grouping:
    motions = [[video.motion for video in one.model.videos] for one in seen]
    if aspect.kind is not None:
        kind = aspect.kind
        names = tuple(sorted({word for some in motions for m in some for b in m.tracks.bodies if (word := kind(b))}))

        def value(motion: FittedMotion) -> Values:
            own = [names.index(word) if (word := kind(body)) else np.nan for body in motion.tracks.bodies]
            return np.broadcast_to(np.array(own, dtype=float), motion.speed.shape)

        return _Grouping([[value(m) for m in some] for some in motions], np.arange(len(names) - 1) + 0.5, names)
    values = [[aspect.value(motion) for motion in some] for some in motions]
    everywhere = [
        value[motion.moving & motion.tracks.seen]
        for some, own in zip(motions, values, strict=True)
        for motion, value in zip(some, own, strict=True)
    ]
    shown = np.concatenate(everywhere)
    shown = shown[np.isfinite(shown)]
    inner = np.quantile(shown, np.linspace(0, 1, GROUPS + 1)[1:-1]) if len(shown) else np.zeros(0)
    return _Grouping(values, np.unique(inner))


def _estimates(one: Seen, fit: int, check: str, groupings: Sequence[_Grouping]) -> list[Points]:
    """The acceleration of its own that each group asks for, beside what the check lets show beside, for each aspect.

    All aspects of a check are asked together, as what acts along one axis shows along the other after a contact.
    """
    videos = one.flight.model.videos
    given = one.flight.numbers(GIVEN[check])
    rows = {"beside": [some[:, given] for some in one.flight.rows]}
    middles = {}
    for aspect, grouping in zip(ASPECTS[check], groupings, strict=True):
        name, direction = f"{aspect.component}, {aspect.against}", COMPONENTS[aspect.component]
        members = [grouping.members(fit, k) for k in range(len(videos))]
        rows[name] = [
            video.rows(video.motion.pushed(direction(video.motion)[..., None] * some[:, :, None]))
            for video, some in zip(videos, members, strict=True)
        ]
        if aspect.component == ALONG:  # what all groups share is the friction that the model has
            rows["beside"] = [
                np.column_stack([some, own.sum(axis=1)]) for some, own in zip(rows["beside"], rows[name], strict=True)
            ]
        here = [video.motion.moving & video.motion.tracks.seen for video in videos]
        inside = np.concatenate([some[shown] for some, shown in zip(members, here, strict=True)])
        values = np.concatenate([some[shown] for some, shown in zip(grouping.values[fit], here, strict=True)])
        middles[name] = [values[mine].mean() if mine.any() else np.nan for mine in inside.T]
    score, places = joined(one.flight.model, rows)
    everything = [place for name in middles for place in places[name]]
    part = score.of(everything, places["beside"])
    ends = np.cumsum([len(middle) for middle in middles.values()])[:-1]
    estimates, sds = np.split(part.estimate, ends), np.split(part.sd, ends)
    return [Points(np.array(m), e, sd) for m, e, sd in zip(middles.values(), estimates, sds, strict=True)]


def _spectrum(seen: Sequence[Seen]) -> str:
    """How large a shaking is missing at each frequency."""

    def sizes(one: Seen) -> Banded:
        rows = []
        for name, frequency in one.flight.scales.frequencies.items():
            part = one.flight.part(phases(name), PUSH)
            if part.score.degrees:
                by_chance = part.visible / WITHIN_95 * np.sqrt(chi2.isf(0.05, part.score.degrees))
                rows.append((frequency, part.size, 0.0, by_chance))
        at, size, low, high = np.array(rows).reshape(-1, 4).T
        return Banded(at, size, low, high)

    return with_bands(
        seen,
        [sizes(one) for one in seen],
        ("frequency (Hz)", "push to and fro (m/s²)"),
        "Root mean square of a push to and fro of all bodies that the model misses, against its frequency.",
    )


FLIGHT_FIGURES: Mapping[str, Figure] = {
    **{check: partial(_dependence, check=check) for check in ASPECTS},
    SHAKING: _spectrum,
}
"""How what a check of free flight is about is shown, by its name."""
