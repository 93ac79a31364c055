"""The posterior of a scene to first order around what is true of it, which needs no search and no sampler.

Its mean is as far from the truth as this very noise moves it, and its standard deviations are those of the expansion.
So it tells errors that an exact posterior would make as well, by the chance of these scenes, from those of the
inference.
"""

from dataclasses import dataclass

import numpy as np
import torch

from tests.inference.prior_scenes import SHARED, PriorScene
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.parameters import MASS, RESTITUTION, Parameter, Prior
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.models.unknowns import SPEED_SD, SPIN_SD, YAW_SD
from vrdp_prob.scene import Shape

STEP = 1e-6
"""Difference of a number by which the motion is differentiated."""
DRAWS = 2000
ANYWHERE = 1e3
"""Prior standard deviation in m of positions, which the measurement knows far better."""


@dataclass(frozen=True)
class _Number:
    """An unknown of a scene; the logarithm of it where it is positive."""

    field: str
    place: tuple[int, ...]
    value: float
    prior: Prior


def linear_errors(scene: PriorScene) -> dict[str, float]:
    """Errors of means in standard deviations, by the names that ranks give them.

    Those of positions, velocities and mass ratios of pairs that meet are standard normal to first order over scenes
    from the prior, however scenes are chosen by their measurement.
    """
    numbers = _unknowns(scene)
    values = np.array([one.value for one in numbers])
    steps = STEP * np.eye(len(numbers))
    positions = _positions(scene, numbers, np.concatenate([values + steps, values - steps]))
    seen = np.broadcast_to(scene.tracks.seen[..., None], scene.exact.shape)
    slopes = ((positions[: len(numbers)] - positions[len(numbers) :]) / (2 * STEP))[:, seen].T / scene.noise
    noise = (scene.tracks.positions - scene.exact)[seen] / scene.noise
    means, sds = (np.array([getattr(one.prior, what) for one in numbers]) for what in ("mean", "sd"))
    covariance = np.linalg.inv(slopes.T @ slopes + np.diag(sds**-2.0))
    mean = covariance @ (slopes.T @ noise - (values - means) / sds**2)
    error = mean / np.sqrt(np.diag(covariance))
    found = {
        f"{one.field} {'xy'[one.place[1]]} {one.place[0]}": float(size)
        for one, size in zip(numbers, error, strict=True)
        if one.field in ("position", "velocity")
    }
    masses = {one.place[0]: k for k, one in enumerate(numbers) if one.field == MASS.name}
    for i, j in {tuple(sorted(map(int, pair))) for pair in scene.pairs}:
        ratio = np.zeros(len(numbers))
        ratio[[masses[i], masses[j]]] = 1.0, -1.0
        found[f"mass {i}/{j}"] = float(ratio @ mean / np.sqrt(ratio @ covariance @ ratio))
    generator = np.random.default_rng(scene.seed)
    draws = generator.multivariate_normal(mean, covariance, DRAWS, method="cholesky")
    return found | {"log likelihood": _log_likelihood_error(noise, slopes @ draws.T, generator)}


def _log_likelihood_error(noise: np.ndarray, moved: np.ndarray, generator: np.random.Generator) -> float:
    """Error of the mean log likelihood of draws, which believe in the size of the noise that their residuals show."""
    squares = ((noise[:, None] - moved) ** 2).sum(axis=0)
    scale = np.sqrt(squares / len(noise)) * np.exp(generator.standard_normal(len(squares)) / np.sqrt(2 * len(noise)))
    draws = -squares / scale**2 / 2 - len(noise) * np.log(scale)
    return float((draws.mean() + (noise**2).sum() / 2) / draws.std())


def _unknowns(scene: PriorScene) -> list[_Number]:
    """Everything that a scene does not tell; what rests is known to rest."""
    true, found = scene.scene, []
    for body, shape in enumerate(true.shapes):
        moves = bool(true.velocity[body].any())
        for axis in range(2):
            place, velocity = float(true.position[body, axis]), float(true.velocity[body, axis])
            found.append(_Number("position", (body, axis), place, Prior(place, ANYWHERE)))
            if moves:
                found.append(_Number("velocity", (body, axis), velocity, Prior(0.0, SPEED_SD)))
        own = {MASS: true.mass[body], RESTITUTION: true.restitution[body], FRICTION_RATIO: scene.friction_ratio[body]}
        found += [_logarithm(parameter, (body,), value) for parameter, value in own.items()]
        if shape is Shape.CUBE:
            found.append(_Number("angle", (body,), float(true.angle[body]), Prior(0.0, YAW_SD)))
            if moves:
                found.append(_Number("spin", (body,), float(true.spin[body]), Prior(0.0, SPIN_SD)))
    return found + [_logarithm(parameter, (), scene.shared[parameter.name]) for parameter in SHARED]


def _logarithm(parameter: Parameter, place: tuple[int, ...], value: float) -> _Number:
    return _Number(parameter.name, place, float(np.log(value)), parameter.prior)


def _positions(scene: PriorScene, numbers: list[_Number], points: np.ndarray) -> np.ndarray:
    """Positions [point, time, body, 2] in m where unknowns have other values."""
    true, count = scene.scene, len(points)
    fields = {
        "position": true.position,
        "velocity": true.velocity,
        "angle": true.angle,
        "spin": true.spin,
        MASS.name: np.log(true.mass),
        RESTITUTION.name: np.log(true.restitution),
        FRICTION_RATIO.name: np.log(scene.friction_ratio),
        **{name: np.log(value) for name, value in scene.shared.items()},
    }
    moved = {name: np.tile(value, (count,) + (1,) * np.ndim(value)) for name, value in fields.items()}
    for number, values in zip(numbers, points.T, strict=True):
        moved[number.field][(slice(None), *number.place)] = values
    states = {name: torch.from_numpy(moved.pop(name)) for name in ("position", "velocity", "angle", "spin")}
    tensors = {name: torch.from_numpy(np.exp(values)) for name, values in moved.items()}
    worlds = Worlds(
        shapes=true.shapes,
        **states,
        mass=tensors.pop(MASS.name),
        restitution=tensors.pop(RESTITUTION.name),
        release_time=torch.from_numpy(np.tile(true.release, (count, 1))),
        radius=torch.from_numpy(np.tile(true.radius, (count, 1))),
        present=torch.ones(count, len(true.shapes), dtype=torch.bool),
        parameters=tensors,
    )
    return simulate(worlds, torch.tensor(scene.tracks.times), default_model()).trajectory[..., :2].numpy()
