"""What tracks refuse."""

import numpy as np
import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Body, Shape, Tracks, Wall


@pytest.mark.parametrize(("value", "sentence"), [(1e300, "1e.300 m away, farther than 1e.06 m"), (np.inf, "infinite")])
def test_positions_that_are_none_are_refused(value: float, sentence: str) -> None:
    bodies = (Body("a", Shape.SPHERE, 0.1), Body("b", Shape.SPHERE, 0.1))
    positions = np.stack([np.zeros((4, 2)), np.ones((4, 2))], axis=1)
    positions[2, 1, 0] = value
    with pytest.raises(InputError, match=f"the position of object b at 2 s is {sentence}"):
        Tracks.from_arrays("v", bodies, np.arange(4.0), positions)


@pytest.mark.parametrize(
    ("wall", "distance"),
    [
        (Wall(-1.0, 0.05, 1.0, 0.05), 0.05),
        (Wall(0.0, 1.0, 0.0, 0.03), 0.03),
        (Wall(0.0, 1.0, 0.0, 0.08), None),
        (Wall(1.0, 0.05, 2.0, 0.05), None),
    ],
    ids=["through it", "an end in it", "as near as noise may put it", "beside it"],
)
def test_a_body_that_begins_in_a_wall_is_refused(wall: Wall, distance: float | None) -> None:
    places = np.stack([np.linspace(0.0, -1.0, 5), np.zeros(5)], axis=1)[:, None]
    arguments = ("v", (Body("a", Shape.CYLINDER, 0.1),), np.arange(5) * 0.04, places)
    if distance is None:
        assert Tracks.from_arrays(*arguments, walls=(wall,)).walls
        return
    with pytest.raises(InputError, match=rf"v: object a overlaps the wall .* \(centre {distance:g} m from it"):
        Tracks.from_arrays(*arguments, walls=(wall,))
