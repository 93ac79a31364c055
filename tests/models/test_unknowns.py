"""Which numbers are unknown, and what is believed of them."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import pytest

from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.magnus_curl import MagnusCurl
from vrdp_prob.models.effects.mass_dependent_friction import MassDependentFriction
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.wall import Wall as HiddenWall
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.formula import Scalar
from vrdp_prob.models.unknowns import (
    CUBE_SURFACE_SPEED_SD,
    SPIN_SD,
    SURFACE_SPEED_SD,
    Structure,
    structure_of,
    unknowns,
)
from vrdp_prob.scene import Body, Shape, Tracks, Wall

RUBBING = PhysicsModel.base().with_effect(ContactFriction())
EVERYTHING = Structure(moving=frozenset({0, 1}), colliding=frozenset({0, 1}))


def seen(shape: Shape, radius: float, walls: tuple[Wall, ...] = ()) -> Tracks:
    """Two bodies that move side by side."""
    times = np.arange(10) * 0.04
    positions = np.array([[[time, 0.0], [time, 5.0]] for time in times])
    bodies = tuple(Body(id=name, shape=shape, radius=radius) for name in "ab")
    return Tracks.from_arrays("seen", bodies, times, positions, walls=walls)


@pytest.mark.parametrize(
    ("shape", "radius", "sd"),
    [
        (Shape.SPHERE, 0.03, SURFACE_SPEED_SD / 0.03),
        (Shape.CYLINDER, 0.2, SURFACE_SPEED_SD / 0.2),
        (Shape.CYLINDER, 0.8, SPIN_SD),
        (Shape.CUBE, 0.03, CUBE_SURFACE_SPEED_SD / 0.03),
        (Shape.CUBE, 0.2, SPIN_SD),
    ],
)
def test_small_bodies_may_spin_fast(shape: Shape, radius: float, sd: float) -> None:
    coordinates = unknowns(seen(shape, radius), RUBBING, EVERYTHING)
    assert coordinates.entries[coordinates.places["spin", 0]].prior.sd == pytest.approx(sd)


def test_friction_of_walls_is_unknown_only_where_something_is_fixed() -> None:
    wall = Wall(-1.0, -1.0, 3.0, -1.0)
    without, beside = seen(Shape.CYLINDER, 0.2), seen(Shape.CYLINDER, 0.2, (wall,))
    for tracks, model, expected in (
        (without, RUBBING, False),
        (beside, RUBBING, True),
        (without, RUBBING.with_effect(HiddenWall()), True),
    ):
        coordinates = unknowns(tracks, model, EVERYTHING)
        assert (("wall_friction", None) in coordinates.places) is expected
        assert ("contact_friction", None) in coordinates.places


class SteadyPush(Effect):
    """The same force on every body, by the weight of which it is divided."""

    name: ClassVar = "steady_push"
    sentence: ClassVar = "Something pushes along x."
    law: ClassVar = "a = 1 N / m"
    source: ClassVar = "made up"

    def acceleration(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar]:
        """Along x, in m/s^2."""
        return body.inverse_mass, 0.0


class Blow(Effect):
    """A blow at 1 s that heavy bodies hardly feel."""

    name: ClassVar = "blow"
    sentence: ClassVar = "Something hits all bodies at once."
    law: ClassVar = "dv = 1 N s / m at 1 s"
    source: ClassVar = "made up"

    def kick_time(self, parameters: Mapping[str, Scalar]) -> Scalar:
        """In s."""
        return 1.0

    def kick(self, time: Scalar, body: BodyView, parameters: Mapping[str, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """Along x, in m/s."""
        return 1.0 / body.mass, 0.0, 0.0


@pytest.mark.parametrize("effect", [PairForce(), SteadyPush(), Blow()], ids=lambda effect: effect.name)
def test_a_mass_that_a_path_depends_on_is_unknown_without_collision(effect: Effect) -> None:
    tracks, alone = seen(Shape.CYLINDER, 0.2), Structure(moving=frozenset({0}), colliding=frozenset())
    felt = unknowns(tracks, PhysicsModel.base().with_effect(effect), alone)
    assert ("mass", 0) in felt.places, "what moves tells its mass"
    assert ("mass", 1) not in felt.places, "what rests does not"
    for model in (PhysicsModel.base(), PhysicsModel.base().with_effect(MassDependentFriction())):
        assert ("mass", 0) not in unknowns(tracks, model, alone).places
    assert structure_of(felt) == alone


def test_a_spin_that_a_path_depends_on_is_unknown() -> None:
    tracks, alone = seen(Shape.CYLINDER, 0.2), Structure(moving=frozenset({0}), colliding=frozenset())
    assert ("spin", 0) in unknowns(tracks, PhysicsModel.base().with_effect(MagnusCurl()), alone).places
    assert ("spin", 0) not in unknowns(tracks, PhysicsModel.base(), alone).places
