"""Discs that slide and collide, by small fixed steps: made for tests, in code of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import torch

from vrdp_prob.inference import BodyStatus, Convergence, ParameterStatus, Status
from vrdp_prob.models.effects.mass_dependent_friction import MASS_EXPONENT, MassDependentFriction
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Body, Camera, Shape, Tracks

RADIUS = 0.2
GRAVITY = 9.81
FRICTION = 0.04
STEP = 5e-4
FRAME = 0.04
COLORS = ("red", "blue", "green", "yellow", "purple")


@dataclass(frozen=True)
class Disc:
    """A cylinder with its state at its release."""

    position: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    mass: float = 1.0
    restitution: float = 0.9
    friction: float = FRICTION
    release: float = 0.0


def path(discs: Sequence[Disc], frames: int) -> tuple[np.ndarray, list[tuple[float, int, int]]]:
    """Positions (frame, disc, 2), NaN before the release, and first contacts (time in s, first, second)."""
    position = np.array([disc.position for disc in discs], dtype=float)
    velocity = np.array([disc.velocity for disc in discs], dtype=float)
    mass = np.array([disc.mass for disc in discs])
    slowing = np.array([disc.friction for disc in discs]) * GRAVITY
    release = np.array([disc.release for disc in discs])
    shown, contacts = np.full((frames, len(discs), 2), np.nan), []
    steps = round(FRAME / STEP)
    for step in range((frames - 1) * steps + 1):
        time = step * STEP
        there = time >= release - 1e-9
        if step % steps == 0:
            shown[step // steps, there] = position[there]
        for first, second in combinations(np.flatnonzero(there).tolist(), 2):
            apart = position[second] - position[first]
            distance = float(np.linalg.norm(apart))
            normal = apart / distance
            closing = float((velocity[first] - velocity[second]) @ normal)
            if distance < 2 * RADIUS and closing > 0:
                reduced = mass[first] * mass[second] / (mass[first] + mass[second])
                impulse = (1 + discs[first].restitution * discs[second].restitution) * reduced * closing
                velocity[first] -= impulse / mass[first] * normal
                velocity[second] += impulse / mass[second] * normal
                if not any({first, second} == {a, b} for _, a, b in contacts):
                    contacts.append((time, first, second))
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        slower = np.maximum(speed - slowing[:, None] * STEP, 0)
        velocity = np.where(there[:, None], velocity * slower / np.maximum(speed, 1e-12), velocity)
        position = np.where(there[:, None], position + velocity * STEP, position)
    return shown, contacts


def tracks_of(
    discs: Sequence[Disc], frames: int = 128, *, noise: float = 0.005, camera: Camera | None = None, seed: int = 0
) -> Tracks:
    """Noisy tracks of the discs, each of another colour."""
    shown, _ = path(discs, frames)
    measured = shown + noise * np.random.default_rng(seed).standard_normal(shown.shape)
    bodies = tuple(
        Body(str(place), Shape.CYLINDER, radius=RADIUS, material="metal", color=COLORS[place])
        for place in range(len(discs))
    )
    return Tracks.from_arrays("discs", bodies, np.arange(frames) * FRAME, measured, camera=camera)


@dataclass(frozen=True)
class KnownPosterior:
    """A posterior that knows masses and restitutions up to a spread, and friction on average."""

    tracks: Tracks
    discs: tuple[Disc, ...]
    spread: float = 0.02
    mass_spread: float | None = None
    seed: int = 0
    statuses: tuple[Status, ...] = ()
    total: int = 400
    effective: float | None = None
    mass_exponent: float | None = None
    """Power of the mass with which friction grows beside each disc's own, for a model with that effect."""

    @property
    def model(self) -> PhysicsModel:
        base = PhysicsModel.base()
        return base if self.mass_exponent is None else base.with_effect(MassDependentFriction())

    @property
    def convergence(self) -> Convergence:
        return Convergence(
            sampler="laplace", converged=True, r_hat=None, ess_bulk=self.effective, divergences=None, pareto_k=None
        )

    @property
    def status(self) -> dict[str, BodyStatus]:
        statuses = self.statuses or (Status.IDENTIFIED,) * len(self.discs)
        known = [ParameterStatus(status, ()) for status in statuses]
        return {body.id: BodyStatus(s, s) for body, s in zip(self.tracks.bodies, known, strict=True)}

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        del generator
        random = np.random.default_rng(self.seed)
        number, size = self.total, len(self.discs)

        def values(name: str) -> torch.Tensor:
            array = np.array([getattr(disc, name) for disc in self.discs], dtype=float)
            return torch.from_numpy(np.broadcast_to(array, (number, *array.shape)).copy())

        def spread(size_of_it: float) -> torch.Tensor:
            return torch.from_numpy(np.exp(size_of_it * random.standard_normal((number, size))))

        mass_spread = self.spread if self.mass_spread is None else self.mass_spread
        held = torch.tensor([one.mass.status is Status.DEFAULT for one in self.status.values()])
        zero = torch.zeros(number, size, dtype=torch.float64)
        shared = {"sliding_friction": FRICTION, "rolling_resistance": 0.01, "air_drag": 1e-6, "angular_drag": 0.1}
        if self.mass_exponent is not None:
            shared |= {MASS_EXPONENT.name: self.mass_exponent}
        chosen = np.linspace(0, number - 1, min(count or number, number)).round().astype(int)
        everything = Worlds(
            shapes=(Shape.CYLINDER,) * size,
            position=values("position"),
            velocity=values("velocity"),
            angle=zero,
            spin=zero,
            release_time=values("release"),
            mass=values("mass") * torch.where(held, 1.0, spread(mass_spread)),
            restitution=torch.clamp(values("restitution") * spread(self.spread), max=1.0),
            radius=torch.full_like(zero, RADIUS),
            present=torch.ones(number, size, dtype=torch.bool),
            parameters={name: torch.full((number,), value, dtype=torch.float64) for name, value in shared.items()},
        )
        return everything.select(chosen.tolist())


def changed(discs: Sequence[Disc], place: int, *, mass: float) -> list[Disc]:
    """The same discs, one of them with its mass multiplied."""
    return [replace(d, mass=d.mass * mass) if p == place else d for p, d in enumerate(discs)]
