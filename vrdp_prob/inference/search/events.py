"""Which pairs meet in a rollout, and in which order."""

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import Rollout

Pairs = tuple[tuple[int, int], ...]


def first_contacts(rollout: Rollout, world: int) -> Pairs:
    """Pairs of bodies that collide in a world, in the order of their first contact."""
    return collision_sequences(rollout)[world]


def collision_sequences(rollout: Rollout) -> list[Pairs]:
    """For every world its colliding pairs in the order of their first contact."""
    return [tuple(dict.fromkeys(contacts)) for contacts in _contacts(rollout)]


def contacts_with_fixed_things(rollout: Rollout, world: int, walls: int) -> Pairs:
    """Pairs of a body and a wall, or an obstacle that an effect adds, that meet in a world; obstacles come after walls.

    Parameters
    ----------
    rollout, world
        Where.
    walls
        Number of the walls.
    """
    events = rollout.events.of_world(world)
    found: set[tuple[int, int]] = set()
    for kind, before in ((RolloutEventKind.WALL, 0), (RolloutEventKind.OBSTACLE, walls)):
        some = events.of_kind(kind)
        found.update(zip(some.first.tolist(), (before + some.second).tolist(), strict=True))
    return tuple(sorted(found))


def courses(rollout: Rollout) -> list[Pairs]:
    """For every world its contacts in order; of a pair that meets again and again without others only the first two.

    Within one course the world changes smoothly with the unknowns; descents do not find their way from one to another.
    """
    return [
        tuple(pair for place, pair in enumerate(contacts) if contacts[max(place - 2, 0) : place] != [pair] * 2)
        for contacts in _contacts(rollout)
    ]


def courses_at(
    likelihood: Likelihood, points: Float[Tensor, "point dimension"], frame_count: int | None = None
) -> list[Pairs]:
    """The courses of the worlds of some points, over the (first) frames of the video."""
    with torch.no_grad():
        return courses(likelihood.rollout(points, frame_count))


def _contacts(rollout: Rollout) -> list[list[tuple[int, int]]]:
    """For every world the pairs of all its contacts, in order."""
    found: list[list[tuple[int, int]]] = [[] for _ in range(len(rollout.outcome))]
    events = rollout.events.of_kind(RolloutEventKind.COLLISION)
    for world, first, second in zip(events.world.tolist(), events.first.tolist(), events.second.tolist(), strict=True):
        found[world].append((first, second))
    return found
