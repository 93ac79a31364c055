"""Which numbers of a video are unknown, and what is believed of them before its motion is looked at."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.model_error import ModelError
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.observation import NOISE_LOG_SD, Observations
from vrdp_prob.models.parameters import (
    ANGULAR_DRAG,
    MASS,
    RESTITUTION,
    WALL_RESTITUTION,
    Prior,
    Scope,
    Transform,
)
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.roughness import untold_noise
from vrdp_prob.scene import Body, Shape, Tracks

NOISE = "noise_scale"
ANGLE_NOISE = "angle_noise_scale"
DEGREES_OF_FREEDOM = "noise_degrees_of_freedom"
DEGREES_PRIOR = Prior(math.log(8.0), 0.8)
"""Degrees of freedom of Student-t noise: from gross outliers (1.7) to nearly Gaussian (38) in the middle 95 %."""
MOTION = ("x", "y", "velocity_x", "velocity_y", "angle", "spin", "angle_zero")
"""Quantities that say where a body is released, and how it moves there."""
NOT_STATED = "unknown material"
"""Group of the bodies whose material nobody stated."""
SPEED_SD = 3.0
"""Prior standard deviation in m/s of a release velocity."""
SPIN_SD = 2.0
"""Prior standard deviation in rad/s of a release spin..."""
SURFACE_SPEED_SD = 1.0
"""...or that of the speed in m/s at which the side of a round body turns, if that is more..."""
CUBE_SURFACE_SPEED_SD = 0.3
"""...and of a cube, which is pushed rather than rolled or spun."""
YAW_SD = 1.5
"""Prior standard deviation in rad of a cube's yaw: flat over the quarter turn after which a square looks the same."""
ANGLE_ZERO_SD = 3.0
"""Prior standard deviation in rad of the arbitrary zero of measured angles."""

Owned = tuple[str, int | None]
"""A number of a video: its name and its owner, None for the video's."""
Held = Mapping[Owned, float | None]
"""Numbers that are not unknown though the model has them, and the value that each keeps; None for its default."""


@dataclass(frozen=True)
class Structure:
    """Which bodies have which unknowns.

    Parameters
    ----------
    moving
        Bodies whose release velocity and spin are unknown; the others are at rest when they are released.
    colliding
        Bodies that meet others, so that the motion can say something about mass and restitution (and yaw of a cube).
        Of those that meet nobody it says something about the mass only under effects by which that matters.
    bouncing
        Bodies that meet fixed things (walls, or obstacles that an effect adds), which say nothing about a mass, but
        about the rest.
    passing
        Cubes that come so near to something that their yaw decides whether they meet it.
    held
        Quantities that are not unknown though the model has them.
    """

    moving: frozenset[int]
    colliding: frozenset[int]
    bouncing: frozenset[int] = frozenset()
    passing: frozenset[int] = frozenset()
    held: Held = field(default_factory=dict)

    @property
    def meeting(self) -> frozenset[int]:
        """Bodies that meet something."""
        return self.colliding | self.bouncing

    @property
    def turning(self) -> frozenset[int]:
        """Bodies whose yaw the motion can say something about, if only that they passed."""
        return self.meeting | self.passing


def unknowns(
    tracks: Tracks,
    model: PhysicsModel,
    structure: Structure,
    noise: NoiseFamily = NoiseFamily.GAUSSIAN,
    model_error: ModelError | None = None,
) -> Coordinates:
    """The vector of unknowns of a video under a model, with the defaults of what is not sampled.

    With a model error the noise is none of them: it has the size that was found together with the error. Nor is noise
    that the tracks do not tell.
    """
    untold = untold_noise(tracks)
    entries = [
        *_motion(tracks, structure),
        *_turning(tracks, model, structure),
        *_matter(tracks, model, structure),
        *_physics(tracks, model, structure),
        *(_measurement(tracks, noise, told=untold is None) if model_error is None else ()),
    ]
    defaults = _defaults(tracks, model)
    if untold is not None:
        defaults[NOISE] = np.full(1, untold / Observations.of(tracks).position_reference)
    if model_error is not None:
        defaults[NOISE] = np.full(1, model_error.noise_scale)
        defaults[ANGLE_NOISE] = np.full(1, model_error.angle_noise_scale)
    for (name, owner), value in structure.held.items():
        if value is not None and name in defaults:
            defaults[name][owner or 0] = value
    return Coordinates(tuple(one for one in entries if (one.field, one.owner) not in structure.held), defaults)


def structure_of(coordinates: Coordinates, held: Held | None = None) -> Structure:
    """Which bodies have which unknowns in a fit; what is `held` in it, its coordinates do not tell."""
    owners = {
        field: frozenset(e.owner for e in coordinates.entries if e.field == field and e.owner is not None)
        for field in ("velocity_x", MASS.name, RESTITUTION.name, "angle")
    }
    # A weighed body that meets others counts among those that meet walls: it has the same unknowns. One that meets
    # nothing may have a mass, by which its motion is felt, and no restitution.
    return Structure(
        moving=owners["velocity_x"],
        colliding=owners[MASS.name] & owners[RESTITUTION.name],
        bouncing=owners[RESTITUTION.name],
        passing=owners["angle"] - owners[RESTITUTION.name],
        held=held or {},
    )


