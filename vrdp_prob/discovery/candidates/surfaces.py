"""Walls and discs that nobody states, where turns of several bodies or at several times fit one of them."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares
from scipy.spatial.distance import pdist

from vrdp_prob.discovery.candidates.turns import Turn, sudden_turns
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.places import Region, paths_of_bodies
from vrdp_prob.models.effects.wall import HALF_LENGTH, Wall
from vrdp_prob.models.parameters import Parameter, Prior
from vrdp_prob.models.roughness import noise_scale
from vrdp_prob.scene import Tracks
from vrdp_prob.scene import Wall as SceneWall

FEWEST = 2
"""Turns that a wall or a disc must explain: a single one has any number of either."""
MOST_TURNS = 200
"""Turns, the plainest first, that are looked at."""
MOST_OF_THEM = 2 / 3
"""Share of the turns that all walls and discs must explain, for it to be these that bodies meet."""
NOISES, SIZES = 4.0, 0.1
"""Standard deviations of a position, and share of a body's size, by which a surface may be missed."""
RUBBED, DEVIATIONS = 0.2, 3.0
"""Angle in rad by which friction turns a rebound from square, and standard deviations of its direction beyond that."""
CROSSINGS = 0.002
"""Share of all positions that may lie behind a surface."""
SIZE_SD = 0.3
"""Standard deviation of the log radius of a disc where a search begins."""


@dataclass(frozen=True)
class Line:
    """A straight line, by its distance in m from the origin and the direction to it in rad."""

    distance: float
    direction: float

    @property
    def values(self) -> tuple[float, float]:
        """Its numbers in the order of the parameters of a wall."""
        return self.distance, self.direction

    @property
    def wall(self) -> SceneWall:
        """It as a wall that ends nowhere that a body gets to."""
        middle, along = self.distance * self.normal, HALF_LENGTH * np.array([-self.normal[1], self.normal[0]])
        return SceneWall(*(middle - along).tolist(), *(middle + along).tolist())

    @property
    def normal(self) -> Float[np.ndarray, "2"]:
        """Unit vector along the direction."""
        return np.array([math.cos(self.direction), math.sin(self.direction)])

    def towards(
        self, places: Float[np.ndarray, "place 2"], into: Float[np.ndarray, "place 2"]
    ) -> tuple[Float[np.ndarray, "place 2"], Float[np.ndarray, "place"]]:
        """Unit vectors from places to the line, on whichever side they were pushed from, and distances in m."""
        side = np.where(into @ self.normal >= 0, 1.0, -1.0)
        return side[:, None] * self.normal, side * (self.distance - places @ self.normal)

    def behind(self, path: Float[np.ndarray, "place 2"], within: float) -> int:
        """Places of a path that lie across the line from the others, or nearer to it than `within` m."""
        ahead = self.distance - path @ self.normal
        return int(min((ahead < within).sum(), (ahead > -within).sum()))


@dataclass(frozen=True)
class Circle:
    """A circle, by its middle and its radius in m."""

    x: float
    y: float
    radius: float

    @property
    def values(self) -> tuple[float, float, float]:
        """Its numbers in the order of the parameters of a disc."""
        return self.x, self.y, self.radius

    def towards(
        self, places: Float[np.ndarray, "place 2"], into: Float[np.ndarray, "place 2"]
    ) -> tuple[Float[np.ndarray, "place 2"], Float[np.ndarray, "place"]]:
        """Unit vectors from places to the circle, from which bodies are pushed outwards, and distances in m."""
        ahead = np.array([self.x, self.y]) - places
        far = np.maximum(np.linalg.norm(ahead, axis=1), 1e-12)
        return ahead / far[:, None], far - self.radius

    def behind(self, path: Float[np.ndarray, "place 2"], within: float) -> int:
        """Places of a path that lie inside, or nearer to it than `within` m."""
        return int((np.linalg.norm(path - (self.x, self.y), axis=1) - self.radius < within).sum())


Surface = Line | Circle


@dataclass(frozen=True)
class Seen:
    """A surface that bodies bounce off.

    Parameters
    ----------
    surface
        Where it is.
    slack
        Distance in m by which it may miss the edge of a body.
    turns
        Number of the turns that it explains.
    share
        The same as a share of all turns.
    span
        Distance in m between those of them that are farthest apart.
    """

    surface: Surface
    slack: float
    turns: int
    share: float
    span: float

    @property
    def spread(self) -> tuple[float, ...]:
        """By how much each of its numbers may be off: a distance in m, a direction in rad, a size by its logarithm."""
        if isinstance(self.surface, Circle):
            return self.slack, self.slack, SIZE_SD
        return self.slack, min(RUBBED, self.slack / self.span if self.span else RUBBED)


