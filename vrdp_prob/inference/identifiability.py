"""What the collisions of a video can say about single masses and restitutions, and what only about combinations.

A contact fixes the ratio of two masses and the product of two restitution factors: a difference and a sum of
logarithms. On the graph of contacts, masses follow from one another but share an unknown scale, unless one was weighed.
Sums of neighbours fix single values only where the graph has an odd cycle, or touches something known.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from vrdp_prob.scene import Tracks


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
        Ids of the bodies that a ratio or product refers to; a wall is called `wall N`.
    """

    status: Status
    partners: tuple[str, ...] = ()


@dataclass(frozen=True)
class BodyStatus:
    """What the data say about a body's mass and restitution."""

    mass: ParameterStatus
    restitution: ParameterStatus

    @property
    def is_default(self) -> bool:
        """Whether mass or restitution is a mere default."""
        return Status.DEFAULT in (self.mass.status, self.restitution.status)


Graph = dict[str, set[str]]


def identifiability(
    tracks: Tracks, pairs: Iterable[tuple[int, int]], walls: Iterable[tuple[int, int]]
) -> dict[str, BodyStatus]:
    """Status of every body.

    Parameters
    ----------
    tracks
        The bodies, with what is known of them.
    pairs
        Pairs of bodies that collide, by index.
    walls
        Pairs of a body and a wall that collide, by index.
    """
    names = [body.id for body in tracks.bodies]
    contacts = _graph(names, ((names[i], names[j]) for i, j in pairs))
    wall_names = [f"wall {index}" for index in range(len(tracks.walls))]
    with_walls = _graph([*names, *wall_names], ((names[i], wall_names[k]) for i, k in walls))
    for name, partners in contacts.items():
        with_walls[name] |= partners
    weighed = {body.id for body in tracks.bodies if body.mass is not None}
    known_walls = {name for name, wall in zip(wall_names, tracks.walls, strict=True) if wall.restitution is not None}
    return {
        name: BodyStatus(_mass_status(name, contacts, weighed), _restitution_status(name, with_walls, known_walls))
        for name in names
    }


def _graph(names: Iterable[str], edges: Iterable[tuple[str, str]]) -> Graph:
    graph: Graph = {name: set() for name in names}
    for first, second in edges:
        graph[first].add(second)
        graph[second].add(first)
    return graph


def _component(name: str, graph: Graph) -> dict[str, int]:
    """Everything connected to a node, with the parity of its distance."""
    distance, queue = {name: 0}, [name]
    while queue:
        current = queue.pop(0)
        for other in graph[current]:
            if other not in distance:
                distance[other] = distance[current] + 1
                queue.append(other)
    return distance


def _mass_status(name: str, graph: Graph, weighed: set[str]) -> ParameterStatus:
    if name in weighed:
        return ParameterStatus(Status.IDENTIFIED)
    if not graph[name]:
        return ParameterStatus(Status.DEFAULT)
    if weighed & _component(name, graph).keys():
        return ParameterStatus(Status.IDENTIFIED)
    return ParameterStatus(Status.RATIO_ONLY, tuple(sorted(graph[name])))


def _restitution_status(name: str, graph: Graph, known: set[str]) -> ParameterStatus:
    if not graph[name]:
        return ParameterStatus(Status.DEFAULT)
    component = _component(name, graph)
    odd_cycle = any(component[first] % 2 == component[second] % 2 for first in component for second in graph[first])
    if odd_cycle or known & component.keys():
        return ParameterStatus(Status.IDENTIFIED)
    return ParameterStatus(Status.PRODUCT_ONLY, tuple(sorted(graph[name])))