def _motion(tracks: Tracks, structure: Structure) -> Iterator[Coordinate]:
    """Where each body is released, and how fast."""
    first = first_positions(tracks)
    spread = np.nanmax(tracks.positions, axis=(0, 1)) - np.nanmin(tracks.positions, axis=(0, 1))
    extent = max(float(spread.max()), 1e-3)
    for body in range(len(tracks.bodies)):
        for axis, name in enumerate(("x", "y")):
            prior = Prior(float(first[body, axis]), extent)
            yield Coordinate(name, body, Transform.IDENTITY, prior, scale=0.01 * extent)
    for body in sorted(structure.moving):
        for name in ("velocity_x", "velocity_y"):
            yield Coordinate(name, body, Transform.IDENTITY, Prior(0.0, SPEED_SD), scale=0.1)


def _turning(tracks: Tracks, model: PhysicsModel, structure: Structure) -> Iterator[Coordinate]:
    """Yaw of cubes that meet or just pass something; spin of what is seen to turn, or whose spin matters."""
    measured = set(Observations.of(tracks).angle_bodies)
    angles = tracks.angles
    rubs = any(effect.overrides("tangential_impulse") for effect in model.effects)
    for body, description in enumerate(tracks.bodies):
        turning_cube = description.shape is Shape.CUBE and body in structure.turning
        if turning_cube:
            yield Coordinate("angle", body, Transform.IDENTITY, Prior(0.0, YAW_SD), scale=0.1)
        spin_matters = model.path_depends_on_spin or turning_cube or (rubs and body in structure.meeting)
        if body in structure.moving and (spin_matters or body in measured):
            prior = Prior(0.0, _spin_sd(description))
            yield Coordinate("spin", body, Transform.IDENTITY, prior, scale=0.1)
        if body in measured and angles is not None:
            seen = angles[:, body]
            first = float(seen[np.isfinite(seen)][0])
            yield Coordinate("angle_zero", body, Transform.IDENTITY, Prior(first, ANGLE_ZERO_SD), scale=0.1)


def _spin_sd(body: Body) -> float:
    """Prior standard deviation in rad/s of the spin of a body: small ones turn fast, round ones above all."""
    if body.radius is None:
        return SPIN_SD
    surface_speed = SURFACE_SPEED_SD if body.shape.is_disc else CUBE_SURFACE_SPEED_SD
    return max(SPIN_SD, surface_speed / body.radius)


def _matter(tracks: Tracks, model: PhysicsModel, structure: Structure) -> Iterator[Coordinate]:
    """Mass, where nobody weighed it (expected near the weighed ones, if any), and restitution of bodies and walls."""
    prior = mass_prior(tracks, model)
    for body in sorted(structure.colliding | felt_masses(model, structure.moving)):
        if tracks.bodies[body].mass is None:
            yield Coordinate(MASS.name, body, MASS.transform, prior, scale=0.1)
    for body in sorted(structure.meeting):
        yield Coordinate.of(model.believed(RESTITUTION), body)
    for index, wall in enumerate(tracks.walls):
        if wall.restitution is None:
            yield Coordinate.of(model.believed(WALL_RESTITUTION, wall.place), index)


def felt_masses(model: PhysicsModel, moving: frozenset[int]) -> frozenset[int]:
    """Bodies on whose mass their motion depends also where they meet nothing, of those that move."""
    return moving if model.path_depends_on_mass else frozenset()


def _physics(tracks: Tracks, model: PhysicsModel, structure: Structure) -> Iterator[Coordinate]:
    """Parameters of the model that can have an effect on these bodies."""
    turning = any(tracks.bodies[body].shape is Shape.CUBE for body in structure.turning)
    spin_matters = turning or model.path_depends_on_spin or bool(Observations.of(tracks).angle_bodies)
    walls = bool(tracks.walls) or any(effect.overrides("obstacles") for effect in model.effects)
    for parameter in model.parameters:
        if not parameter.inferred or (parameter.needs_walls and not walls):
            continue
        concerned = [index for index, body in enumerate(tracks.bodies) if body.shape in parameter.shapes]
        if parameter.scope.per_video and concerned and (spin_matters or parameter.name != ANGULAR_DRAG.name):
            yield Coordinate.of(parameter)
        if parameter.scope is Scope.BODY and parameter.name not in (MASS.name, RESTITUTION.name):
            for body in sorted((structure.moving | structure.meeting).intersection(concerned)):
                yield Coordinate.of(parameter, body)
        if parameter.scope is Scope.MATERIAL:
            for material, bodies in _by_material(tracks).items():
                if (structure.moving | structure.meeting).intersection(concerned, bodies):
                    believed = model.believed(parameter, (material,))
                    yield replace(Coordinate.of(believed, bodies[0]), group=material, others=bodies[1:])


