"""One kernel serves all models, in several threads at a time, and its record of a batch grows as it must."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import torch

from tests.simulator.scenes import DISC, world
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator import rollout, source
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds

BASE = PhysicsModel.base()
MORE = BASE.with_effect(LinearDrag()).with_effect(SlipToRoll())
TIMES = torch.linspace(0, 4, 41, dtype=torch.float64)


def _scene(speed: float = 1.0) -> Worlds:
    """Two discs that meet, and a third one that stays."""
    places, velocities = [[0, 0], [1, 0.1], [3, 3]], [[speed, 0], [0, 0], [0, 0]]
    extra = {
        "linear_drag": 0.1,
        "slip_friction": 0.2,
        "release_rolling": [0.0] * 3,
        "release_rolling_across": [0.0] * 3,
    }
    return world(places, velocities, (DISC, DISC, DISC), extra)


def _outcome(scene: Worlds, model: PhysicsModel) -> list[torch.Tensor]:
    scene.velocity.requires_grad_()
    result = simulate(scene, TIMES, model)
    return [result.trajectory.detach(), *torch.autograd.grad(result.trajectory.sum(), scene.velocity)]


def test_another_set_of_effects_compiles_no_kernel() -> None:
    for model in (BASE, MORE):
        _outcome(_scene(), model)
    assert MORE.kernel.functions is BASE.kernel.functions
    for entry in (source.kernels().rollout_batch, source.kernels().reverse_batch):
        assert len(entry.signatures) == 1


def test_threads_with_different_models_do_not_disturb_each_other() -> None:
    tasks = [(0.5 + 0.1 * number, (BASE, MORE)[number % 2]) for number in range(12)]
    alone = [_outcome(_scene(speed), model) for speed, model in tasks]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda task: _outcome(_scene(task[0]), task[1]), tasks))
    for first, second in zip(alone, together, strict=True):
        assert all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


def test_the_tape_grows_while_a_batch_is_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = _scene().select([0] * 30)
    enough = _outcome(scene, BASE)
    monkeypatch.setattr(rollout, "FIRST_ROWS", 1)
    assert all(torch.equal(a, b) for a, b in zip(_outcome(scene.select(slice(None)), BASE), enough, strict=True))
