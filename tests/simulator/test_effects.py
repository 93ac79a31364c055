"""Laws compile to what they compute, and effects do what they say."""

import ctypes

import numpy as np
import pytest
import torch

from tests.simulator.scenes import DISC, at, tensor, world
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator import mathematics
from vrdp_prob.models.simulator.formula import Recorder, vector_jacobian
from vrdp_prob.models.simulator.machine_code import ARRAY, NUMBER, MachineCode, law_function


def test_every_effect_describes_itself() -> None:
    for name, effect in known_effects().items():
        assert effect.name == name
        assert effect.sentence.endswith(".")
        assert effect.law
        assert effect.source
        assert set(effect.vanishes_at) <= {parameter.name for parameter in effect.parameters}


def _law(x: object, y: object) -> tuple[object, ...]:
    m = mathematics
    both = m.sqrt(x * x + 2.0) * m.sin(y) - m.exp(-y) / m.maximum(x, 0.5)
    return both, m.where(x < y, m.atan2(y, x) ** 3, m.minimum(x, y) * m.tanh(both)), m.absolute(m.cos(x) - m.log(y))


@pytest.mark.parametrize(("x", "y"), [(0.3, 1.7), (1.9, 0.4)])
def test_recorded_derivatives_are_those_of_torch(x: float, y: float) -> None:
    recorder = Recorder()
    inputs = [recorder.input("x"), recorder.input("y")]
    bars = [recorder.input("bar", index) for index in range(3)]
    outputs = _law(*inputs)
    arguments = {"x": NUMBER, "y": NUMBER, "bar": ARRAY, "out": ARRAY, "gradient": ARRAY}
    wanted = {"out": outputs, "gradient": vector_jacobian(outputs, bars, inputs)}
    code = MachineCode(law_function("law", arguments, wanted, result=outputs[1]))
    function = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_double, *[ctypes.c_void_p] * 3)
    bar, out, gradient = np.array([0.7, -1.1, 0.4]), np.zeros(3), np.zeros(2)
    returned = function(code.address("law"))(x, y, *(array.ctypes.data for array in (bar, out, gradient)))
    tensors = [tensor(x).requires_grad_(), tensor(y).requires_grad_()]
    expected = _law(*tensors)
    assert out == pytest.approx([value.item() for value in expected])
    assert returned == out[1]
    sum(bar * value for bar, value in zip((0.7, -1.1, 0.4), expected, strict=True)).backward()
    assert gradient == pytest.approx([value.grad.item() for value in tensors])


def test_a_law_must_not_branch() -> None:
    recorder = Recorder()
    with pytest.raises(TypeError, match="where"):
        bool(recorder.input("x") < 0)


EXTENDED = PhysicsModel.base().with_effect(SurfaceTilt()).with_effect(LinearDrag()).with_effect(ContactFriction())
NOTHING = {"tilt_x": 0.0, "tilt_y": 0.0, "linear_drag": 0.0, "contact_friction": 0.0, "wall_friction": 0.0}


def test_linear_drag() -> None:
    scene = world([[0, 0]], [[2, 0]], None, {**NOTHING, "linear_drag": 0.5})
    assert at(scene, 3.0, model=EXTENDED).trajectory[0, -1, 0, 0].item() == pytest.approx(
        4 * (1 - np.exp(-1.5)), abs=1e-9
    )


def test_tilt_below_friction_holds_a_resting_body_and_above_moves_it() -> None:
    for tilt, moved in ((0.02, 0.0), (0.05, 0.5 * 0.03 * 9.81 * 4)):
        scene = world([[0, 0]], [[0, 0]], None, {**NOTHING, "tilt_x": tilt, "sliding_friction": 0.02})
        assert at(scene, 2.0, model=EXTENDED).trajectory[0, -1, 0, 0].item() == pytest.approx(moved, abs=1e-6)


def test_tilt_bends_a_path_to_rest_downhill() -> None:
    scene = world([[0, 0]], [[1, 0]], None, {**NOTHING, "tilt_y": 0.05, "sliding_friction": 0.1})
    rollout = at(scene, 5.0, model=EXTENDED)
    assert rollout.outcome[0].name == "OK"
    assert (rollout.velocity[0, -1, 0] == 0).all()
    assert rollout.trajectory[0, -1, 0, 1] > 0.05


def test_contact_friction_exchanges_spin_and_keeps_angular_momentum() -> None:
    for coefficient in (0.05, 5.0):
        scene = world([[0, 0], [1, 0.1]], [[1, 0], [0, 0]], [DISC, DISC], {**NOTHING, "contact_friction": coefficient})
        rollout = at(scene, 2.0, model=EXTENDED)
        place, velocity = rollout.trajectory[0], rollout.velocity[0]
        orbital = place[..., 0] * velocity[..., 1] - place[..., 1] * velocity[..., 0]
        total = (orbital + scene.moment_of_inertia[0] * velocity[..., 2]).sum(-1)
        assert torch.allclose(total[0], total[-1], atol=1e-10)
        assert (velocity[-1, :, 2].abs() > 1e-3).all()