def _by_material(tracks: Tracks) -> dict[str, tuple[int, ...]]:
    """Bodies of each material; those of which it is not stated are one of their own."""
    materials = sorted({body.material or NOT_STATED for body in tracks.bodies})
    return {
        material: tuple(i for i, body in enumerate(tracks.bodies) if (body.material or NOT_STATED) == material)
        for material in materials
    }


def _measurement(tracks: Tracks, noise: NoiseFamily, *, told: bool) -> Iterator[Coordinate]:
    """Size and shape of the measurement noise, its size as far as the tracks tell it."""
    if told:
        yield Coordinate(NOISE, None, Transform.LOG, Prior(0.0, NOISE_LOG_SD), scale=0.1)
    if Observations.of(tracks).angle_bodies:
        yield Coordinate(ANGLE_NOISE, None, Transform.LOG, Prior(0.0, NOISE_LOG_SD), scale=0.1)
    if noise is NoiseFamily.STUDENT_T:
        yield Coordinate(DEGREES_OF_FREEDOM, None, Transform.LOG, DEGREES_PRIOR, scale=0.1)


def _defaults(tracks: Tracks, model: PhysicsModel) -> dict[str, Float[np.ndarray, "owner"]]:
    """Every quantity where it is not sampled."""
    count = len(tracks.bodies)
    first = first_positions(tracks)
    walls = [
        model.believed(WALL_RESTITUTION, wall.place).default if wall.restitution is None else wall.restitution
        for wall in tracks.walls
    ]
    mass = _mass_default(tracks, model)
    defaults = {
        "x": first[:, 0],
        "y": first[:, 1],
        **{name: np.zeros(count) for name in ("velocity_x", "velocity_y", "angle", "spin", "angle_zero")},
        MASS.name: np.array([mass if body.mass is None else body.mass for body in tracks.bodies]),
        RESTITUTION.name: np.full(count, model.believed(RESTITUTION).default),
        WALL_RESTITUTION.name: np.array(walls),
        NOISE: np.ones(1),
        ANGLE_NOISE: np.ones(1),
        DEGREES_OF_FREEDOM: np.full(1, math.exp(DEGREES_PRIOR.mean)),
    }
    for parameter in model.parameters:
        if parameter.name not in defaults:
            owners = 1 if parameter.scope.per_video else count
            defaults[parameter.name] = np.full(owners, parameter.default)
        if parameter.scope is Scope.MATERIAL:
            for material, bodies in _by_material(tracks).items():
                defaults[parameter.name][list(bodies)] = model.believed(parameter, (material,)).default
    return defaults


def mass_prior(tracks: Tracks, model: PhysicsModel) -> Prior:
    """Prior of the log mass of a body that nobody weighed: around the weighed ones of the video, if any."""
    prior, middle = model.believed(MASS).prior, _weighed(tracks)
    return prior if middle is None else Prior(math.log(middle), prior.sd)


def prior_restitutions(
    model: PhysicsModel, shape: tuple[int, ...], generator: np.random.Generator
) -> Float[np.ndarray, "..."]:
    """Restitution factors from their prior, held to at most 1.

    The prior has a soft edge, for the sake of the samplers: about one draw in a thousand lies above 1, where collisions
    would give energy. These are drawn again.

    Parameters
    ----------
    model
        The physics, whose prior it is.
    shape
        How many.
    generator
        Source of the draws.
    """

    def draw(shape: tuple[int, ...]) -> Float[np.ndarray, "..."]:
        coordinates = torch.from_numpy(model.believed(RESTITUTION).prior.sample(generator, shape))
        factors: np.ndarray = RESTITUTION.transform.from_coordinate(coordinates).numpy()
        return factors

    drawn = draw(shape)
    while (above := drawn > 1).any():
        drawn[above] = draw((int(above.sum()),))
    return drawn


def _mass_default(tracks: Tracks, model: PhysicsModel) -> float:
    """Mass in kg of a body that nobody weighed."""
    middle = _weighed(tracks)
    return model.believed(MASS).default if middle is None else middle


def _weighed(tracks: Tracks) -> float | None:
    """Middle mass in kg of the weighed bodies of a video; None where there are none."""
    weighed = [body.mass for body in tracks.bodies if body.mass is not None]
    return float(np.exp(np.median(np.log(weighed)))) if weighed else None


def first_positions(tracks: Tracks) -> Float[np.ndarray, "body 2"]:
    """Position in m of each body where it was first seen."""
    frames = tracks.seen.argmax(axis=0)
    return tracks.positions[frames, np.arange(len(tracks.bodies))]
