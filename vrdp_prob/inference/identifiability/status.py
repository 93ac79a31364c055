"""What the collisions of a video can say about single masses and restitutions, and what only about combinations.

A contact fixes the ratio of two masses and the product of two restitution factors: a difference and a sum of
logarithms. On the graph of contacts, masses follow from one another but share an unknown scale, unless one was weighed.
Sums of neighbours fix single values only where the graph has an odd cycle, or touches something known.

The graph says what contacts could tell under the base model; the curvature of the posterior says how much they do, and
whether another law of the model (a force that depends on mass, say) tells the rest.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations

from vrdp_prob.inference.identifiability.information import Information, Weights
from vrdp_prob.models.parameters import MASS, RESTITUTION, WALL_RESTITUTION
from vrdp_prob.scene import Tracks
from vrdp_prob.scene.naming import wall_name

LEAST_CONTRACTION = 0.05
"""Below it the data are said to hold no information."""
FIXED_SCALE = 0.5
"""From this contraction of a group's common scale on, another law of the model is said to fix it; and from this one of
a ratio or product on, what is known of one of two that met is said to be known of the other."""


class Status(StrEnum):
    """What the data say about a parameter of a body."""

    IDENTIFIED = "identified"
    RATIO_ONLY = "ratio_only"
    PRODUCT_ONLY = "product_only"
    DEFAULT = "default"


@dataclass(frozen=True)
class ParameterStatus:
    """What the data say about one parameter of one body.

    Parameters
    ----------
    status
        `identified`, `ratio_only` (a mass, against its partners; the scale is the prior's), `product_only` (a
        restitution, times its partners'), or `default` (nothing; the default value is used).
    partners
        Ids of the bodies that a ratio or product refers to; the first wall is called `wall 1`, one that nobody states
        `the hidden wall`.
    contraction
        Share of the prior variance (of the logarithm) that the data take away; 0 for a default, 1 for a known mass.
    """

    status: Status
    partners: tuple[str, ...] = ()
    contraction: float = 0.0


@dataclass(frozen=True)
class BodyStatus:
    """What the data say about a body's mass and restitution."""

    mass: ParameterStatus
    restitution: ParameterStatus

    @property
    def is_default(self) -> bool:
        """Whether mass or restitution is a mere default."""
        return Status.DEFAULT in (self.mass.status, self.restitution.status)


@dataclass(frozen=True)
class Combination:
    """A combination of parameters of bodies that collide, and how well the data determine it.

    Parameters
    ----------
    quantity
        `mass_ratio` (first over second), `restitution_product` or `mass_scale` (the geometric mean of all masses).
    objects
        Ids of the bodies.
    relative_sd
        Posterior standard deviation of its logarithm, about its relative error.
    contraction
        Share of the prior variance of the logarithm that the data take away.
    linked
        Whether collisions tell of its objects together, directly or through others. Where they do not, the data take
        prior variance away that they tell of each object by itself.
    """

    quantity: str
    objects: tuple[str, ...]
    relative_sd: float
    contraction: float
    linked: bool = True

    @property
    def name(self) -> str:
        """In words, for example `mass ratio of objects 1 and 2`."""
        *others, last = self.objects
        return f"{self.quantity.replace('_', ' ')} of objects {', '.join(others)} and {last}"

    @property
    def determined(self) -> bool:
        """Whether the data say more about it than was believed before, of its objects together."""
        return self.linked and self.contraction >= LEAST_CONTRACTION


@dataclass(frozen=True)
class CollisionGroup:
    """Bodies that collisions link, with the combinations that matter: ratios, products, and the common scale."""

    bodies: tuple[str, ...]
    combinations: tuple[Combination, ...]


Graph = dict[str, set[str]]
Pairs = Collection[tuple[int, int]]


def identifiability(
    tracks: Tracks,
    pairs: Pairs,
    fixed: Pairs,
    information: Information,
    *,
    felt: Collection[int] = (),
    obstacles: Sequence[str] = (),
) -> dict[str, BodyStatus]:
    """Status of every body.

    Parameters
    ----------
    tracks
        The bodies, with what is known of them.
    pairs
        Pairs of bodies that collide, by index.
    fixed
        Pairs of a body and a wall, or an obstacle, that collide, by index; obstacles come after walls.
    information
        How much the data narrow the prior.
    felt
        Bodies whose free motion depends on their mass, by index. A law that has the same strength for all of them links
        their masses as collisions do.
    obstacles
        Names of the parameters that are the restitutions of obstacles.
    """
    _, with_fixed = _graphs(tracks, pairs, fixed, obstacles)
    linked, _ = _graphs(tracks, [*pairs, *combinations(sorted(felt), 2)], (), ())
    masses, restitutions = _Unknowns.masses(tracks, information), _Unknowns.restitutions(tracks, information, obstacles)
    return {
        body.id: BodyStatus(masses.status(body.id, linked), restitutions.status(body.id, with_fixed))
        for body in tracks.bodies
    }


def collision_groups(
    tracks: Tracks,
    pairs: Sequence[tuple[int, int]],
    fixed: Pairs,
    information: Information,
    obstacles: Sequence[str] = (),
) -> tuple[CollisionGroup, ...]:
    """Which combinations of masses and restitutions the data determine, group by group; arguments as above."""
    contacts, with_fixed = _graphs(tracks, pairs, fixed, obstacles)
    masses, restitutions = _Unknowns.masses(tracks, information), _Unknowns.restitutions(tracks, information, obstacles)
    names = [body.id for body in tracks.bodies]
    groups, left = [], [name for name in names if contacts[name]]
    while left:
        members = [name for name in names if name in _component(left[0], contacts)]
        left = [name for name in left if name not in members]
        found = []
        for first, second in ((i, j) for i, j in pairs if names[i] in members):
            ratio: Weights = {(MASS.name, first): 1.0, (MASS.name, second): -1.0}
            product: Weights = {(RESTITUTION.name, first): 1.0, (RESTITUTION.name, second): 1.0}
            both = (names[first], names[second])
            for quantity, weights, unknowns, graph in (
                ("mass_ratio", ratio, masses, contacts),
                ("restitution_product", product, restitutions, with_fixed),
            ):
                linked = unknowns.told_together(*both, graph)
                found.append(replace(_combination(quantity, both, weights, information), linked=linked))
        scale: Weights = {(MASS.name, names.index(name)): 1 / len(members) for name in members}
        found.append(_combination("mass_scale", tuple(members), scale, information))
        groups.append(CollisionGroup(tuple(members), tuple(found)))
    return tuple(groups)


def uninformed(
    tracks: Tracks,
    pairs: Pairs,
    fixed: Pairs,
    information: Information,
    *,
    felt: Collection[int] = (),
    obstacles: Sequence[str] = (),
) -> frozenset[int]:
    """Bodies that collide, but of whose mass and restitution that says nothing, for example as it was too late."""
    contacts, with_fixed = _graphs(tracks, pairs, fixed, obstacles)
    masses, restitutions = _Unknowns.masses(tracks, information), _Unknowns.restitutions(tracks, information, obstacles)
    return frozenset(
        index
        for index, body in enumerate(tracks.bodies)
        if restitutions.says_nothing(body.id, with_fixed[body.id])
        and (body.mass is not None or index in felt or masses.says_nothing(body.id, contacts[body.id]))
    )


def _combination(quantity: str, objects: tuple[str, ...], weights: Weights, information: Information) -> Combination:
    return Combination(quantity, objects, information.sd(weights), information.contraction(weights))


def _graphs(tracks: Tracks, pairs: Pairs, fixed: Pairs, obstacles: Sequence[str]) -> tuple[Graph, Graph]:
    """Contacts between bodies, and the same with those of walls and obstacles."""
    names = [body.id for body in tracks.bodies]
    contacts = _graph(names, ((names[i], names[j]) for i, j in pairs))
    fixed_names = [*(wall_name(index) for index in range(len(tracks.walls))), *map(_obstacle_name, obstacles)]
    told = ((names[i], fixed_names[k]) for i, k in fixed if k < len(fixed_names))
    with_fixed = _graph([*names, *fixed_names], told)
    for name, partners in contacts.items():
        with_fixed[name] |= partners
    return contacts, with_fixed


def _obstacle_name(restitution: str) -> str:
    """Name in words of an obstacle by the name of its restitution."""
    return f"the {restitution.removesuffix('_restitution').replace('_', ' ')}"


def _graph(names: Iterable[str], edges: Iterable[tuple[str, str]]) -> Graph:
    graph: Graph = {name: set() for name in names}
    for first, second in edges:
        graph[first].add(second)
        graph[second].add(first)
    return graph


def _component(name: str, graph: Graph) -> dict[str, int]:
    """Everything connected to a node, with its distance."""
    distance, queue = {name: 0}, [name]
    while queue:
        current = queue.pop(0)
        for other in graph[current]:
            if other not in distance:
                distance[other] = distance[current] + 1
                queue.append(other)
    return distance


@dataclass(frozen=True)
class _Unknowns:
    """The masses of bodies, or the restitutions of bodies and fixed things, and what contacts say of two together.

    Parameters
    ----------
    information
        How much the data narrow the prior.
    keys
        Their names among the coordinates, by that of the body, wall or obstacle.
    sign
        -1 where a contact tells a ratio, 1 where it tells a product.
    together
        What is said of one that is known with others only.
    known
        Bodies or walls whose value was given.
    """

    information: Information
    keys: Mapping[str, tuple[str, int | None]]
    sign: float
    together: Status
    known: frozenset[str]

    @classmethod
    def masses(cls, tracks: Tracks, information: Information) -> "_Unknowns":
        keys: dict[str, tuple[str, int | None]] = {body.id: (MASS.name, k) for k, body in enumerate(tracks.bodies)}
        known = frozenset(body.id for body in tracks.bodies if body.mass is not None)
        return cls(information, keys, -1.0, Status.RATIO_ONLY, known)

    @classmethod
    def restitutions(cls, tracks: Tracks, information: Information, obstacles: Sequence[str]) -> "_Unknowns":
        keys: dict[str, tuple[str, int | None]] = {
            body.id: (RESTITUTION.name, index) for index, body in enumerate(tracks.bodies)
        }
        keys |= {wall_name(index): (WALL_RESTITUTION.name, index) for index in range(len(tracks.walls))}
        keys |= {_obstacle_name(name): (name, None) for name in obstacles}
        known = {wall_name(index) for index, wall in enumerate(tracks.walls) if wall.restitution is not None}
        return cls(information, keys, 1.0, Status.PRODUCT_ONLY, frozenset(known))

    def contraction(self, *names: str) -> float:
        """That of one, or of the ratio or product of two."""
        weights = (1.0, self.sign)[: len(names)]
        return self.information.contraction({self.keys[one]: w for one, w in zip(names, weights, strict=True)})

    def says_nothing(self, name: str, partners: Collection[str]) -> bool:
        """Whether the data say nothing of one, neither by itself nor together with one that it met."""
        together = max((self.contraction(name, other) for other in partners), default=0.0)
        return max(self.contraction(name), together) < LEAST_CONTRACTION

    def link(self, name: str, other: str) -> float:
        """How far a contact ties two together: the contraction that it would make of two equally unknown ones.

        What is told of either by itself does not count, so a graze between two that are well known is no link. With
        something known the tie is what is told of the other one, whoever has told that.
        """
        if other in self.known or name in self.known:
            return self.contraction(name, other)
        first, second = self.keys[name], self.keys[other]
        apart = self.information.sd({first: 1.0}) ** 2 + self.information.sd({second: 1.0}) ** 2
        share = 1 - self.information.sd({first: 1.0, second: self.sign}) ** 2 / apart if apart > 0 else 0.0
        return 2 * share / (1 + share) if share > 0 else 0.0

    def told_together(self, name: str, other: str, graph: Graph) -> bool:
        """Whether contacts tell the ratio or product of two: through a chain of ties, or as both are told.

        A chain of products tells that of its ends where it has an odd number of them, and their ratio elsewhere.
        """
        ties = {
            one: {partner for partner in partners if self.link(one, partner) >= LEAST_CONTRACTION}
            for one, partners in graph.items()
        }
        steps = _component(name, ties).get(other)
        chained = steps is not None and (self.sign < 0 or steps % 2 == 1)
        return chained or all(one in self.known or self._is_fixed(one, graph) for one in (name, other))

    def status(self, name: str, graph: Graph) -> ParameterStatus:
        """What the data say of one."""
        if name in self.known:
            return ParameterStatus(Status.IDENTIFIED, contraction=1.0)
        partners = [other for other in sorted(graph[name]) if self.link(name, other) >= LEAST_CONTRACTION]
        contraction = self.contraction(name)
        if not partners and contraction < LEAST_CONTRACTION:
            return ParameterStatus(Status.DEFAULT)
        if self._is_fixed(name, graph):
            return ParameterStatus(Status.IDENTIFIED, contraction=contraction)
        return ParameterStatus(self.together, tuple(one for one in partners if one not in self.known), contraction)

    def _is_fixed(self, name: str, graph: Graph) -> bool:
        """Whether the common scale of what hangs together through clear contacts of unknowns is told.

        Less is enough where it touches something known; and round an odd ring products tell each of their factors.
        """
        clear: Graph = {
            one: {other for other in partners if other not in self.known and self.link(one, other) >= FIXED_SCALE}
            for one, partners in graph.items()
            if one not in self.known
        }
        distance = _component(name, clear)
        if self.sign > 0 and any(distance[one] % 2 == distance[other] % 2 for one in distance for other in clear[one]):
            return True
        touches = any(partner in self.known for one in distance for partner in graph[one])
        told = self.information.contraction({self.keys[one]: (-self.sign) ** steps for one, steps in distance.items()})
        return told >= (LEAST_CONTRACTION if touches else FIXED_SCALE)