def seen_surfaces(videos: Sequence[Tracks]) -> list[Seen]:
    """What bodies bounce off, that which explains most turns first."""
    seen = sudden_turns(videos)[:MOST_TURNS]
    if len(seen) < FEWEST:
        return []
    paths, edges, largest = paths_of_bodies(videos), _Edges.of(seen), Region.of(videos).half_width
    # Sorting is stable: of those that explain equally many a wall comes before a disc, which has more parameters.
    candidates: list[Surface] = [*_lines(seen), *_circles(seen, largest)]
    met = np.array([edges.met(one) for one in candidates])
    left, found = np.ones(len(seen), dtype=bool), list[Seen]()

    @cache
    def crossed(number: int) -> bool:
        return _crossed(candidates[number], paths, edges)

    while True:
        counts = (met & left).sum(axis=1)
        ranked = [k for k in np.argsort(-counts, kind="stable").tolist() if counts[k] >= FEWEST]
        chosen = next((k for k in ranked if not crossed(k)), None)
        if chosen is None:
            return found
        mine = met[chosen] & left
        touching = list(itertools.compress(seen, mine))
        surface, refined = candidates[chosen], _refined(candidates[chosen], touching)
        is_one = not isinstance(refined, Circle) or 0 < refined.radius < largest
        if is_one and _Edges.of(touching).met(refined).all() and not _crossed(refined, paths, edges):
            surface = refined
        turns = int(mine.sum())
        slack, span = float(np.median(edges.slack[mine])), float(pdist(edges.place[mine]).max())
        found.append(Seen(surface, slack, turns, turns / len(seen), span))
        left &= ~mine


@dataclass(frozen=True)
class Placed:
    """A wall or disc of a catalogue where tracks show one.

    Parameters
    ----------
    effect
        The wall or disc.
    seen
        Where, and by how many turns.
    """

    effect: Wall | HiddenObstacle
    seen: Seen

    @property
    def wall(self) -> SceneWall | None:
        """It as a stated wall; None for a disc, which nobody can state."""
        return self.seen.surface.wall if isinstance(self.seen.surface, Line) else None

    @property
    def start(self) -> dict[str, float]:
        """Where its place (and size) are, by the names of its parameters; no surface tells of its restitution."""
        values = self.seen.surface.values
        return {one.name: value for one, value in zip(self.effect.parameters[:-1], values, strict=True)}

    @property
    def near(self) -> dict[str, Parameter]:
        """The same as beliefs, with which a search begins."""
        numbers = zip(self.effect.parameters[:-1], self.seen.surface.values, self.seen.spread, strict=True)
        return {one.name: _around(one, value, sd) for one, value, sd in numbers}


def surfaces_unknown_to(fit: SharedFit, catalogue: Sequence[Effect]) -> list[Placed]:
    """Walls and discs of a catalogue that the tracks show, where nothing unseen is in the model of a fit."""
    if any(effect.overrides("obstacles") for effect in fit.model.effects):
        return []
    return placed_surfaces(fit.tracks, catalogue)


def placed_surfaces(videos: Sequence[Tracks], catalogue: Sequence[Effect]) -> list[Placed]:
    """Walls and discs of a catalogue that stand where tracks show them.

    None where a good part of the turns has no part in any of them: then it is something else that turns bodies.

    Parameters
    ----------
    videos
        What was seen.
    catalogue
        Causes that are looked for; of further walls and discs than it holds nothing is said.
    """
    further = [effect for effect in catalogue if isinstance(effect, Wall | HiddenObstacle)]
    found: list[Placed] = []
    for seen in seen_surfaces(videos) if further else []:
        kind = Wall if isinstance(seen.surface, Line) else HiddenObstacle
        there = {None, *(one.effect.name for one in found)}
        effect = next((one for one in further if isinstance(one, kind) and one.follows in there), None)
        if effect is not None:
            further.remove(effect)
            found.append(Placed(effect, seen))
    return found if sum(one.seen.share for one in found) >= MOST_OF_THEM else []


def as_stated(tracks: Tracks, walls: Sequence[Placed]) -> Tracks:
    """Tracks that state walls, and of positions how far off the walls may be beside the noise.

    Raises
    ------
    InputError
        If a wall overlaps a body where that is first seen.
    """
    rough = np.nan_to_num(noise_scale(tracks)) ** 2 * np.eye(2)
    stated = np.nan if tracks.position_covariance is None else tracks.position_covariance
    unsure = float(np.mean([one.seen.slack for one in walls])) / NOISES
    covariance = np.where(np.isfinite(stated), stated, np.broadcast_to(rough, (*tracks.positions.shape, 2)))
    covariance = covariance + unsure**2 * np.eye(2)
    axes = ("time", "body", "axis", "axis_other")
    data = tracks.data.assign(position_covariance=(axes, covariance, {"units": "m^2"}))
    return replace(tracks, walls=(*tracks.walls, *(one.wall for one in walls if one.wall is not None)), data=data)


