"""The state at the end of the video: the last part of every track, fitted anew with the draw's own physics.

A rollout from the release on carries the errors of every collision to the end of the video. What comes next depends on
the last second: so each body's free flight since its last contact (at most `LONGEST_WINDOW`) is fitted by itself, with
the friction of each posterior draw, by two Gauss-Newton steps; the state is then drawn around it with the covariance
of that fit.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.stretch import State, advance

LONGEST_WINDOW = 0.8
"""Length in s of the fitted part: the last 20 frames of a CLEVRER video."""

SHORTEST_WINDOW = 5
"""Frames below which the smooth motion is taken as it is."""

STEP = 1e-3
"""Step in m and m/s of the differences that stand for derivatives."""

PAUSE = 0.02
"""Time in s after a contact that is left out."""

TURNS = 2
"""Gauss-Newton steps: the flight is nearly linear in its start."""


def state_at_end(seen: SeenVideo, worlds: Worlds, model: PhysicsModel, turning: "Turning") -> State:
    """State of all bodies when each was last seen, in every draw.

    Parameters
    ----------
    seen
        What the tracks tell.
    worlds
        The posterior draws.
    model
        The physics.
    turning
        Gives angle (rad) and spin (rad/s) of a body at a time (s).
    """
    count = len(seen.tracks.bodies)
    state = State(
        np.zeros((seen.draws, count, 2)),
        np.zeros((seen.draws, count, 2)),
        np.zeros((seen.draws, count)),
        np.zeros((seen.draws, count)),
        np.zeros((seen.draws, count)),
        np.ones((seen.draws, count), dtype=bool),
    )
    generator = np.random.default_rng((seen.seed, 4))
    for body in range(count):
        last = float(seen.seen.smoothers[body].track.times[-1])
        position, velocity = _final_state(seen, worlds, model, body, generator)
        state.position[:, body], state.velocity[:, body] = position, velocity
        state.angle[:, body], state.spin[:, body] = turning(body, last)
        state.release[:, body] = last
    return state


Turning = Callable[[int, float], tuple[np.ndarray, np.ndarray]]


def _final_state(
    seen: SeenVideo, worlds: Worlds, model: PhysicsModel, body: int, generator: np.random.Generator
) -> tuple[Float[np.ndarray, "draw 2"], Float[np.ndarray, "draw 2"]]:
    drawn, track = seen.drawn[body], seen.seen.smoothers[body].track
    last = float(track.times[-1])
    kicks = [kick for kick in seen.seen.smoothers[body].kicks if kick < last]
    begin = max([float(track.times[0]), last - LONGEST_WINDOW, *(kick + PAUSE for kick in kicks)])
    chosen = track.times >= begin - 1e-9
    smooth = drawn.state(np.array([last]))
    still = drawn.rests_at_end
    if chosen.sum() < SHORTEST_WINDOW or still.all():
        return smooth[0][:, 0], np.where(still[:, None], 0.0, smooth[1][:, 0])
    start = np.concatenate([array[:, 0] for array in drawn.state(np.array([begin]))], axis=1)
    flight = _Flight(worlds, model, body=body, begin=begin, times=track.times[chosen])
    position, velocity = flight.fitted(start, track.positions[chosen], track.noise[chosen], generator)
    keep = still[:, None]
    return np.where(keep, smooth[0][:, 0], position), np.where(keep, 0.0, velocity)


class _Flight:
    """Free flight of one body in every draw, as a function of where it starts (x, y in m, and velocity in m/s)."""

    def __init__(
        self,
        worlds: Worlds,
        model: PhysicsModel,
        *,
        body: int,
        begin: float,
        times: Float[np.ndarray, "time"],
    ) -> None:
        self._model, self._body, self._bodies = model, body, len(worlds.shapes)
        self._begin, self._times = begin, times
        self._draws = len(worlds)
        self._worlds = worlds.select(list(range(len(worlds))) * 5)

    def fitted(
        self,
        start: Float[np.ndarray, "draw 4"],
        measured: Float[np.ndarray, "time 2"],
        noise: Float[np.ndarray, "time"],
        generator: np.random.Generator,
    ) -> tuple[Float[np.ndarray, "draw 2"], Float[np.ndarray, "draw 2"]]:
        """Draws of the final position (m) and velocity (m/s)."""
        for _ in range(TURNS):
            path, slope, end, end_slope = self._linearised(start)
            weighted = slope / noise[:, None, None]
            misfit = (measured - path) / noise[:, None]
            normal = np.einsum("dtai,dtaj->dij", weighted, weighted) + 1e-9 * np.eye(4)
            move = np.linalg.solve(normal, np.einsum("dtai,dta->di", weighted, misfit)[..., None])[..., 0]
            start = start + move
            left = misfit - np.einsum("dtai,di->dta", weighted, move)
        freedom = max(2 * len(noise) - 4, 1)
        # where the physics does not fit the flight, its state is less certain by as much
        inflation = np.maximum((left**2).sum(axis=(1, 2)) / freedom, 1.0)
        root = np.linalg.cholesky(np.linalg.inv(normal)) * np.sqrt(inflation)[:, None, None]
        drawn = move + np.einsum("dij,dj->di", root, generator.standard_normal((self._draws, 4)))
        final = end + np.einsum("dsi,di->ds", end_slope, drawn)
        return final[:, :2], final[:, 2:]

    def _linearised(self, start: Float[np.ndarray, "draw 4"]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Path and final state, and their derivatives by the start."""
        moved = start + STEP * np.concatenate([np.zeros((1, 4)), np.eye(4)])[:, None, :]
        flat = moved.reshape(-1, 4)
        count = len(flat)
        present: Bool[np.ndarray, "draw body"] = np.zeros((count, self._bodies), dtype=bool)
        present[:, self._body] = True
        position, velocity = np.zeros((count, self._bodies, 2)), np.zeros((count, self._bodies, 2))
        position[:, self._body], velocity[:, self._body] = flat[:, :2], flat[:, 2:]
        zero = np.zeros((count, self._bodies))
        state = State(position, velocity, zero, zero, np.full_like(zero, self._begin), present)
        times = self._times if self._times[0] > self._begin else self._times + 1e-9
        stretch = advance(self._worlds, state, times, self._model)
        path = stretch.position[:, :, self._body].reshape(5, self._draws, -1, 2)
        last = np.concatenate([stretch.position[:, -1, self._body], stretch.velocity[:, -1, self._body]], axis=1)
        last = last.reshape(5, self._draws, 4)
        slope = np.moveaxis((path[1:] - path[0]) / STEP, 0, -1)
        end_slope = np.moveaxis((last[1:] - last[0]) / STEP, 0, -1)
        return path[0], slope, last[0], end_slope
