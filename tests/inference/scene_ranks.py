"""Where what is true of a scene lies among the draws of its posterior.

Over many scenes from the prior these ranks are uniform if, and only if, the draws are those of the posterior. Source:
Talts, Betancourt, Simpson, Vehtari and Gelman, Validating Bayesian inference algorithms with simulation-based
calibration (2018); Modrak et al., Simulation-based calibration checking for Bayesian computation: the choice of test
quantities shapes sensitivity, Bayesian Analysis (2023), for the log likelihood as a test quantity.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
import torch
import xarray as xr

from tests.inference.prior_scenes import PriorScene
from vrdp_prob.inference import Posterior
from vrdp_prob.models.simulator.rollout import simulate

LEVELS = 99
"""Draws, evenly spaced among all and so nearly independent, among which the truth is ranked: 0 to 99."""

KINDS = (
    "log mass ratio",
    "mass",
    "pair restitution",
    "restitution",
    "velocity",
    "position",
    "spin",
    "yaw",
    "sliding friction",
    "rolling resistance",
    "friction ratio",
    "air drag",
    "angular drag",
    "noise",
    "log likelihood",
)


@dataclass(frozen=True)
class Rank:
    """Place of one true value.

    Parameters
    ----------
    kind
        Kind of quantity, one of `KINDS`.
    name
        Which one of the scene.
    rank
        Number of the `LEVELS` draws below the truth.
    below
        Share of all draws below it.
    error
        Distance of the draws' mean from the truth in units of their standard deviation.
    """

    kind: str
    name: str
    rank: int
    below: float
    error: float

    def to_document(self) -> dict[str, object]:
        """The fields by name."""
        return asdict(self)


def ranks(scene: PriorScene, posterior: Posterior) -> list[Rank]:
    """Ranks of everything that was sampled; what keeps a fixed default has none."""
    found = []
    for kind, name, truth, values in _quantities(scene, posterior):
        draws = np.asarray(values, dtype=float).ravel()
        if np.ptp(draws) > 0:
            chosen = draws[np.linspace(0, len(draws) - 1, min(LEVELS, len(draws))).round().astype(int)]
            error = float((draws.mean() - truth) / draws.std())
            found.append(Rank(kind, name, int((chosen < truth).sum()), float((draws < truth).mean()), error))
    return found


Quantity = tuple[str, str, float, np.ndarray]


def _quantities(scene: PriorScene, posterior: Posterior) -> Iterator[Quantity]:
    """Kind, name, true value and draws."""
    draws = posterior.data["posterior"].to_dataset()
    yield from _of_pairs(scene, posterior, draws)
    true = scene.scene
    for index, body in enumerate(scene.tracks.bodies):
        own = draws.sel(body=body.id)
        for name in ("mass", "restitution", "spin"):
            yield name, f"{name} {body.id}", float(getattr(true, name)[index]), own[name].values
        yield (
            "friction ratio",
            f"friction ratio {body.id}",
            float(scene.friction_ratio[index]),
            (own["friction_ratio"].values),
        )
        # a square looks the same after a quarter turn
        yield "yaw", f"yaw {body.id}", float(np.cos(4 * true.angle[index])), np.cos(4 * own["angle"].values)
        release = int(scene.tracks.seen[:, index].argmax())
        for axis, label in enumerate("xy"):
            yield (
                "velocity",
                f"velocity {label} {body.id}",
                float(true.velocity[index, axis]),
                (own["velocity"].values[..., axis]),
            )
            yield (
                "position",
                f"position {label} {body.id}",
                float(scene.exact[release, index, axis]),
                (own["position"].values[..., axis]),
            )
    for name, value in scene.shared.items():
        if name in draws:
            yield name.replace("_", " "), name, value, draws[name].values
    noise = draws["noise_scale"]
    yield "noise", "noise", scene.noise, noise.values * noise.attrs["reference_m"]
    yield "log likelihood", "log likelihood", *_log_likelihoods(scene, posterior)


def _of_pairs(scene: PriorScene, posterior: Posterior, draws: xr.Dataset) -> Iterator[Quantity]:
    """Ratios and products of the pairs that the posterior says collide."""
    ids = [body.id for body in scene.tracks.bodies]
    for first, second in posterior.pairs:
        i, j = ids.index(first), ids.index(second)
        mass, restitution = draws["mass"].values, draws["restitution"].values
        truth = float(np.log(scene.scene.mass[i] / scene.scene.mass[j]))
        yield "log mass ratio", f"mass {first}/{second}", truth, np.log(mass[..., i] / mass[..., j])
        truth = float(scene.scene.restitution[i] * scene.scene.restitution[j])
        yield "pair restitution", f"restitution {first}*{second}", truth, restitution[..., i] * restitution[..., j]


def _log_likelihoods(scene: PriorScene, posterior: Posterior) -> tuple[float, np.ndarray]:
    """Gaussian log likelihood (nats, up to a constant) of the truth and of some draws."""
    worlds = posterior.worlds(LEVELS)
    with torch.no_grad():
        trajectory = simulate(worlds, torch.tensor(scene.tracks.times), posterior.model).trajectory.numpy()
    scale = posterior.data["posterior"]["noise_scale"]
    noise = scale.values.ravel() * scale.attrs["reference_m"]
    chosen = np.linspace(0, len(noise) - 1, len(worlds)).round().astype(int)
    return (
        _log_likelihood(scene, scene.exact, scene.noise),
        np.array([_log_likelihood(scene, *one) for one in zip(trajectory[..., :2], noise[chosen], strict=True)]),
    )


def _log_likelihood(scene: PriorScene, positions: np.ndarray, noise: float) -> float:
    residuals = (scene.tracks.positions - positions)[scene.tracks.seen]
    return float(-((residuals / noise) ** 2).sum() / 2 - residuals.size * np.log(noise))
