"""How far the search for contacts may step: the compiled functions, run as Python."""

import math
from types import ModuleType, SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from jaxtyping import Float

from vrdp_prob.models.simulator import detection_kernel, search_kernel
from vrdp_prob.models.simulator.detection_kernel import ANGLE_FIRST, CONTACT_TIME
from vrdp_prob.models.simulator.world_kernel import LENGTH, RADIUS, SQUARE, WALL

KERNELS: tuple[ModuleType, ...] = (detection_kernel, search_kernel)
SHARES = np.linspace(0.0, 1.0, 401)
HALF = 0.2
"""Half the side of the square in m."""


@pytest.fixture(autouse=True)
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions that call each other as Python: they are compiled without a way to call them from outside."""
    for kernel in KERNELS:
        for name, function in list(vars(kernel).items()):
            if hasattr(function, "py_func"):
                monkeypatch.setattr(kernel, name, function.py_func)


def _pairs() -> SimpleNamespace:
    return SimpleNamespace(local=np.zeros((11, 8)), table=np.zeros((2, 2, 12)))


def _world(shapes: tuple[int, int]) -> SimpleNamespace:
    body, clock = np.zeros((2, 6)), np.zeros((2, 6))
    body[:, RADIUS], clock[:, LENGTH] = HALF, 1.0
    kind, phase = np.zeros((2, 3), dtype=int), np.zeros((2, 7))
    kind[:, 0] = shapes
    return SimpleNamespace(body=body, clock=clock, kind=kind, phase=phase, polynomial=np.zeros((2, 8, 8)))


def _values(coefficients: Float[np.ndarray, "power"]) -> Float[np.ndarray, "share"]:
    return np.polynomial.polynomial.polyval(SHARES, coefficients)


@pytest.mark.parametrize("own", [0, 1])
@pytest.mark.parametrize("seed", range(20))
def test_no_rate_falls_faster_than_its_bound(own: int, seed: int) -> None:
    """Of the gap between a side of one of two squares that turn and bend their way, and a corner of the other."""
    generator = np.random.default_rng(seed)
    pairs, world = _pairs(), _world((SQUARE, SQUARE))
    fading = 0.5 ** np.arange(8)
    for row in (0, 1, ANGLE_FIRST, ANGLE_FIRST + 1):
        pairs.local[row] = generator.standard_normal(8) * fading * generator.choice([0.0, 1.0], 8)
    search_kernel.set_bounds(world, pairs, 0, 1)
    sign = 1.0 - 2.0 * own
    x, y = sign * _values(pairs.local[0]), sign * _values(pairs.local[1])
    angle, other = _values(pairs.local[ANGLE_FIRST + own]), _values(pairs.local[ANGLE_FIRST + 1 - own])
    side, corner = generator.integers(4) * math.pi / 2, math.pi / 4 + generator.integers(4) * math.pi / 2
    outer = HALF * math.sqrt(2.0)
    px, py = x + outer * np.cos(other + corner), y + outer * np.sin(other + corner)
    gap = np.cos(angle + side) * px + np.sin(angle + side) * py
    fastest = -np.diff(gap, 2).min() / np.diff(SHARES)[0] ** 2
    for place in (0, 200, 400):
        direction = angle[place] + side
        bound = detection_kernel.fall_along(pairs, own, math.cos(direction), math.sin(direction))
        assert fastest <= bound * (1 + 1e-6) + 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_no_two_points_come_nearer_than_the_bound_says(seed: int) -> None:
    generator = np.random.default_rng(seed)
    pairs, world = _pairs(), _world((SQUARE, SQUARE))
    for row in (0, 1):
        pairs.local[row] = generator.standard_normal(8) * 0.5 ** np.arange(8)
    search_kernel.set_bounds(world, pairs, 0, 1)
    x, y = _values(pairs.local[0]), _values(pairs.local[1])
    distance, rate = np.hypot(x, y), (x * np.gradient(x, SHARES) + y * np.gradient(y, SHARES)) / np.hypot(x, y)
    for place in (0, 100, 200):
        fall = detection_kernel.fall_along(pairs, 0, x[place] / distance[place], y[place] / distance[place])
        later = SHARES[place:] - SHARES[place]
        least = distance[place] + rate[place] * later - fall * later**2 / 2
        assert (distance[place:] >= least - 1e-2 * later).all()  # the rate is a difference of places


@pytest.mark.parametrize("gap", [1.8e-12, 1e-9, 1e-6])
def test_a_square_that_is_slowed_along_a_wall_is_not_looked_at_again_and_again(
    gap: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, pairs = _world((SQUARE, WALL)), _pairs()
    turned = 0.3
    world.body[1, RADIUS] = 2.0
    world.polynomial[0, 0, :3] = -0.5, HALF * (math.cos(turned) + math.sin(turned)) + gap, turned
    world.polynomial[0, 1, 0], world.polynomial[0, 2, 0] = 1.0, -0.4
    looking = Mock(side_effect=search_kernel.look)
    monkeypatch.setattr(search_kernel, "look", looking)
    search_kernel.search(world, pairs, 0, 1, 0.0, 1.0)
    assert pairs.table[0, 1, CONTACT_TIME] == math.inf
    assert looking.call_count <= 3
