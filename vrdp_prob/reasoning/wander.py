"""How much the motion between contacts differs from the law of the model: an acceleration that nobody knows.

A white acceleration of strength w, in m/s^1.5, changes a velocity by w sqrt(t) and a place by w sqrt(t^3 / 3) within a
time t. How large it is on this table, flights tell: the first half of each is fitted, and what the model makes of it is
compared with the place at which the body was seen at its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.flight import FittedFlight, Flight, scaled_friction
from vrdp_prob.reasoning.friction import OwnFriction, flights, settling
from vrdp_prob.reasoning.refit import one_flight_sd
from vrdp_prob.reasoning.scales import Examples
from vrdp_prob.reasoning.smoother import BodyTrack, Smoother
from vrdp_prob.reasoning.stretch import State, advance

LAST_FRAMES = 3
"""Frames at the end of a flight whose mean place is foretold."""
SHORTEST = 16
"""Frames of a flight that is looked at, at least."""


@dataclass(frozen=True)
class Foretelling:
    """The second halves of flights as the model foretells them from the first.

    Parameters
    ----------
    worlds
        The draws, with a friction ratio.
    model
        The physics, with the effect of that ratio.
    friction
        Friction of each body by all its flights.
    """

    worlds: Worlds
    model: PhysicsModel
    friction: OwnFriction

    def errors(self, smoothers: Sequence[Smoother], normal: Float[np.ndarray, "body draw 5"]) -> Examples:
        """Errors of the foretold places of all flights, along x and y, in units of w.

        Parameters
        ----------
        smoothers
            The motion of each body, with its contacts.
        normal
            Standard normal numbers that draw the state and the friction of each fitted half.
        """
        return [
            error
            for body, smoother in enumerate(smoothers)
            for track in flights(smoother, settling(self.model, self.worlds.shapes[body]))
            if len(track.times) >= SHORTEST
            for error in self._of_flight(body, smoother, track, normal[body])
        ]

    def _of_flight(
        self, body: int, smoother: Smoother, track: BodyTrack, normal: Float[np.ndarray, "draw 5"]
    ) -> Examples:
        half, last = len(track.times) // 2, track.times[-LAST_FRAMES:]
        first = BodyTrack(track.times[:half], track.positions[:half], track.noise[:half])
        fitted = self._fitted(body, smoother, first, normal)
        places = self._later(body, fitted, float(first.times[-1]), last).mean(axis=1)
        unit = np.sqrt((float(last.mean() - first.times[-1])) ** 3 / 3)
        noise = (track.noise[-LAST_FRAMES:] ** 2).mean() / LAST_FRAMES
        errors = (track.positions[-LAST_FRAMES:].mean(axis=0) - places.mean(axis=0)) / unit
        variances = (places.var(axis=0) + noise) / unit**2
        return list(zip(errors.tolist(), variances.tolist(), strict=True))

    def _fitted(
        self, body: int, smoother: Smoother, track: BodyTrack, normal: Float[np.ndarray, "draw 5"]
    ) -> FittedFlight:
        """Draws of a part of a flight."""
        draws, begin = len(self.worlds), float(track.times[0])
        start = np.concatenate([array[0] for array in smoother.state(np.array([begin]))])
        log_ratio = np.full(draws, self.friction.log_ratio[:, body].mean())
        sd = one_flight_sd(self.friction, body, self.worlds.shapes[body])
        flight = Flight(self.worlds, self.model, body, track=track, begin=begin)
        return flight.fit(np.tile(start, (draws, 1)), log_ratio, sd, normal)

    def _later(
        self, body: int, fitted: FittedFlight, begin: float, times: Float[np.ndarray, "time"]
    ) -> Float[np.ndarray, "draw time 2"]:
        """Where the body is later, if nothing meets it."""
        shape = (len(self.worlds), len(self.worlds.shapes))
        state = State.nowhere(shape, begin)
        state.position[:, body], state.velocity[:, body] = fitted.position, fitted.velocity
        state.rolling[:, body], state.present[:, body] = fitted.velocity, True
        own = scaled_friction(self.worlds, body, fitted.log_ratio)
        return advance(own, state, times, self.model).position[:, :, body]
