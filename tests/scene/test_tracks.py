"""What tracks refuse."""

import numpy as np
import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Body, Shape, Tracks


@pytest.mark.parametrize(("value", "sentence"), [(1e300, "1e.300 m away, farther than 1e.06 m"), (np.inf, "infinite")])
def test_positions_that_are_none_are_refused(value: float, sentence: str) -> None:
    bodies = (Body("a", Shape.SPHERE, 0.1), Body("b", Shape.SPHERE, 0.1))
    positions = np.stack([np.zeros((4, 2)), np.ones((4, 2))], axis=1)
    positions[2, 1, 0] = value
    with pytest.raises(InputError, match=f"the position of object b at 2 s is {sentence}"):
        Tracks.from_arrays("v", bodies, np.arange(4.0), positions)
