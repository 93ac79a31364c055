"""Log density of the tracks of one video, given its unknowns as one unconstrained vector."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.lateness import Lateness
from vrdp_prob.models.measurement import (
    changes_clock,
    changes_positions,
    frame_jitter,
    jitters,
    measured_positions,
    true_times,
)
from vrdp_prob.models.model_error import ModelError, Strands, Whitening
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.observation import Observations
from vrdp_prob.models.parameters import FRAME_JITTER
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.scenery import Quantities, Scenery
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.models.unknowns import ANGLE_NOISE, DEGREES_OF_FREEDOM, NOISE
from vrdp_prob.scene import Tracks

EVENT_LIMIT = 1000
"""Events of one world after which it counts as impossible; a video shows a few dozen at most, and bodies that press on
each other some hundred."""
FASTEST = 300.0
"""Release spin, in standard deviations of what is believed of it, from which a world counts as impossible: a step of a
search along numbers of which the tracks tell nothing can ask for 1e8 rad/s, which take minutes to follow."""


@dataclass(frozen=True)
class Discrepancies:
    """Differences of what was seen from simulated worlds, whitened, at noise scale 1.

    Parameters
    ----------
    positions
        Of each seen position.
    angles
        Of each measured angle.
    rates
        Change of all of them, positions first, per second by which their frame is late; None where the model has no
        frames that are late by chance.
    """

    positions: Float[Tensor, "point observation 2"]
    angles: Float[Tensor, "point angle"]
    rates: Float[Tensor, "point number"] | None = None


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
    noise
        Distribution of the measurement errors.
    model_error
        What the model leaves unexplained; None where it explains everything. It goes with Gaussian noise.
    left_out
        Sights that do not count, though the bodies were there; None for none.
    """

    tracks: Tracks
    model: PhysicsModel
    coordinates: Coordinates
    noise: NoiseFamily = NoiseFamily.GAUSSIAN
    model_error: ModelError | None = None
    left_out: Bool[np.ndarray, "time body"] | None = None

    @cached_property
    def observations(self) -> Observations:
        """What was seen, as flat lists."""
        return Observations.of(self.tracks, self.left_out)

    @cached_property
    def strands(self) -> Strands:
        """The residuals body by body, as a model error sees them."""
        return Strands.of(self.observations, self.tracks.times)

    @cached_property
    def _whitening(self) -> Whitening | None:
        return None if self.model_error is None else Whitening.of(self.model_error, self.strands)

    @cached_property
    def _scenery(self) -> Scenery:
        return Scenery.of(self.tracks)

    @cached_property
    def _fastest(self) -> Float[Tensor, "body"]:
        """Release spin in rad/s of each body that is simulated at most."""
        fastest = torch.full((len(self.tracks.bodies),), torch.inf, dtype=torch.float64)
        for entry in self.coordinates.entries:
            if entry.field == "spin" and entry.owner is not None:
                fastest[entry.owner] = FASTEST * entry.prior.sd
        return fastest

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
        """Residuals of unit variance: positions, angles, then the prior; a row of NaN where a world fails.

        Half their sum of squares is the negative log posterior, but for the terms of the noise scales (which hang on
        the velocities, too, where frames are late by chance).
        """
        with torch.no_grad():
            residuals = self.differentiable_residuals(torch.from_numpy(np.ascontiguousarray(points)), frame_count)
        return residuals.numpy()

    def differentiable_residuals(
        self, points: Float[Tensor, "point dimension"], frame_count: int | None = None
    ) -> Float[Tensor, "point residual"]:
        """The same residuals; gradients flow through the rows of worlds that do not fail."""
        quantities = self.coordinates.quantities(points)
        discrepancies, valid = self._discrepancies(quantities, frame_count)
        data = self._independent(discrepancies, quantities)
        prior = self.coordinates.prior_residuals(points)
        residuals = torch.cat([*(part.flatten(1) for part in data), prior], dim=1)
        return residuals.masked_fill(torch.from_numpy(~valid)[:, None], torch.nan)

    def log_density(self, points: Float[Tensor, "point dimension"]) -> Float[Tensor, "point"]:
        """Log posterior density (nats) in the vector's units; -inf where a world fails. Differentiable."""
        discrepancies, valid = self._discrepancies(self.coordinates.quantities(points), None)
        density = self.log_density_given(discrepancies, points)
        return torch.where(torch.from_numpy(valid), density, torch.full_like(density, -torch.inf))

    def discrepancies(self, points: Float[Tensor, "point dimension"]) -> Discrepancies:
        """Differences of what was seen from the worlds of some points, at noise scale 1; NaN where a world fails."""
        found, valid = self._discrepancies(self.coordinates.quantities(points), None)
        failed = torch.from_numpy(~valid)
        return Discrepancies(
            found.positions.masked_fill(failed[:, None, None], torch.nan),
            found.angles.masked_fill(failed[:, None], torch.nan),
            found.rates,
        )

    def log_density_given(
        self, discrepancies: Discrepancies, points: Float[Tensor, "point dimension"]
    ) -> Float[Tensor, "point"]:
        """Log posterior density (nats) of points whose worlds are known to leave these discrepancies.

        Points that differ in noise scales alone share one simulation.
        """
        quantities = self.coordinates.quantities(points)
        return self._log_likelihood(discrepancies, quantities) + self.coordinates.log_prior(points).sum(dim=1)

    def predicted(
        self, points: Float[Tensor, "point dimension"], late: Float[np.ndarray, "point time"] | None = None
    ) -> Float[np.ndarray, "point time body 3"]:
        """Positions (m) and angles (rad) of all frames and bodies as they would be measured without noise.

        Parameters
        ----------
        points
            The worlds.
        late
            Time in s by which each frame is late beyond what the worlds say; none is where None.
        """
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            worlds = self._worlds(quantities)
            rollout = self._rollout(worlds, None)[0]
            states = self._measured(worlds, rollout).numpy()
        predicted: np.ndarray = states.reshape(len(points), *self.tracks.seen.shape, 3)
        predicted[..., 2] += quantities["angle_zero"].numpy()[:, None]
        return predicted if late is None else predicted + late[:, :, None, None] * rollout.velocity.numpy()

    def fitted(self, points: Float[Tensor, "point dimension"]) -> Float[np.ndarray, "point time body 3"]:
        """What is predicted where each frame is as late as the bodies seen in it say, if frames are late by chance."""
        return self.predicted(points, self.late(points) if jitters(self.model) else None)

    def late(self, points: Float[Tensor, "point dimension"]) -> Float[np.ndarray, "point time"]:
        """Most probable time in s by which each frame is late, in a model in which frames are late by chance."""
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            found, _ = self._discrepancies(quantities, None)
            positions = found.positions / quantities[NOISE][:, :, None]
            together = torch.cat([positions.flatten(1), found.angles / quantities[ANGLE_NOISE]], dim=1)
            late: np.ndarray = self._lateness(found, quantities).expected(together).numpy()
        return late

    def lateness(self, points: Float[Tensor, "point dimension"]) -> Lateness | None:
        """How frames are late by chance in the worlds of some points; None where the model has no such frames."""
        if not jitters(self.model):
            return None
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            return self._lateness(self._discrepancies(quantities, None)[0], quantities)

    def pointwise(
        self, points: Float[Tensor, "point dimension"]
    ) -> tuple[Float[np.ndarray, "point observation"], Float[np.ndarray, "point angle"]]:
        """Log likelihood of each seen position (both axes together) and of each measured angle.

        With a model error it is that of one given the body's earlier ones, so that the sum is that of all. Where frames
        are late by chance, what a frame's numbers have in common is shared by them alike.
        """
        observations, error = self.observations, self._whitening
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            discrepancies, _ = self._discrepancies(quantities, None)
            position, angle = self._independent(discrepancies, quantities)
            degrees = quantities[DEGREES_OF_FREEDOM][:, 0]
            of_position = self.noise.log_constant(2, degrees)[:, None] - (position**2).sum(dim=-1) / 2
            of_angle = self.noise.log_constant(1, degrees)[:, None] - angle**2 / 2
            of_position, of_angle = of_position - 2 * quantities[NOISE].log(), of_angle - quantities[ANGLE_NOISE].log()
            if discrepancies.rates is not None:
                shares = self._lateness(discrepancies, quantities).log_volumes
                of_position = of_position + shares[:, : 2 * position.shape[1]].reshape(position.shape).sum(dim=-1)
                of_angle = of_angle + shares[:, 2 * position.shape[1] :]
            positions, angles = of_position.numpy(), of_angle.numpy()
        positions = positions + np.linalg.slogdet(observations.whitening)[1]
        angles = angles - np.log(observations.angle_reference)
        if error is not None:
            positions = positions + error.position_log_volume.reshape(-1, 2).sum(axis=1)
            angles = angles + error.angle_log_volume
        return positions, angles

    def information_shares(
        self, points: Float[Tensor, "point dimension"]
    ) -> tuple[Float[np.ndarray, "point observation"], Float[np.ndarray, "point angle"]]:
        """Share of a Gaussian observation's information that each position and angle carries; small for outliers."""
        with torch.no_grad():
            quantities = self.coordinates.quantities(points)
            found, _ = self._discrepancies(quantities, None)
            degrees = quantities[DEGREES_OF_FREEDOM][:, 0]
            position = self.noise.information(found.positions / quantities[NOISE][:, :, None], degrees)
            angle = self.noise.information((found.angles / quantities[ANGLE_NOISE])[..., None], degrees)
        return position.numpy(), angle.numpy()

    def _log_likelihood(self, discrepancies: Discrepancies, quantities: Quantities) -> Float[Tensor, "point"]:
        """Log likelihood (nats, up to a constant)."""
        position, angle = self._independent(discrepancies, quantities)
        squares = (position**2).sum(dim=(1, 2)) + (angle**2).sum(dim=1)
        value = -squares / 2 - 2 * position.shape[1] * quantities[NOISE][:, 0].log()
        if angle.shape[1]:
            constant = self.noise.log_constant(1, quantities[DEGREES_OF_FREEDOM][:, 0])
            value = value + angle.shape[1] * (constant - quantities[ANGLE_NOISE][:, 0].log())
        if discrepancies.rates is not None:
            value = value + self._lateness(discrepancies, quantities).log_volumes.sum(dim=1)
        return value

    def _independent(
        self, discrepancies: Discrepancies, quantities: Quantities
    ) -> tuple[Float[Tensor, "point observation 2"], Float[Tensor, "point angle"]]:
        """Independent residuals of unit variance."""
        position, angle = discrepancies.positions, discrepancies.angles
        if self._whitening is not None:
            flat = self._whitening.whitened_positions(position.flatten(1))
            position, angle = flat.reshape(position.shape), self._whitening.whitened_angles(angle)
        position, angle = position / quantities[NOISE][:, :, None], angle / quantities[ANGLE_NOISE]
        if discrepancies.rates is not None:
            together = torch.cat([position.flatten(1), angle], dim=1)
            on_time = self._lateness(discrepancies, quantities).independent(together)
            flat, angle = torch.split(on_time, [2 * position.shape[1], angle.shape[1]], dim=1)
            position = flat.reshape(position.shape)
        degrees = quantities[DEGREES_OF_FREEDOM][:, 0]
        return self.noise.shrunk(position, degrees), self.noise.shrunk(angle[..., None], degrees)[..., 0]

    def _lateness(self, discrepancies: Discrepancies, quantities: Quantities) -> Lateness:
        """Frames that are late by chance."""
        assert discrepancies.rates is not None
        observations, count = self.observations, discrepancies.positions.shape[1]
        frames = [observations.position_frames[: 2 * count], observations.angle_frames[: discrepancies.angles.shape[1]]]
        noise = [quantities[NOISE].expand(-1, 2 * count), quantities[ANGLE_NOISE].expand(-1, len(frames[1]))]
        jitter = frame_jitter(self.model, {FRAME_JITTER.name: quantities[FRAME_JITTER.name][:, 0]})
        rates = discrepancies.rates / torch.cat(noise, dim=1)
        return Lateness(torch.cat(frames), rates, jitter, len(self.tracks.times))

    def _discrepancies(
        self, quantities: Quantities, frame_count: int | None
    ) -> tuple[Discrepancies, Bool[np.ndarray, "point"]]:
        """Discrepancies of some worlds, and whether each was simulated.

        Those of an impossible world say nothing: in its place one is simulated in which nothing spins.
        """
        observations = self.observations if frame_count is None else self.observations.until(frame_count)
        worlds = self._worlds(quantities)
        possible = (worlds.spin.detach().abs() <= self._fastest).all(dim=1)
        if not possible.all():
            worlds = replace(worlds, spin=torch.where(possible[:, None], worlds.spin, torch.zeros_like(worlds.spin)))
        rollout, valid = self._rollout(worlds, frame_count)
        states = self._measured(worlds, rollout)
        # index_select, because its derivative is many times faster than that of indexing with several arrays.
        place = states.index_select(1, observations.position_places).reshape(len(states), -1, 2)
        position = observations.whitened(place - torch.from_numpy(observations.position))
        zero = quantities["angle_zero"].index_select(1, torch.from_numpy(observations.angle_body))
        turned = states.index_select(1, observations.angle_places) + zero - torch.from_numpy(observations.angle)
        angle = turned / observations.angle_reference
        finite = torch.isfinite(position).all(dim=(1, 2)) & torch.isfinite(angle).all(dim=1)
        rates = _rates(rollout, observations) if jitters(self.model) else None
        return Discrepancies(position, angle, rates), valid & (finite & possible).numpy()


def _rates(rollout: Rollout, observations: Observations) -> Float[Tensor, "point number"]:
    """Change of what was seen per second by which its frame is late, at noise scale 1."""
    states = rollout.velocity.flatten(1)
    place = observations.whitened(states.index_select(1, observations.position_places).reshape(len(states), -1, 2))
    turning = states.index_select(1, observations.angle_places) / observations.angle_reference
    return torch.cat([place.flatten(1), turning], dim=1)
