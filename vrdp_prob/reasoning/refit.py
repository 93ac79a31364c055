"""The state at the end of the video: the last part of every track, fitted anew with the draw's own physics.

A rollout from the release on carries the errors of every collision to the end of the video. What comes next depends on
the last second: so each body's free flight since its last contact (at most `LONGEST_WINDOW`) is fitted by itself; its
state and friction are then drawn around that fit.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import Purpose
from vrdp_prob.reasoning.flight import Flight
from vrdp_prob.reasoning.friction import OwnFriction, settling
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.smoother import BodyTrack, Smoother
from vrdp_prob.reasoning.stretch import State
from vrdp_prob.scene import Shape

LONGEST_WINDOW = 0.8
"""Length in s of the fitted part: the last 20 frames of a CLEVRER video."""

SHORTEST_WINDOW = 5
"""Frames below which the smooth motion is taken as it is."""

CHANGE_SD = {True: 1.0, False: 0.15}
"""Standard deviation by which the log friction ratio of the last flight differs from the body's own, for spheres (they
may have begun to roll) and others."""

Turning = Callable[[int, float], tuple[np.ndarray, np.ndarray]]
"""Gives angle (rad) and spin (rad/s) of a body at a time (s), in every draw."""


def state_at_end(
    seen: SeenVideo, worlds: Worlds, model: PhysicsModel, turning: Turning, friction: OwnFriction | None
) -> tuple[State, Float[np.ndarray, "draw body"]]:
    """State of all bodies when each was last seen, and the logarithm of its friction ratio, in every draw.

    Parameters
    ----------
    seen
        What the tracks tell.
    worlds
        The posterior draws, with a friction ratio where `friction` is given.
    model
        The physics, likewise.
    turning
        See `Turning`.
    friction
        Friction of each body by its flights; None where the model has no friction to scale.
    """
    shape = (seen.draws, len(seen.drawn))
    log_ratio = np.zeros(shape) if friction is None else friction.log_ratio.copy()
    state = State.nowhere(shape, 0.0)
    state.present[:] = True
    normal = np.concatenate(
        [
            seen.chance.numbers(Purpose.LAST_FRICTION).standard_normal((*shape, 1)),
            seen.chance.numbers(Purpose.LAST_FLIGHT).standard_normal((*shape, 4)),
        ],
        axis=2,
    )
    for body, drawn in enumerate(seen.drawn):
        track = seen.seen.smoothers[body].track
        last = float(track.times[-1])
        smooth = [array[:, 0] for array in drawn.state(np.array([last]))]
        still = drawn.rests_at_end
        state.position[:, body] = smooth[0]
        state.velocity[:, body] = np.where(still[:, None], 0.0, smooth[1])
        state.angle[:, body], state.spin[:, body] = turning(body, last)
        state.release[:, body] = last
        window = _window(seen.seen.smoothers[body], settling(model, worlds.shapes[body]))
        if friction is None or window is None or still.all():
            continue
        begin = float(window.times[0])
        start = np.concatenate([array[:, 0] for array in drawn.state(np.array([begin]))], axis=1)
        flight = Flight(worlds, model, body, track=window, begin=begin)
        mean = np.full(seen.draws, log_ratio[:, body].mean())
        fitted = flight.fit(start, mean, one_flight_sd(friction, body, worlds.shapes[body]), normal[:, body])
        moves = ~still
        state.position[moves, body], state.velocity[moves, body] = fitted.position[moves], fitted.velocity[moves]
        log_ratio[moves, body] = fitted.log_ratio[moves]
    state.rolling[:] = state.velocity
    return state, log_ratio


def one_flight_sd(friction: OwnFriction, body: int, shape: Shape) -> float:
    """Standard deviation of the log friction ratio of a body in one of its flights, before that is looked at."""
    return float(np.hypot(friction.sd[body], CHANGE_SD[shape is Shape.SPHERE]))


def _window(smoother: Smoother, pause: float) -> BodyTrack | None:
    """The part of a track after the last contact that tells where the body is going; None where it is too short."""
    track, kicks = smoother.track, smoother.kicks
    last = float(track.times[-1])
    begin = max([float(track.times[0]), last - LONGEST_WINDOW, *(kick + pause for kick in kicks if kick < last)])
    chosen = track.times >= begin - 1e-9
    if chosen.sum() < SHORTEST_WINDOW:
        return None
    return BodyTrack(track.times[chosen], track.positions[chosen], track.noise[chosen])
