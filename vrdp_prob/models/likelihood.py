"""Log density of the tracks of one video, given its unknowns as one unconstrained vector."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.measurement import changes_clock, changes_positions, measured_positions, true_times
from vrdp_prob.models.observation import Observations
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.scenery import Quantities, Scenery
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

    @cached_property
    def _scenery(self) -> Scenery:
        return Scenery.of(self.tracks)

    @cached_property
    def _times(self) -> Float[Tensor, "time"]:
        return torch.tensor(self.tracks.times)

    def rollout(self, points: Float[Tensor, "point dimension"], frame_count: int | None = None) -> Rollout:
        """Simulate the worlds of some points over the (first) frames of the video."""
        return self._rollout(self._worlds(self.coordinates.quantities(points)), frame_count)[0]

    def _worlds(self, quantities: Quantities) -> Worlds:
        return self._scenery.worlds(self.model, quantities)

    def _rollout(self, worlds: Worlds, frame_count: int | None) -> tuple[Rollout, Bool[np.ndarray, "point"]]:
        """Rollout over the frames, and whether each world has a clock that goes forward and was simulated."""
        times, forward = self._times[:frame_count], np.ones(len(worlds), dtype=bool)
        if changes_clock(self.model):
            true, increasing = true_times(self.model, worlds.parameters, self._times.expand(len(worlds), -1))
            worlds = worlds.released_at(true[:, self.tracks.seen.argmax(axis=0)])
            times, forward = true[:, :frame_count], increasing.numpy()
        rollout = simulate(worlds, times, self.model, event_limit=EVENT_LIMIT)
        return rollout, forward & rollout.fine

    def _measured(self, worlds: Worlds, rollout: Rollout) -> Float[Tensor, "point number"]:
        """Numbers (x, y, angle) of all frames and bodies as they are measured, in a row for each world."""
        trajectory = rollout.trajectory
        if changes_positions(self.model):
            seen = measured_positions(self.model, worlds.parameters, trajectory[..., :2], rollout.times)
            trajectory = torch.cat([seen, trajectory[..., 2:]], dim=-1)
        return trajectory.flatten(1)

    def residuals(
        self, points: Float[np.ndarray, "point dimension"], frame_count: int | None = None
    ) -> Float[np.ndarray, "point residual"]:
        """Residuals of unit variance: positions, angles, then the prior; a row of NaN where a world fails."""
        with torch.no_grad():
            vector = torch.from_numpy(np.ascontiguousarray(points))
            data, valid = self._data_residuals(self.coordinates.quantities(vector), frame_count)
            data = data * self.information**0.5
            residuals = torch.cat([data, self.coordinates.prior_residuals(vector)], dim=1).numpy()
        residuals[~valid] = np.nan
        return residuals

    def log_density(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point"]:
        """Log posterior density (nats) in the vector's units; -inf where a world fails. Differentiable."""
        quantities = self.coordinates.quantities(points)
        data, valid = self._data_residuals(quantities, None)
        log_likelihood = -self.information * ((data**2).sum(dim=1) / 2 + self._log_scale(quantities))
        log_prior = -(self.coordinates.prior_residuals(points) ** 2).sum(dim=1) / 2
        minus_infinity = torch.full_like(log_prior, -torch.inf)
        return torch.where(torch.from_numpy(valid), log_likelihood + log_prior, minus_infinity)

    def predicted(self, points: Float[Tensor, "point dimension"]) -> Float[np.ndarray, "point time body 3"]:
        """Positions (m) and angles (rad) of all frames and bodies as they would be measured without noise."""
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            worlds = self._worlds(quantities)
            states = self._measured(worlds, self._rollout(worlds, None)[0]).numpy()
        predicted: np.ndarray = states.reshape(len(points), *self.tracks.seen.shape, 3)
        predicted[..., 2] += quantities["angle_zero"].numpy()[:, None]
        return predicted

    def pointwise(self, points: Float[Tensor, "point dimension"]) -> Float[np.ndarray, "point time body"]:
        """Log likelihood of each seen position (both axes together); NaN where nothing was seen."""
        observations = self.observations
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            data, _ = self._data_residuals(quantities, None)
        count = len(observations.frame)
        squares = (data[:, : 2 * count].numpy() ** 2).reshape(len(points), count, 2).sum(axis=2)
        determinant = np.log(np.abs(np.linalg.det(observations.whitening)))
        values = -squares / 2 - LOG_TWO_PI + determinant - 2 * np.log(quantities[NOISE].numpy())
        result = np.full((len(points), *self.tracks.seen.shape), np.nan)
        result[:, observations.frame, observations.body] = values
        return result

    def _data_residuals(
        self, quantities: Quantities, frame_count: int | None
    ) -> tuple[Float[Tensor, "point residual"], Bool[np.ndarray, "point"]]:
        observations = self.observations if frame_count is None else self.observations.until(frame_count)
        worlds = self._worlds(quantities)
        rollout, valid = self._rollout(worlds, frame_count)
        states = self._measured(worlds, rollout)
        # index_select, because its derivative is many times faster than that of indexing with several arrays.
        position = states.index_select(1, observations.position_places).reshape(len(states), -1, 2)
        difference = position - torch.from_numpy(observations.position)
        whitened = (torch.from_numpy(observations.whitening) * difference[:, :, None]).sum(dim=-1)
        parts = [whitened.flatten(1) / quantities[NOISE]]
        if len(observations.angle):
            zero = quantities["angle_zero"][:, observations.angle_body]
            predicted = states.index_select(1, observations.angle_places) + zero
            angle = (predicted - torch.from_numpy(observations.angle)) / observations.angle_reference
            parts.append(angle / quantities[ANGLE_NOISE])
        residuals = torch.cat(parts, dim=1)
        return residuals, valid & torch.isfinite(residuals).all(dim=1).numpy()

    def _log_scale(self, quantities: Quantities) -> Float[Tensor, "point"]:
        """Sum of the log noise scales over all seen numbers."""
        total = 2 * len(self.observations.frame) * quantities[NOISE][:, 0].log()
        if len(self.observations.angle):
            total = total + len(self.observations.angle) * quantities[ANGLE_NOISE][:, 0].log()
        return total
