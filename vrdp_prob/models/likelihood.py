"""Log density of the tracks of one video, given its unknowns as one unconstrained vector."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.observation import Observations
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.models.unknowns import ANGLE_NOISE, NOISE
from vrdp_prob.scene import Tracks

EVENT_LIMIT = 1000
"""Events of one world after which it counts as impossible; a video shows a few dozen at most, and bodies that press on
each other some hundred."""
LOG_TWO_PI = float(np.log(2 * np.pi))


@dataclass(frozen=True)
class Likelihood:
    """Density of what was seen, as a function of a vector of unknowns.

    Parameters
    ----------
    tracks
        What was seen.
    model
        The physics.
    coordinates
        The unknowns and their priors.
    information
        Share of an independent observation that each seen number counts for. Below 1 where the residuals of the best
        fit are correlated in time, which is what a wrong model leaves behind: the intervals become wider.
    """

    tracks: Tracks
    model: PhysicsModel
    coordinates: Coordinates
    information: float = 1.0

    @cached_property
    def observations(self) -> Observations:
        """What was seen, as flat lists."""
        return Observations.of(self.tracks)

    def informed(self, share: float) -> "Likelihood":
        """The same with another share of information per observation."""
        return replace(self, information=share)

    def worlds(self, points: Float[Tensor, "point dimension"]) -> Worlds:
        """The worlds that points stand for."""
        quantity = {field: self.coordinates.quantity(field, points) for field in self.coordinates.defaults}
        return worlds_of(self.tracks, self.model, quantity)

    def rollout(self, points: Float[Tensor, "point dimension"], frame_count: int | None = None) -> Rollout:
        """Simulate the worlds of some points over the (first) frames of the video."""
        times = torch.tensor(self.tracks.times[:frame_count])
        return simulate(self.worlds(points), times, self.model, event_limit=EVENT_LIMIT)

    def residuals(
        self, points: Float[np.ndarray, "point dimension"], frame_count: int | None = None
    ) -> Float[np.ndarray, "point residual"]:
        """Residuals of unit variance: positions, angles, then the prior; a row of NaN where a world fails."""
        with torch.no_grad():
            vector = torch.from_numpy(np.ascontiguousarray(points))
            data, valid = self._data_residuals(vector, frame_count)
            data = data * self.information**0.5
            residuals = torch.cat([data, self.coordinates.prior_residuals(vector)], dim=1).numpy()
        residuals[~valid] = np.nan
        return residuals

    def log_density(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point"]:
        """Log posterior density (nats) in the vector's units; -inf where a world fails. Differentiable."""
        data, valid = self._data_residuals(points, None)
        log_likelihood = -self.information * ((data**2).sum(dim=1) / 2 + self._log_scale(points))
        log_prior = -(self.coordinates.prior_residuals(points) ** 2).sum(dim=1) / 2
        minus_infinity = torch.full_like(log_prior, -torch.inf)
        return torch.where(torch.from_numpy(valid), log_likelihood + log_prior, minus_infinity)

    def pointwise(self, points: Float[Tensor, "point dimension"]) -> Float[np.ndarray, "point time body"]:
        """Log likelihood of each seen position (both axes together); NaN where nothing was seen."""
        observations = self.observations
        with torch.no_grad():
            data, _ = self._data_residuals(points, None)
            scale = self.coordinates.quantity(NOISE, points)
        count = len(observations.frame)
        squares = (data[:, : 2 * count].numpy() ** 2).reshape(len(points), count, 2).sum(axis=2)
        determinant = np.log(np.abs(np.linalg.det(observations.whitening)))
        values = -squares / 2 - LOG_TWO_PI + determinant - 2 * np.log(scale.numpy())
        result = np.full((len(points), *self.tracks.seen.shape), np.nan)
        result[:, observations.frame, observations.body] = values
        return result

    @property
    def data_count(self) -> int:
        """Number of seen numbers (two per position, one per angle)."""
        return 2 * len(self.observations.frame) + len(self.observations.angle)

    def _data_residuals(
        self, points: Float[Tensor, "point dimension"], frame_count: int | None
    ) -> tuple[Float[Tensor, "point residual"], Bool[np.ndarray, "point"]]:
        observations = self.observations if frame_count is None else self.observations.until(frame_count)
        rollout = self.rollout(points, frame_count)
        trajectory = rollout.trajectory
        position = trajectory[:, observations.frame, observations.body, :2] - torch.from_numpy(observations.position)
        whitened = torch.einsum("oij,poj->poi", torch.from_numpy(observations.whitening), position)
        scaled = whitened.flatten(1) / self.coordinates.quantity(NOISE, points)
        parts = [scaled]
        if len(observations.angle):
            zero = self.coordinates.quantity("angle_zero", points)[:, observations.angle_body]
            predicted = trajectory[:, observations.angle_frame, observations.angle_body, 2] + zero
            angle = (predicted - torch.from_numpy(observations.angle)) / observations.angle_reference
            parts.append(angle / self.coordinates.quantity(ANGLE_NOISE, points))
        residuals = torch.cat(parts, dim=1)
        valid = rollout.fine & torch.isfinite(residuals).all(dim=1).numpy()
        return residuals, valid

    def _log_scale(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point"]:
        """Sum of the log noise scales over all seen numbers."""
        noise = self.coordinates.quantity(NOISE, points)[:, 0].log()
        total = 2 * len(self.observations.frame) * noise
        if len(self.observations.angle):
            total = total + len(self.observations.angle) * self.coordinates.quantity(ANGLE_NOISE, points)[:, 0].log()
        return total


def worlds_of(tracks: Tracks, model: PhysicsModel, quantity: Mapping[str, Float[Tensor, "point owner"]]) -> Worlds:
    """Worlds from the values of all quantities (one column per body, or one if shared)."""
    count = len(quantity["x"])
    release = torch.from_numpy(tracks.first_seen).expand(count, -1)
    radii = [body.radius for body in tracks.bodies]
    radius = torch.tensor([UNKNOWN_RADIUS if value is None else value for value in radii], dtype=torch.float64)
    walls = np.array([(wall.x1, wall.y1, wall.x2, wall.y2) for wall in tracks.walls]).reshape(-1, 4)
    return Worlds(
        shapes=tuple(body.shape for body in tracks.bodies),
        position=torch.stack([quantity["x"], quantity["y"]], dim=-1),
        velocity=torch.stack([quantity["velocity_x"], quantity["velocity_y"]], dim=-1),
        angle=quantity["angle"],
        spin=quantity["spin"],
        release_time=release,
        mass=quantity["mass"],
        restitution=quantity["restitution"],
        radius=radius.expand(count, -1),
        present=torch.ones(count, len(tracks.bodies), dtype=torch.bool),
        parameters={
            one.name: quantity[one.name] if one.scope is Scope.BODY else quantity[one.name][:, 0]
            for one in model.parameters
        },
        walls=torch.from_numpy(walls),
        wall_restitution=quantity["wall_restitution"],
        inertia=_inertia(tracks, count),
    )


def _inertia(tracks: Tracks, count: int) -> Float[Tensor, "world body"] | None:
    """Known moments of inertia (kg m^2), NaN where they follow from mass and shape; None where none is known."""
    known = [body.inertia for body in tracks.bodies]
    if all(value is None for value in known):
        return None
    values = [float("nan") if value is None else value for value in known]
    return torch.tensor(values, dtype=torch.float64).expand(count, -1)


UNKNOWN_RADIUS = 1e-6
"""Radius in m of a body whose radius is not known: it meets nothing."""
