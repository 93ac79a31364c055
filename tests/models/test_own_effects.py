"""Mistakes in an effect of one's own are sentences that name the effect and the hook."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.linear_drag import LINEAR_DRAG
from vrdp_prob.models.parameters import Parameter, Prior, Scope, Transform
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.law_check import check_laws
from vrdp_prob.models.simulator.mathematics import where

PULL = Parameter("pull", "m/s^2", "a pull", Transform.IDENTITY, Prior(0.0, 1.0), 0.0)


def _with(hook: str, law: Callable[..., Any], **more: object) -> PhysicsModel:
    effect = type("Mine", (Effect,), {"name": "mine", "parameters": (PULL,), hook: law, **more})
    return PhysicsModel.base().with_effect(effect())


@pytest.mark.parametrize(
    ("hook", "law", "sentence"),
    [
        ("acceleration", lambda self, t, b, p: (p["push"], 0.0), "'mine', acceleration: there is no 'push'"),
        ("acceleration", lambda self, t, b, p: p["pull"], "acceleration: .*must return 2 numbers"),
        ("acceleration", lambda self, t, b, p: (math.sqrt(b.vx), 0.0), "acceleration: .*mathematics"),
        ("acceleration", lambda self, t, b, p: (b.colour, 0.0), "acceleration: .*colour"),
        ("acceleration", lambda self, t, b, p: (1.0 if b.vx > 0 else 2.0, 0.0), "cannot branch"),
        ("acceleration", lambda self, t, b, p: (where(b.is_sphere == 1, 1.0, 2.0), 0.0), "equal"),
        ("kick", lambda self, t, b, p: (p["pull"], 0.0, 0.0), "kick_time"),
        ("boundary", lambda self, b, p: (b.x, b.y), "boundary: .*one number"),
        ("tangential_impulse", lambda self, c, a, b, p: a.side["mine"], "tangential_impulse: there is no 'mine'"),
    ],
)
def test_a_law_that_is_wrong(hook: str, law: Callable[..., Any], sentence: str) -> None:
    model = _with(hook, law)
    with pytest.raises(InputError, match=sentence):
        check_laws(model.effects, model.layout)


def test_every_shipped_effect_passes() -> None:
    check_laws(PhysicsModel.base().effects, PhysicsModel.base().layout)


def test_a_hook_that_is_spelt_wrong() -> None:
    with pytest.raises(InputError, match=r"'mine'.*none of the hooks"):
        _with("accelerate", lambda self, t, b, p: (0.0, 0.0))


def test_parameters_that_clash() -> None:
    def law(*_: object) -> tuple[float, float]:
        return 0.0, 0.0

    other = Parameter("linear_drag", "1", "another", Transform.IDENTITY, Prior(0.0, 1.0), 0.0)
    mass = Parameter("mass", "kg", "a mass", Transform.LOG, Prior(0.0, 1.0), 1.0, scope=Scope.BODY)
    with pytest.raises(InputError, match="every body has a 'mass'"):
        _with("acceleration", law, parameters=(mass,))
    with pytest.raises(InputError, match="'vanishes_at' names 'push'"):
        _with("acceleration", law, vanishes_at={"push": 0.0})
    drag = type("Drag", (Effect,), {"name": "drag", "parameters": (LINEAR_DRAG,), "acceleration": law})
    with pytest.raises(InputError, match="states the parameter 'linear_drag' differently"):
        _with("acceleration", law, parameters=(other,)).with_effect(drag())
