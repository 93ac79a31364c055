"""What every contact and every rollout must keep."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.simulator.comparison import scenes
from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, energy, random_worlds, tensor
from tests.simulator.test_reference import EXTENDED
from vrdp_prob.models.effects.effect import BodyView
from vrdp_prob.models.effects.normal_impact import NormalImpact
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.contact import ContactKind, Feature, contact, contact_geometry
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape

SHORTLY = 1e-6


def _body(generator: np.random.Generator) -> BodyView:
    x, y, angle, vx, vy, spin = generator.normal(size=6)
    mass, inertia = generator.lognormal(size=2)
    return BodyView(x, y, angle, vx, vy, spin, np.hypot(vx, vy), mass, 1 / mass, 1 / inertia, 0.9, 0.2, 0.0)


@pytest.mark.parametrize("kind", ContactKind)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=200)
def test_a_contact_keeps_momentum_and_angular_momentum(kind: ContactKind, seed: int) -> None:
    generator = np.random.default_rng(seed)
    a, b = _body(generator), _body(generator)
    direction = generator.uniform(0, 2 * np.pi)
    of_a = Feature(np.cos(direction), np.sin(direction), 1.0) if kind is ContactKind.LINE_POINT else Feature(1, -1, 0)
    geometry = contact_geometry(kind, a, b, of_a, Feature(1.0, 1.0, 0.0))
    result = contact((NormalImpact(),), geometry, a, b, {})
    before = np.array([[a.vx, a.vy, a.spin], [b.vx, b.vy, b.spin]])
    after = np.array([result.a[:3], result.b[:3]])
    mass, inertia = np.array([a.mass, b.mass]), 1 / np.array([a.inverse_inertia, b.inverse_inertia])
    place = np.array([[a.x, a.y], [b.x, b.y]])
    change = after - before
    momentum = mass[:, None] * change[:, :2]
    size = np.abs(mass[:, None] * before[:, :2]).max() + np.abs(momentum).max()
    assert np.abs(momentum.sum(0)).max() <= 1e-12 * size
    turning = inertia * change[:, 2] + place[:, 0] * momentum[:, 1] - place[:, 1] * momentum[:, 0]
    size = (size * np.abs(place).max()) + np.abs(inertia * before[:, 2]).max() + np.abs(turning).max()
    assert abs(turning.sum()) <= 1e-12 * size


SHAPES = st.lists(st.sampled_from([CUBE, DISC, SPHERE]), min_size=2, max_size=4).map(tuple)
SEEDS = st.integers(0, 2**32 - 1)


def _frictionless(worlds: Worlds) -> Worlds:
    return replace(worlds, parameters={name: 0 * value for name, value in worlds.parameters.items()})


def _rubbing(worlds: Worlds, coefficient: float) -> Worlds:
    """The worlds with friction between bodies; the other effects of the extended model vanish."""
    frictions = {"contact_friction": coefficient, "wall_friction": coefficient}
    strengths = {"tilt_x": 0.0, "tilt_y": 0.0, "linear_drag": 0.0, **frictions}
    more = {name: tensor([value] * len(worlds)) for name, value in strengths.items()}
    return replace(worlds, parameters={**worlds.parameters, **more})


@given(shapes=SHAPES, seed=SEEDS, coefficient=st.floats(0, 2), bounce=st.floats(0.6, 1))
@settings(max_examples=25, deadline=None)
def test_energy_never_grows(shapes: tuple[Shape, ...], seed: int, coefficient: float, bounce: float) -> None:
    worlds = scenes(2, shapes, seed)
    worlds = replace(worlds, restitution=worlds.restitution * bounce)
    for scene, model in ((worlds, PhysicsModel.base()), (_rubbing(worlds, coefficient), EXTENDED)):
        rollout = simulate(scene, FRAMES, model)
        assert set(rollout.outcome) <= {Outcome.OK, Outcome.OVERLAP}
        fine = torch.from_numpy(rollout.fine)
        assert (energy(scene, rollout)[fine].diff(dim=1) <= 1e-10).all()


def _momenta(worlds: Worlds, rollout: Rollout, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Momenta (x, y, about the origin) of each body at one of the times, and the sizes of their terms."""
    place, velocity = (values[0, row].numpy() for values in (rollout.trajectory, rollout.velocity))
    mass, inertia = worlds.mass[0].numpy(), worlds.moment_of_inertia[0].numpy()
    x, y = mass * velocity[:, 0], mass * velocity[:, 1]
    terms = np.stack([place[:, 0] * y, -place[:, 1] * x, inertia * velocity[:, 2]])
    return np.stack([x, y, terms.sum(0)]), np.abs(np.concatenate([[x, y], terms])).max(1)


@given(shapes=SHAPES, seed=SEEDS, coefficient=st.floats(0, 2))
@example(shapes=(Shape.CYLINDER, Shape.CUBE, Shape.CUBE, Shape.CUBE), seed=9148605, coefficient=0.0)
@settings(max_examples=25, deadline=None)
def test_every_contact_of_a_rollout_keeps_momentum(shapes: tuple[Shape, ...], seed: int, coefficient: float) -> None:
    # Without friction with the table nothing but a contact changes velocities, also shortly before and after it.
    worlds = _frictionless(scenes(1, shapes, seed, walls=False))
    for scene, model in ((worlds, PhysicsModel.base()), (_rubbing(worlds, coefficient), EXTENDED)):
        events = simulate(scene, FRAMES, model).events
        if not len(events) or np.diff(events.time).min(initial=1.0) < 3 * SHORTLY:
            continue
        around = (events.time[:, None] + SHORTLY * np.array([-1, 1])).ravel()
        rollout = simulate(scene, torch.from_numpy(around), model)
        for row in range(len(events)):
            # Of all bodies: one of the two may lean on a third, which goes on pushing it.
            (before, size), (after, _) = (_momenta(scene, rollout, index) for index in (2 * row, 2 * row + 1))
            change = np.abs((after - before).sum(1))
            assert (change[:2] <= 1e-12 * size[:2].max()).all()
            assert change[2] <= 1e-12 * size.max()


@given(seed=SEEDS)
@settings(max_examples=25, deadline=None)
def test_elastic_bodies_keep_momentum_and_energy(seed: int) -> None:
    worlds = _frictionless(random_worlds(1, (CUBE, DISC, CUBE), seed, walls=False))
    worlds = replace(worlds, restitution=torch.ones_like(worlds.restitution))
    rollout = simulate(worlds, FRAMES[::16])
    momentum = (worlds.mass[:, None, :, None] * rollout.velocity[..., :2]).sum(2)
    assert torch.allclose(momentum, momentum[:, :1], atol=1e-11)
    total = energy(worlds, rollout)
    assert torch.allclose(total, total[:, :1], rtol=1e-10)
