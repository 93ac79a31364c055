"""Free flights fitted one at a time: start, velocity and friction of one body between two contacts, in every draw."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.models.effects.body_friction import FRICTION_RATIO
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.smoother import BodyTrack
from vrdp_prob.reasoning.stretch import State, advance

STEP = 1e-3
"""Step of the differences that stand for derivatives, in m, m/s and the logarithm of the friction."""

TURNS = 3
"""Gauss-Newton steps: a flight is nearly linear in its start."""

START_SD = np.array([0.05, 0.05, 0.3, 0.3])
"""How far (m, m/s) the start of a flight may be from the smooth motion."""

LARGEST_MOVE = np.array([0.1, 0.1, 0.5, 0.5, 1.0])
"""Largest change in one Gauss-Newton step."""

LOG_RATIO_LIMIT = 4.0

FRICTION_FIRST = [4, 0, 1, 2, 3]
"""Order of the unknowns in which they are drawn."""


@dataclass(frozen=True)
class FittedFlight:
    """Draws of one flight.

    Parameters
    ----------
    position, velocity
        At its end, in m and m/s.
    log_ratio
        Logarithm of the body's friction over the friction shared by the video.
    precision
        Inverse variance that the flight's data give `log_ratio`, prior aside.
    """

    position: Float[np.ndarray, "draw 2"]
    velocity: Float[np.ndarray, "draw 2"]
    log_ratio: Float[np.ndarray, "draw"]
    precision: Float[np.ndarray, "draw"]


class Flight:
    """Free flight of one body in every draw.

    Parameters
    ----------
    worlds
        Draws of all constants, with the parameter `friction_ratio`.
    model
        The physics, with the effect `body_friction`.
    body
        Which body; no other takes part.
    track
        The part of its track that is fitted.
    begin
        Time in s at which the flight starts.
    """

    def __init__(self, worlds: Worlds, model: PhysicsModel, body: int, *, track: BodyTrack, begin: float) -> None:
        self._model, self._body, self._track, self._begin = model, body, track, begin
        self._draws = len(worlds)
        self._worlds = worlds.select(list(range(self._draws)) * 6)

    def fit(
        self,
        start: Float[np.ndarray, "draw 4"],
        log_ratio: Float[np.ndarray, "draw"],
        log_ratio_sd: float,
        normal: Float[np.ndarray, "draw 5"] | None,
    ) -> FittedFlight:
        """Fit by Gauss-Newton steps and draw around the fit; without random numbers give the fit itself.

        Parameters
        ----------
        start
            Position (m) and velocity (m/s) to set out from, held by `START_SD`.
        log_ratio, log_ratio_sd
            Prior of the logarithm of the friction ratio.
        normal
            Standard normal numbers: the first decides the friction, the others the state given the friction.
        """
        noise, measured = self._track.noise, self._track.positions
        prior_mean = np.concatenate([start, log_ratio[:, None]], axis=1)
        prior = np.diag(1 / np.append(START_SD, log_ratio_sd) ** 2)
        at = prior_mean.copy()
        for _ in range(TURNS):
            path, slope, end, end_slope = self._linearised(at)
            weighted = slope / noise[:, None, None]
            misfit = (measured - path) / noise[:, None]
            data = np.einsum("dtai,dtaj->dij", weighted, weighted)
            pull = np.einsum("dtai,dta->di", weighted, misfit) + (prior_mean - at) @ prior
            move = np.linalg.solve(data + prior, pull[..., None])[..., 0]
            move = np.clip(move, -LARGEST_MOVE, LARGEST_MOVE)
            left = misfit - np.einsum("dtai,di->dta", weighted, move)
            base, at = at, at + move
        freedom = max(2 * len(noise) - 5, 1)
        # where the physics does not fit the flight, its state is less certain by as much
        inflation = np.clip((left**2).sum(axis=(1, 2)) / freedom, 1.0, 100.0)
        if normal is not None:
            covariance = np.linalg.inv(data + prior)[:, FRICTION_FIRST][:, :, FRICTION_FIRST]
            root = np.linalg.cholesky(covariance) * np.sqrt(inflation)[:, None, None]
            at[:, FRICTION_FIRST] += np.einsum("dij,dj->di", root, normal)
        final = end + np.einsum("dsi,di->ds", end_slope, at - base)
        told = np.linalg.inv(np.linalg.inv(data + prior)[:, 4:, 4:])[:, 0, 0] - prior[4, 4]
        return FittedFlight(
            final[:, :2],
            final[:, 2:],
            np.clip(at[:, 4], -LOG_RATIO_LIMIT, LOG_RATIO_LIMIT),
            np.maximum(told, 0.0) / inflation,
        )

    def _linearised(self, at: Float[np.ndarray, "draw 5"]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Path and final state, and their derivatives by the start and the friction."""
        flat = (at + STEP * np.concatenate([np.zeros((1, 5)), np.eye(5)])[:, None, :]).reshape(-1, 5)
        state = State.nowhere((len(flat), len(self._worlds.shapes)), self._begin)
        state.position[:, self._body], state.velocity[:, self._body] = flat[:, :2], flat[:, 2:4]
        state.rolling[:, self._body], state.present[:, self._body] = flat[:, 2:4], True
        worlds = scaled_friction(self._worlds, self._body, flat[:, 4])
        times = np.maximum(self._track.times, self._begin + 1e-9)
        stretch = advance(worlds, state, times, self._model)
        path = stretch.position[:, :, self._body].reshape(6, self._draws, -1, 2)
        last = np.concatenate([stretch.position[:, -1, self._body], stretch.velocity[:, -1, self._body]], axis=1)
        last = last.reshape(6, self._draws, 4)
        slope = np.moveaxis((path[1:] - path[0]) / STEP, 0, -1)
        end_slope = np.moveaxis((last[1:] - last[0]) / STEP, 0, -1)
        return path[0], slope, last[0], end_slope


def scaled_friction(worlds: Worlds, body: int, log_ratio: Float[np.ndarray, "draw"]) -> Worlds:
    """The same worlds with the friction of one body multiplied."""
    ratio = worlds.parameters[FRICTION_RATIO.name].clone()
    ratio[:, body] *= torch.from_numpy(np.exp(log_ratio))
    return replace(worlds, parameters={**worlds.parameters, FRICTION_RATIO.name: ratio})
