"""What every contact and every rollout must keep."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, energy, random_worlds
from vrdp_prob.models.effects.effect import BodyView
from vrdp_prob.models.effects.normal_impact import NormalImpact
from vrdp_prob.models.simulator.contact import ContactKind, Feature, contact, contact_geometry
from vrdp_prob.models.simulator.rollout import simulate

MIXES = [(DISC, SPHERE, DISC, DISC), (CUBE, DISC, CUBE, SPHERE), (CUBE, CUBE, CUBE)]


def _body(generator: np.random.Generator) -> BodyView:
    x, y, angle, vx, vy, spin = generator.normal(size=6)
    mass, inertia = generator.lognormal(size=2)
    return BodyView(x, y, angle, vx, vy, spin, np.hypot(vx, vy), mass, 1 / mass, 1 / inertia, 0.9, 0.2, 0.0)


@pytest.mark.parametrize("kind", ContactKind)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=200, deadline=None)
def test_a_contact_keeps_momentum_and_angular_momentum(kind: ContactKind, seed: int) -> None:
    generator = np.random.default_rng(seed)
    a, b = _body(generator), _body(generator)
    direction = generator.uniform(0, 2 * np.pi)
    of_a = Feature(np.cos(direction), np.sin(direction), 1.0) if kind is ContactKind.LINE_POINT else Feature(1, -1, 0)
    geometry = contact_geometry(kind, a, b, of_a, Feature(1.0, 1.0, 0.0))
    result = contact((NormalImpact(),), geometry, a, b, {})
    before = np.array([[a.vx, a.vy, a.spin], [b.vx, b.vy, b.spin]])
    after = np.array([result.a, result.b])
    mass, inertia = np.array([a.mass, b.mass]), 1 / np.array([a.inverse_inertia, b.inverse_inertia])
    place = np.array([[a.x, a.y], [b.x, b.y]])
    change = after - before
    momentum = mass[:, None] * change[:, :2]
    size = np.abs(mass[:, None] * before[:, :2]).max() + np.abs(momentum).max()
    assert np.abs(momentum.sum(0)).max() <= 1e-12 * size
    turning = inertia * change[:, 2] + place[:, 0] * momentum[:, 1] - place[:, 1] * momentum[:, 0]
    size = (size * np.abs(place).max()) + np.abs(inertia * before[:, 2]).max() + np.abs(turning).max()
    assert abs(turning.sum()) <= 1e-12 * size


@pytest.mark.parametrize("shapes", MIXES)
def test_energy_never_grows(shapes: tuple[object, ...]) -> None:
    worlds = random_worlds(20, shapes, seed=5, walls=True)
    rollout = simulate(worlds, FRAMES)
    assert energy(worlds, rollout).diff(dim=1).max() <= 1e-10


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_free_bodies_keep_momentum_and_energy(seed: int) -> None:
    worlds = random_worlds(1, (CUBE, DISC, CUBE), seed, walls=False)
    worlds = type(worlds)(
        **{
            **{name: getattr(worlds, name) for name in worlds.__dataclass_fields__},
            "parameters": {name: 0 * value for name, value in worlds.parameters.items()},
            "restitution": torch.ones_like(worlds.restitution),
        }
    )
    rollout = simulate(worlds, FRAMES[::16])
    momentum = (worlds.mass[:, None, :, None] * rollout.velocity[..., :2]).sum(2)
    assert torch.allclose(momentum, momentum[:, :1], atol=1e-11)
    total = energy(worlds, rollout)
    assert torch.allclose(total, total[:, :1], rtol=1e-10)
    assert len(rollout.events.of_world(0)) == len(rollout.events)
