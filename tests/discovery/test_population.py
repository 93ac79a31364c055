"""How bodies are in what each has of its own, learned from all videos."""

import math

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.scenes import Setting
from vrdp_prob.inference.several_videos.beliefs import believing
from vrdp_prob.inference.several_videos.learned import learned_model
from vrdp_prob.inference.several_videos.population import with_learned_population
from vrdp_prob.models.effects.material_friction import MATERIAL_RATIO, MaterialFriction
from vrdp_prob.models.parameters import AIR_DRAG, MASS, RESTITUTION, SLIDING_FRICTION, WALL_RESTITUTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Wall


@pytest.mark.parametrize("spread", [0.05, pytest.param(0.3, marks=pytest.mark.slow)])
def test_the_spread_of_friction_is_that_of_the_bodies(spread: float) -> None:
    data, fit = fitted(seed=1, setting=Setting(videos=5, bodies=3, friction_spread=spread))
    learned = with_learned_population(fit).beliefs["friction_ratio"].prior.sd
    # A dozen bodies move: the logarithm of their spread has a standard deviation of about 0.2.
    assert spread / 2.2 < learned < 2.2 * spread
    assert len(data.tracks) == 5


def test_the_middle_of_restitutions_is_learned_and_that_of_masses_is_not() -> None:
    _, fit = fitted(seed=1, setting=Setting(videos=5, bodies=3))
    beliefs = with_learned_population(fit).beliefs
    # Ten or so factors of restitution, whose logarithms differ by 0.05.
    assert beliefs[RESTITUTION.name].prior.mean == pytest.approx(math.log(0.88), abs=0.06)
    assert beliefs[MASS.name].prior.mean == MASS.prior.mean


def test_too_few_bodies_leave_the_prior() -> None:
    _, fit = fitted(seed=1, setting=Setting(videos=2, bodies=2, frames=60))
    prior = next(one for one in fit.model.parameters if one.name == "friction_ratio").prior
    assert with_learned_population(fit).beliefs["friction_ratio"].prior == prior


@pytest.mark.parametrize("mass_spread", [0.05, 0.4])
def test_a_learned_model_knows_the_bodies_and_the_table(mass_spread: float) -> None:
    setting = Setting(videos=5, bodies=3, mass_spread=mass_spread)
    _, fit = fitted(seed=1, setting=setting)
    model = learned_model(fit)
    # Only bodies that met another one tell their mass: ten or so.
    assert mass_spread / 2.5 < model.believed(MASS).prior.sd < 2.5 * mass_spread
    restitution = model.believed(RESTITUTION)
    assert restitution.default == pytest.approx(0.88, abs=0.05)
    assert 0.02 < restitution.prior.sd < 0.12
    drag = model.believed(AIR_DRAG)
    assert drag.prior.sd < 0.3 * AIR_DRAG.prior.sd
    assert math.log(drag.default / 0.03) == pytest.approx(0.0, abs=4 * drag.prior.sd)


def test_a_learned_model_knows_each_material_and_each_wall() -> None:
    model = PhysicsModel.base().with_effect(MaterialFriction())
    wall = Wall(1.0, -2.0, 1.0, 2.0)
    keys = [("sliding_friction", ()), ("material_friction_ratio", ("metal",)), ("wall_restitution", wall.place)]
    keys += [("position_noise", ())]
    learned = believing(model, keys, np.log([0.05, 1.4, 0.7, 1.0]), np.array([0.1, 0.02, 9.0, 0.1]))
    assert learned.believed(SLIDING_FRICTION).default == pytest.approx(0.05)
    assert learned.believed(MATERIAL_RATIO, ("metal",)).default == pytest.approx(1.4)
    assert learned.believed(MATERIAL_RATIO, ("metal",)).prior.sd == 0.02
    assert learned.believed(MATERIAL_RATIO, ("rubber",)) == MATERIAL_RATIO
    rebound = learned.believed(WALL_RESTITUTION, wall.place)
    assert rebound.default == pytest.approx(0.7)
    assert rebound.prior.sd == WALL_RESTITUTION.prior.sd  # never less sharp than before
    assert len(learned.beliefs) == 3
