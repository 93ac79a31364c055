"""What is said of the parameters of a cause."""

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from scipy.stats import norm

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.finding import Estimate
from vrdp_prob.discovery.selection import estimates as module
from vrdp_prob.discovery.selection.estimates import (
    cause_sentence,
    estimates,
    has_sign_of_law,
    mass_scale_notes,
    surprise,
)
from vrdp_prob.discovery.selection.reach import Reach
from vrdp_prob.models.effects.air_drag import AirDrag
from vrdp_prob.models.effects.body_friction import BodyFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.wall import Wall
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.parameters import AIR_DRAG, Prior


def test_a_logarithm_is_told_in_its_unit() -> None:
    _, fit = fitted(seed=1)
    place = fit.joint.numbers.names.index("air_drag")
    mean, sd = fit.joint.gaussian.mean[place], fit.joint.gaussian.sd[place]
    found = estimates(fit, AirDrag())["air_drag"]
    assert found.q025 < found.mean < found.q975
    assert math.sqrt(found.q025 * found.q975) == pytest.approx(math.exp(mean))
    assert found.sd == pytest.approx(found.mean * sd, rel=0.2)


def test_numbers_of_bodies_say_whose_they_are() -> None:
    _, fit = fitted(seed=1)
    names = list(estimates(fit, BodyFriction()))
    assert names
    assert all(name.startswith("friction_ratio[") and " in v0" in name for name in names)


def test_a_sentence_holds_the_strength_in_brackets() -> None:
    found = {"linear_drag": Estimate(0.187, 0.0082, 0.17, 0.2, "1/s")}
    assert cause_sentence(LinearDrag(), found) == (
        "Bodies are slowed in proportion to their speed (linear_drag = 0.187 ± 0.0082 1/s)."
    )
    assert cause_sentence(Wall(), {}) == Wall.sentence


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [(0.1, 0.3, "attract each other"), (-0.3, -0.1, "repel each other"), (-0.1, 0.3, "attract or repel each other")],
)
def test_a_sentence_tells_the_direction_that_the_interval_tells(low: float, high: float, said: str) -> None:
    found = {"pair_strength": Estimate((low + high) / 2, (high - low) / 4, low, high, "m^3/s^2")}
    assert f"Bodies {said} without touching" in cause_sentence(PairForce(), found)


@pytest.mark.parametrize("effect", [one for one in known_effects().values() if one.signed_sentences])
def test_a_direction_is_that_of_one_strength(effect: type[Effect]) -> None:
    assert list(effect.vanishes_at.values()) == [0.0]


def test_a_strength_that_goes_with_the_masses_is_told_as_such_where_no_mass_is() -> None:
    videos = fitted(seed=1)[0].tracks
    (note,) = mass_scale_notes([LinearDrag(), PairForce()], videos)
    assert "only the ratio of pair strength to the masses shows" in note
    weighed = [replace(one, bodies=tuple(replace(body, mass=1.0) for body in one.bodies)) for one in videos]
    assert not list(mass_scale_notes([PairForce()], weighed))
    assert not list(mass_scale_notes([LinearDrag()], videos))


class _Placed(Effect):
    """The air drag with its number as if that were a place."""

    name: ClassVar = AirDrag.name
    parameters: ClassVar = (replace(AIR_DRAG, prior=Prior(math.log(1000.0), 0.1)),)


class _Beside(_Placed):
    """Another effect that acts by the number of the air drag, as a wind does."""

    name: ClassVar = "beside"


def test_a_strength_may_surprise_but_not_a_place() -> None:
    _, fit = fitted(seed=1)
    assert surprise(fit, AirDrag()) == 1.0
    assert surprise(fit, _Placed()) < 1e-6
    assert surprise(fit, _Beside()) == 1.0


class _Falling(Effect):
    """The air drag with a law that speeds bodies up."""

    name: ClassVar = "falling"
    vanishes_at: ClassVar = {AIR_DRAG.name: 0.0}
    sign_of_law: ClassVar = -1
    parameters: ClassVar = (AIR_DRAG,)


class _Rising(_Falling):
    """The air drag with its law."""

    name: ClassVar = "rising"
    sign_of_law: ClassVar = +1


def test_a_strength_may_have_the_sign_that_its_law_has_not() -> None:
    _, fit = fitted(seed=1)
    drag = estimates(fit, AirDrag())[AIR_DRAG.name]
    right, wrong = has_sign_of_law(fit, _Rising()), has_sign_of_law(fit, _Falling())
    assert right == pytest.approx(norm.cdf(drag.mean / drag.sd))
    assert right + wrong == pytest.approx(1.0)
    assert has_sign_of_law(fit, AirDrag()) == 1.0


@pytest.mark.parametrize(("far", "high"), [(0.9, 1.8), (0.01, 1.2)], ids=["farther", "nearer"])
def test_how_far_a_parameter_reaches_widens_its_interval_only(
    far: float, high: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, fit = fitted(seed=1)
    plain = estimates(fit, AirDrag())["air_drag"]
    middle = math.log(plain.q975) - 0.1
    grid = np.linspace(middle - 3 * far, middle + 3 * far, 2001)
    reached = Reach(grid, -(((grid - middle) / far) ** 2) / 2)
    monkeypatch.setattr(module, "reaches", lambda fit, *_: {fit.joint.numbers.names.index("air_drag"): reached})
    found = estimates(fit, AirDrag())["air_drag"]
    assert found.q025 <= plain.q025
    assert found.q975 >= plain.q975
    assert found.sd >= plain.sd
    assert (found.q975 > high * plain.q975) == (far > 0.1)
