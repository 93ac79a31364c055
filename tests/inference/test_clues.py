"""What a video shows before anything is simulated."""

import numpy as np
import pytest

from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.scene import Body, Shape, Tracks

NOISE = 0.01


def lone(way: np.ndarray, times: np.ndarray, seed: int) -> Clues:
    """The clues of a disc that goes some way (m) along x."""
    places = np.stack([way, 0 * way], axis=1) + np.random.default_rng(seed).normal(0, NOISE, (len(times), 2))
    return Clues.of(Tracks.from_arrays("v", (Body("a", Shape.CYLINDER, 0.2),), times, places[:, None]))


@pytest.mark.parametrize("rate", [25, 100])
@pytest.mark.parametrize("seed", range(5))
def test_a_body_that_drifts_slowly_moves(rate: int, seed: int) -> None:
    """For as long as a body at rest has to stay it stays within the noise."""
    times = np.arange(5 * rate) / rate
    assert lone(0.02 * times, times, seed).moving == {0}
    assert lone(0.05 * times - 0.003 * times**2, times, seed).moving == {0}


@pytest.mark.parametrize("seed", range(60))
def test_a_body_at_rest_rests_whatever_the_noise(seed: int) -> None:
    """Also where errors of the camera wander by as much as they scatter."""
    generator, times = np.random.default_rng(seed), np.arange(125) / 25
    wander = np.cumsum(generator.normal(0, NOISE / np.sqrt(125), 125))
    assert lone(0 * times, times, seed).moving == frozenset()
    assert lone(wander, times, seed).moving == frozenset()


@pytest.mark.parametrize("rate", [25, 100])
@pytest.mark.parametrize("seed", range(5))
def test_a_body_rests_until_a_push_that_was_not_seen(rate: int, seed: int) -> None:
    times = np.arange(5 * rate) / rate
    for start in (1.0, 3.0, 9.0):
        assert lone(0.3 * np.maximum(times - start, 0.0), times, seed).moving == frozenset()
