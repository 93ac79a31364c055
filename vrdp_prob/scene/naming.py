"""Objects in words, told apart by what they look like."""

from collections import Counter
from collections.abc import Callable, Sequence

from vrdp_prob.scene.body import Body, Shape


def names(bodies: Sequence[Body]) -> dict[str, str]:
    """Name in words of each body by id: the shortest description that fits it alone, else its shape and id."""
    ways: tuple[Callable[[Body], tuple[str | None, ...]], ...] = (
        lambda body: (body.color, str(body.shape)),
        lambda body: (body.material, str(body.shape)),
        lambda body: (body.color, body.material, str(body.shape)),
    )
    found: dict[str, str] = {}
    for way in ways:
        count = Counter(way(body) for body in bodies)
        for body in bodies:
            description = way(body)
            if body.id not in found and None not in description and count[description] == 1:
                found[body.id] = " ".join(part for part in description if part)
    return {body.id: found.get(body.id, _by_id(body)) for body in bodies}


def wall_name(index: int) -> str:
    """Name in words of a wall by its place among those of a video: the first one is `wall 1`."""
    return f"wall {index + 1}"


def _by_id(body: Body) -> str:
    if body.id.isdigit():
        return " ".join(part for part in (body.color, str(body.shape), body.id) if part)
    return f"{body.shape} “{body.id}”" if body.shape is not Shape.CYLINDER else f"“{body.id}”"
