"""Derivatives of random scenes against central differences; every deviation must have a known reason."""

from collections import Counter
from collections.abc import Callable, Sequence

import pytest

from tests.simulator import reference
from tests.simulator.comparison import scene_of, scenes
from tests.simulator.differences import Slope, is_fair, off_frames, slopes
from tests.simulator.scenes import CUBE, DISC, FRAMES, SPHERE
from tests.simulator.test_reference import MODELS, random_strengths
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds

Record = Callable[[str, object], None]
MIXES = {"discs": (DISC, SPHERE, DISC, DISC), "mixed": (CUBE, DISC, CUBE, SPHERE)}
COUPLED = PhysicsModel.base().with_effect(PairForce())
WITH_DERIVATIVES = {**MODELS, "coupled": COUPLED}
RIGHT = 1e-5
"""Relative error up to which a derivative counts as right."""


def _verdict(worlds: Worlds, found: Sequence[Slope], seed: int, model: PhysicsModel) -> str:
    """Right, or why a deviation is no error of the derivative, or 'unexplained'."""
    wrong = [slope for slope in found if not slope.error <= RIGHT]
    if not all(slope.finite for slope in found):
        return "not finite"
    if not wrong:
        return "right"
    if any(slope.order_changes for slope in wrong):
        return "order of events changes"
    if all(slope.inexact for slope in wrong):
        return "differences inexact"
    if any(effect.overrides("pair_force") for effect in model.effects):  # the reference knows no forces between bodies
        return "unexplained"
    doubtful = reference.rollout(scene_of(off_frames(worlds, seed), 0), FRAMES.numpy()).doubtful_from
    return "grazing contact" if doubtful < FRAMES[-1] else "unexplained"


def _verdicts(count: int, mix: str, seed: int, model: PhysicsModel) -> tuple[Counter[str], float]:
    """How many scenes got each verdict, and the worst error of those that are right."""
    verdicts: Counter[str] = Counter()
    worst, batch = 0.0, 0
    while verdicts.total() < count:
        worlds = scenes(count, MIXES[mix], seed + batch, late=False)
        worlds = random_strengths(worlds, model, seed)
        for index in range(count):
            world = worlds.select([index])
            if verdicts.total() < count and is_fair(world, FRAMES, model, index):
                found = slopes(world, index, FRAMES, model)
                verdict = _verdict(world, found, index, model)
                verdicts[verdict] += 1
                worst = max(worst, *(slope.error for slope in found)) if verdict == "right" else worst
        batch += 1
    return verdicts, worst


def _check(verdicts: Counter[str], worst: float, share: float, record: Record) -> None:
    print(f"{dict(verdicts)}, worst of the right ones {worst:.1e}")
    record("verdicts", dict(verdicts))
    assert verdicts["not finite"] == verdicts["unexplained"] == 0
    assert verdicts["right"] >= share * verdicts.total()


@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", WITH_DERIVATIVES)
def test_derivatives_of_random_scenes(mix: str, model: str, record_property: Record) -> None:
    _check(*_verdicts(10, mix, 11, WITH_DERIVATIVES[model]), 0.9, record_property)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_derivatives_of_a_thousand_random_scenes(record_property: Record) -> None:
    (discs, worst), (mixed, worst_mixed) = (_verdicts(500, mix, 31, PhysicsModel.base()) for mix in MIXES)
    _check(discs + mixed, max(worst, worst_mixed), 0.99, record_property)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize("model", ["extended", "slipping", "coupled"])
def test_derivatives_of_many_extended_scenes(mix: str, model: str, record_property: Record) -> None:
    _check(*_verdicts(200, mix, 41, WITH_DERIVATIVES[model]), 0.99, record_property)