def _around(parameter: Parameter, value: float, sd: float) -> Parameter:
    """A parameter that is believed to be near a value."""
    return replace(parameter, prior=Prior(parameter.transform.to_coordinate(value), sd), default=value)


@dataclass(frozen=True)
class _Edges:
    """Turns as a surface meets them.

    Parameters
    ----------
    place, into
        Where the centre of each body was in m, and in which direction its velocity was taken.
    slack
        Distance in m by which a surface may miss its edge.
    least, most
        Smallest and largest distance in m from its centre to its edge.
    leaning
        Angle in rad by which it may have turned from square.
    """

    place: Float[np.ndarray, "turn 2"]
    into: Float[np.ndarray, "turn 2"]
    slack: Float[np.ndarray, "turn"]
    least: Float[np.ndarray, "turn"]
    most: Float[np.ndarray, "turn"]
    leaning: Float[np.ndarray, "turn"]

    @classmethod
    def of(cls, seen: Sequence[Turn]) -> "_Edges":
        """The edges of some turns."""
        return cls(
            np.array([one.place for one in seen]),
            np.array([one.into for one in seen]),
            np.array([NOISES * one.place_sd + SIZES * one.least for one in seen]),
            np.array([one.least for one in seen]),
            np.array([one.most for one in seen]),
            np.array([RUBBED + DEVIATIONS * one.direction_sd for one in seen]),
        )

    def met(self, surface: Surface) -> Bool[np.ndarray, "turn"]:
        """Which turns are at a surface, and away from it."""
        directions, far = surface.towards(self.place, self.into)
        turned = np.arccos(np.clip((directions * self.into).sum(axis=1), -1.0, 1.0))
        near: np.ndarray = (far > self.least - self.slack) & (far < self.most + self.slack)
        return near & (turned < self.leaning)


def _crossed(surface: Surface, paths: Sequence[tuple[float, list[Float[np.ndarray, "_ 2"]]]], edges: _Edges) -> bool:
    """Whether bodies go through a surface."""
    slack = float(np.median(edges.slack))
    behind = sum(surface.behind(part, radius - slack) for radius, parts in paths for part in parts)
    return behind > CROSSINGS * sum(len(part) for _, parts in paths for part in parts)


def _lines(seen: Sequence[Turn]) -> Iterator[Line]:
    """Lines square to one of the turns, and those that touch two of them."""
    for one in seen:
        yield Line(float(one.place @ one.into) + one.least, math.atan2(one.into[1], one.into[0]))
    for one, other in itertools.combinations(seen, 2):
        aligned = float(one.into @ other.into)
        apart = other.place - one.place
        far = float(np.linalg.norm(apart))
        if abs(aligned) < math.cos(2 * RUBBED + DEVIATIONS * (one.direction_sd + other.direction_sd)) or far == 0:
            continue
        higher = one.least - math.copysign(other.least, aligned)  # of the other place, along the normal
        if abs(higher) > far:
            continue
        across, turn = math.atan2(apart[1], apart[0]), math.acos(higher / far)
        directions = [across + turn, across - turn]
        direction = max(directions, key=lambda at: one.into @ np.array([math.cos(at), math.sin(at)]))
        normal = Line(0.0, direction).normal
        yield Line(float(one.place @ normal) + one.least, math.remainder(direction, math.tau))


def _circles(seen: Sequence[Turn], largest: float) -> Iterator[Circle]:
    """Circles that touch two of the turns, each where it was turned squarely."""
    for one, other in itertools.combinations(seen, 2):
        design = np.concatenate([np.column_stack([np.eye(2), -turned.into]) for turned in (one, other)])
        edges = np.concatenate([turned.place + turned.least * turned.into for turned in (one, other)])
        (x, y, radius), *_ = np.linalg.lstsq(design, edges, rcond=None)
        if 0 < radius < largest:
            yield Circle(float(x), float(y), float(radius))


def _refined(surface: Surface, touching: Sequence[Turn]) -> Surface:
    """The line or circle of the same kind that the edges of bodies are nearest to."""
    edges = _Edges.of(touching)
    middle, noise = (edges.least + edges.most) / 2, edges.slack + (edges.most - edges.least) / 2
    kind = type(surface)
    found = least_squares(
        lambda values: (kind(*values).towards(edges.place, edges.into)[1] - middle) / noise, surface.values
    ).x.tolist()
    return Line(found[0], math.remainder(found[1], math.tau)) if kind is Line else kind(*found)
