"""Derivatives: against closed forms, and against central differences."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.simulator.scenes import CUBE, DISC, FRAMES, RADIUS, SPHERE, random_worlds, tensor, world
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

FIELDS = ("position", "velocity", "angle", "spin", "release_time", "mass", "restitution", "radius", "wall_restitution")
STEPS = (1e-5, 1e-6, 1e-7)
"""Of the differences, whose rounding and truncation vary from scene to scene; the best one counts."""


def _leaf(values: object) -> torch.Tensor:
    return tensor(values).requires_grad_()


def test_wall_bounce() -> None:
    x, v, r, t = _leaf([[[0.0, 0.0]]]), _leaf([[[1.3, 0.2]]]), _leaf([[0.7]]), _leaf([0.0, 2.0])
    radius = _leaf([[RADIUS]])
    scene = replace(
        world([[0, 0]], [[0, 0]], walls=[[1, -5, 1, 5]]), position=x, velocity=v, wall_restitution=r, radius=radius
    )
    simulate(scene, t).trajectory[0, -1, 0, 0].backward()
    # x(t) = X - r (x0 + v t - X) with X = 1 - R.
    assert x.grad[0, 0].tolist() == pytest.approx([-0.7, 0.0], abs=1e-9)
    assert v.grad[0, 0].tolist() == pytest.approx([-1.4, 0.0], abs=1e-9)
    assert r.grad.item() == pytest.approx(-(2.6 - 0.8), abs=1e-9)
    assert radius.grad.item() == pytest.approx(-1.7, abs=1e-9)
    assert t.grad.tolist() == pytest.approx([0.0, -0.91], abs=1e-9)


def test_two_discs_that_exchange_velocities() -> None:
    # The published counterexample: engines return (0.75, 0.25, 0.91, 0.08) where (1, 0, 1, 0) is true.
    x, v = _leaf([[[0.0, 0.0], [1.0, 0.0]]]), _leaf([[[1.0, 0.0], [0.0, 0.0]]])
    simulate(replace(world([[0, 0], [0, 0]], [[0, 0], [0, 0]]), position=x, velocity=v), tensor([0.0, 1.5])).trajectory[
        0, -1, 1, 0
    ].backward()
    # The second disc ends where the first would be, one contact distance ahead.
    assert x.grad[0, :, 0].tolist() == pytest.approx([1.0, 0.0], abs=1e-9)
    assert v.grad[0, :, 0].tolist() == pytest.approx([1.5, 0.0], abs=1e-9)


def test_masses_of_two_discs() -> None:
    mass, restitution = _leaf([[1.0, 3.0]]), _leaf([[0.9, 0.8]])
    scene = replace(world([[0, 0], [1, 0]], [[1, 0], [0, 0]]), mass=mass, restitution=restitution)
    simulate(scene, tensor([0.0, 2.0])).velocity[0, -1, 1, 0].backward()
    # v2 = m1 (1 + r1 r2) v / (m1 + m2).
    assert mass.grad[0].tolist() == pytest.approx([1.72 * 3 / 16, -1.72 / 16], abs=1e-9)
    assert restitution.grad[0].tolist() == pytest.approx([0.8 / 4, 0.9 / 4], abs=1e-9)


def test_stopping_distance() -> None:
    friction, v = _leaf([0.1]), _leaf([[[1.0, 0.0]]])
    scene = world([[0, 0]], [[0, 0]])
    scene = replace(scene, velocity=v, parameters={**scene.parameters, "sliding_friction": friction})
    result = simulate(scene, tensor([0.0, 4.0]))
    (result.trajectory.sum() + result.velocity[:, 1:].sum()).backward()
    assert friction.grad.item() == pytest.approx(-1 / (2 * 9.81 * 0.01), abs=1e-8)
    assert v.grad[0, 0, 0].item() == pytest.approx(1 / 0.981, abs=1e-8)


def test_second_derivatives_are_refused() -> None:
    v = _leaf([[[1.0, 0.0]]])
    value = simulate(replace(world([[0, 0]], [[0, 0]]), velocity=v), tensor([0.0, 1.0])).trajectory.sum()
    with pytest.raises(RuntimeError, match="first derivative only"):
        torch.autograd.grad(value, v, create_graph=True)


def relative_errors(worlds: Worlds, seed: int, model: PhysicsModel) -> np.ndarray:
    """Error of a directional derivative in all inputs at once, relative, per world; NaN where events change order."""
    generator = np.random.default_rng(seed)
    # Not on a frame: a body that is shown at the moment of its release has a derivative from each side only.
    worlds = worlds.released_at(worlds.release_time + 0.013)
    weight = tensor(generator.normal(size=(len(worlds), len(FRAMES), len(worlds.shapes), 3)))
    fields = [name for name in FIELDS if getattr(worlds, name).numel()]
    leaves = {name: getattr(worlds, name).clone().requires_grad_() for name in fields}
    parameters = {name: value.clone().requires_grad_() for name, value in worlds.parameters.items()}
    rollout = simulate(replace(worlds, **leaves, parameters=parameters), FRAMES, model)
    (rollout.trajectory * weight).sum().backward()
    everything = {**leaves, **parameters}
    directions = {name: tensor(generator.normal(size=value.shape)) for name, value in everything.items()}
    slope = sum(
        (directions[name] * value.grad).flatten(1).sum(1) if value.ndim > 1 else directions[name] * value.grad
        for name, value in everything.items()
    )
    size = sum(
        ((directions[name] * value.grad) ** 2).flatten(1).sum(1)
        if value.ndim > 1
        else (directions[name] * value.grad) ** 2
        for name, value in everything.items()
    ).sqrt()
    assert all(torch.isfinite(value.grad).all() for value in everything.values())
    errors = np.full(len(worlds), np.nan)
    for step in STEPS:
        values, sequences = [], []
        for sign in (1, -1):
            moved = {name: (value + sign * step * directions[name]).detach() for name, value in everything.items()}
            shifted = replace(
                worlds,
                **{name: moved[name] for name in fields},
                parameters={name: moved[name] for name in parameters},
            )
            other = simulate(shifted, FRAMES, model)
            values.append((other.trajectory * weight).sum((1, 2, 3)))
            sequences.append([_sequence(other.events.of_world(index)) for index in range(len(worlds))])
        difference = (values[0] - values[1]) / (2 * step)
        error = ((difference - slope).abs() / (size + 1e-3)).detach().numpy()
        same = [first == second for first, second in zip(*sequences, strict=True)]
        errors = np.fmin(errors, np.where(same, error, np.nan))
    return errors


def _sequence(events: object) -> list[tuple[int, int, int]]:
    return list(zip(events.kind.tolist(), events.first.tolist(), events.second.tolist(), strict=True))


MIXES = [(DISC, SPHERE, DISC, DISC), (CUBE, DISC, CUBE, SPHERE)]
EXTENDED = PhysicsModel.base().with_effect(SurfaceTilt()).with_effect(LinearDrag()).with_effect(ContactFriction())
STRENGTHS = {"tilt_x": 0.01, "tilt_y": -0.005, "linear_drag": 0.1, "contact_friction": 0.15}


def _worlds(shapes: tuple[object, ...], count: int, model: PhysicsModel) -> Worlds:
    worlds = random_worlds(count, shapes, seed=11)
    more = {name: torch.full((count,), value, dtype=torch.float64) for name, value in STRENGTHS.items()}
    return worlds if model is not EXTENDED else replace(worlds, parameters={**worlds.parameters, **more})


@pytest.mark.parametrize("shapes", MIXES)
@pytest.mark.parametrize("model", [PhysicsModel.base(), EXTENDED], ids=["base", "extended"])
def test_random_scenes_against_central_differences(shapes: tuple[object, ...], model: PhysicsModel) -> None:
    errors = relative_errors(_worlds(shapes, 25, model), 12, model)
    assert np.nanmedian(errors) < 1e-6
    assert (np.nan_to_num(errors) <= 1e-5).mean() >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("shapes", MIXES)
def test_a_thousand_random_scenes_against_central_differences(shapes: tuple[object, ...]) -> None:
    errors = relative_errors(_worlds(shapes, 500, PhysicsModel.base()), 12, PhysicsModel.base())
    kept = errors[~np.isnan(errors)]
    print(f"share within 1e-5: {(kept <= 1e-5).mean():.4f} of {len(kept)} scenes, worst {kept.max():.1e}")
    assert (kept <= 1e-5).mean() >= 0.97
