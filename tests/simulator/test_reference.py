"""Trajectories of random scenes of all shapes against an independent simulator."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.simulator.comparison import Comparison, compare, scenes
from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE, tensor
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.tangential_restitution import TangentialRestitution
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

Record = Callable[[str, object], None]
MIXES = {
    "discs": (DISC, SPHERE, DISC, SPHERE),
    "mixed": (CUBE, DISC, CUBE, SPHERE, DISC),
    "cubes": (CUBE, CUBE, CUBE),
}
EXTENDED = PhysicsModel.base().with_effect(SurfaceTilt()).with_effect(LinearDrag()).with_effect(ContactFriction())
STRENGTHS = {
    "tilt_x": (-0.005, 0.005),
    "tilt_y": (-0.005, 0.005),
    "linear_drag": (0, 0.3),
    "contact_friction": (0, 0.5),
    "wall_friction": (0, 0.5),
    "tangential_restitution": (0, 1),
    "slip_friction": (0.1, 0.4),
    "pair_strength": (-0.02, 0.02),
    "pair_softening": (0.05, 0.2),
}
SLIPPING = EXTENDED.with_effect(SlipToRoll())
SPRINGING = SLIPPING.with_effect(TangentialRestitution())
MODELS = {"base": PhysicsModel.base(), "extended": EXTENDED, "slipping": SLIPPING, "springing": SPRINGING}
EXACT = 1e-6
"""Farthest deviation in m that is allowed."""


def random_strengths(worlds: Worlds, model: PhysicsModel, seed: int) -> Worlds:
    """The worlds with random parameters for the effects of a model, as far as these are beyond the base model's."""
    generator = np.random.default_rng(seed)
    names = [parameter.name for parameter in model.parameters]
    more = {name: tensor(generator.uniform(*STRENGTHS[name], len(worlds))) for name in names if name in STRENGTHS}
    if "release_rolling" in names:
        more["release_rolling"] = tensor(generator.uniform(-0.2, 1.2, worlds.mass.shape))
        more["release_rolling_across"] = tensor(generator.uniform(-0.5, 0.5, worlds.mass.shape))
    return replace(worlds, parameters={**worlds.parameters, **more})


def _compared(count: int, shapes: Sequence[object], seed: int, model: PhysicsModel) -> Comparison:
    """Half of the scenes with walls, the others with a body that appears late."""
    total = Comparison()
    for kind in range(2):
        worlds = scenes(count // 2, shapes, seed + kind, walls=kind == 0, late=kind == 1)
        total += compare(random_strengths(worlds, model, seed), FRAMES, model)
    return total


def _check(found: Comparison, record: Record) -> None:
    print(found)
    record("farthest_deviation_m", found.farthest)
    record("found", str(found))
    assert found.farthest < EXACT
    assert found.missed == found.invented == 0
    assert found.contacts > found.scenes / 2
    assert found.compared > found.scenes / 2


@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", MODELS)
def test_against_the_reference(mix: str, model: str, record_property: Record) -> None:
    _check(_compared(12, MIXES[mix], 21, MODELS[model]), record_property)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")
@pytest.mark.parametrize("model", MODELS)
def test_worlds_on_a_gpu_are_simulated_alike_and_stay_there(model: str) -> None:
    worlds = random_strengths(scenes(4, MIXES["mixed"], 21, walls=True, late=True), MODELS[model], 21)
    found = {device: _velocity_slope(worlds, device, MODELS[model]) for device in ("cpu", "cuda")}
    assert torch.equal(found["cpu"], found["cuda"].cpu())


def _velocity_slope(worlds: Worlds, device: str, model: PhysicsModel) -> Tensor:
    """Derivative of all positions by the velocities at the start, with every tensor on a device."""
    fields = {name: value.to(device) for name, value in vars(worlds).items() if isinstance(value, Tensor)}
    parameters = {name: value.to(device) for name, value in worlds.parameters.items()}
    velocity = fields["velocity"] = fields["velocity"].clone().requires_grad_()
    here = replace(worlds, **fields, parameters=parameters)
    rollout = simulate(here, FRAMES.to(device), model)
    rollout.trajectory.sum().backward()
    for result in (rollout.trajectory, rollout.velocity, rollout.exists, velocity.grad, here.moment_of_inertia):
        assert result.device.type == device
    return velocity.grad


@pytest.mark.slow
@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", MODELS)
def test_many_scenes_against_the_reference(mix: str, model: str, record_property: Record) -> None:
    _check(_compared(300, MIXES[mix], 121, MODELS[model]), record_property)
