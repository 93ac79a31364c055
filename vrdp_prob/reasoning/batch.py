"""A batch of draws with its worlds: as it was, as it goes on, and with one object changed; each simulated once."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.chance import Chance, Purpose
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.counterfactual import Counterfactual
from vrdp_prob.reasoning.deviations import FEWEST_DRAWS, Deviation, DeviationModel, seen_deviations, turns
from vrdp_prob.reasoning.facts import draw_attributes
from vrdp_prob.reasoning.friction import OwnFriction, ToldFriction, apply_friction, told_friction, with_friction_ratio
from vrdp_prob.reasoning.future import after_the_video, future_times
from vrdp_prob.reasoning.intervention import Intervention, drawn_meanings
from vrdp_prob.reasoning.own_course import OwnCourses, changed_course, continued_course
from vrdp_prob.reasoning.refit import state_at_end
from vrdp_prob.reasoning.released import Released
from vrdp_prob.reasoning.scales import Examples
from vrdp_prob.reasoning.scattering import INSTANTS, Scattering, advance_scattered
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.reasoning.stretch import State
from vrdp_prob.reasoning.timeline import WorldDraws
from vrdp_prob.reasoning.values import Label
from vrdp_prob.reasoning.wander import Foretelling

FORETOLD_DRAWS = 60
"""Draws with which flights are foretold: enough for the variance of a place."""


@dataclass(frozen=True)
class Common:
    """What all batches of draws of a video share.

    Parameters
    ----------
    sight
        What the tracks tell.
    model
        The physics.
    middle
        One world in the middle of the posterior.
    deviating
        How motion deviates from the model; None where it follows it exactly.
    own_courses
        Whether draws that show what was seen may follow their own course; they do in any case where bodies act on each
        other from afar.
    """

    sight: Sight
    model: PhysicsModel
    middle: Worlds
    deviating: DeviationModel | None = None
    own_courses: bool = True

    @cached_property
    def friction(self) -> ToldFriction | None:
        """Friction of each body by its own flights; None for a model without dry friction."""
        extended = with_friction_ratio(self.middle, self.model)
        return None if extended is None else told_friction(self.sight.seen.smoothers, *extended)


class Batch:
    """Posterior draws, what the tracks leave open drawn to each of them, and the worlds that follow.

    Parameters
    ----------
    common
        What it shares with other batches.
    released
        The posterior draws.
    chance
        Where draws of what the tracks leave open come from.
    """

    def __init__(self, common: Common, released: Released, chance: Chance) -> None:
        self.common, self.released, self.chance = common, released, chance
        own = OwnCourses(common.sight, released) if common.own_courses or common.model.is_coupled else None
        self.seen = SeenVideo(common.sight, len(released.worlds), chance, own)
        self._extended = with_friction_ratio(self.drawn, common.model) or (self.drawn, common.model)
        self._changed: dict[tuple[Change, int], WorldDraws] = {}

    def __len__(self) -> int:
        return len(self.drawn)

    @property
    def drawn(self) -> Worlds:
        """The posterior draws."""
        return self.released.worlds

    def coupled(self, chance: Chance) -> "Batch":
        """The same posterior draws with what the tracks leave open drawn otherwise."""
        return Batch(self.common, self.released, chance)

    @cached_property
    def attributes(self) -> dict[str, tuple[Label, ...]]:
        """Attributes by name, one entry for each object."""
        return draw_attributes(self.common.sight.tracks.bodies, len(self), self.chance.numbers(Purpose.ATTRIBUTES))

    @cached_property
    def friction(self) -> OwnFriction | None:
        """Friction of each body by its own flights; None for a model without dry friction."""
        told = self.common.friction
        return None if told is None else told.draw(len(self), self.chance.numbers(Purpose.FRICTION))

    @cached_property
    def end(self) -> tuple[State, Float[np.ndarray, "draw body"]]:
        """State of all bodies when each was last seen, and the logarithm of its friction ratio then."""
        return state_at_end(self.seen, *self._extended, self.turning, self.friction)

    @cached_property
    def future(self) -> WorldDraws:
        """What happens after the video, at frames after its last one."""
        seen, (worlds, model), own = self.seen, self._extended, self.seen.on_own_course
        if own.all():
            return continued_course(self.common.sight, worlds, model, own, seen.events)
        state, log_ratio = self.end
        state = state.copy()
        if self.friction is not None:
            worlds = apply_friction(worlds, log_ratio)
        end, times = float(seen.tracks.times[-1]), future_times(seen.tracks)
        # in view of the last frame, bodies are held to start there; those that left are on their way since they did
        here = seen.presence[:, 1] >= len(seen.tracks.times)
        unseen = np.where(here, end - state.release[0], 0.0)
        state.position += state.velocity * unseen[:, None]
        state.release[:, here] = end
        stretch = advance_scattered(worlds, state, np.append(end, times), model, self.scattering)
        refitted = after_the_video(self.common.sight, stretch, seen.events)
        if not own.any():
            return refitted
        return refitted.with_draws(own, continued_course(self.common.sight, self._extended[0], model, own, seen.events))

    def counterfactual(self, change: Change, body: int) -> WorldDraws:
        """What happens when one object (by its place) is changed from the beginning."""
        if (change, body) not in self._changed:
            self._changed[change, body] = self.simulated(change, body)
        return self._changed[change, body]

    def simulated(self, change: Change, body: int) -> WorldDraws:
        """The same, simulated anew and not kept."""
        model, own = self._extended[1], self.seen.on_own_course
        done = partial(
            Intervention, change, body, taken=self.meanings(change), path_follows_mass=model.path_follows_mass
        )
        whole = done(self._extended[0])
        if own.all():
            return changed_course(self.common.sight, whole, model, own, self.seen.events)
        kept = Counterfactual(
            self.seen, self._acting, model, self.turning, self.scattering, intervention=done(self._acting)
        ).run()
        if not own.any():
            return kept
        return kept.with_draws(own, changed_course(self.common.sight, whole, model, own, self.seen.events))

    def meanings(self, change: Change) -> Int[np.ndarray, "draw"]:
        """Which of the meanings of its word each draw takes."""
        return drawn_meanings(change, len(self), self.chance.numbers(Purpose.MEANING))

    def turning(self, body: int, time: float) -> tuple[Float[np.ndarray, "draw"], Float[np.ndarray, "draw"]]:
        """Angle (rad) and spin (rad/s) of a body in every draw.

        From the rollouts of the draws; where the angle was measured, the measured turning is followed instead, from the
        angle that the rollout has when the body is first seen: the measured angle's zero is arbitrary.
        """
        times = self.seen.tracks.times
        frame = int(np.abs(times - time).argmin())
        turned = self.released.rollout.trajectory[:, :, body, 2].numpy()
        angle, spin = turned[:, frame], self.released.rollout.velocity[:, frame, body, 2].numpy()
        measured = self.seen.tracks.angles
        if measured is None or np.isfinite(measured[:, body]).sum() < 2:
            return angle, spin
        known = np.flatnonzero(np.isfinite(measured[:, body]))
        rate = np.gradient(np.interp(times, times[known], measured[known, body]), times)
        passed = np.interp(times[frame], times[known], measured[known, body]) - measured[known[0], body]
        return turned[:, known[0]] + passed, np.full(len(self), rate[frame])

    @cached_property
    def deviations(self) -> tuple[Deviation, ...]:
        """How the contacts that were seen deviate from the model."""
        return seen_deviations(self.seen, self._acting, self._extended[1], self.turning)

    @cached_property
    def wandering(self) -> Examples:
        """How flights that were seen deviate from the model; nothing for a model without dry friction."""
        if self.friction is None or len(self) < FEWEST_DRAWS:
            return ()
        worlds, model = self._extended
        few = worlds.select(range(min(len(self), FORETOLD_DRAWS)))
        normal = self.chance.numbers(Purpose.FORETOLD).standard_normal((len(worlds.shapes), len(few), 5))
        return Foretelling(few, model, self.friction).errors(self.common.sight.seen.smoothers, normal)

    @cached_property
    def scattering(self) -> Scattering | None:
        """How simulated motion deviates from the model; None where it does not."""
        prior = self.common.deviating
        if prior is None:
            return None
        bodies, numbers = len(self.common.sight.tracks.bodies), self.chance.numbers(Purpose.DEVIATIONS)
        level = self.chance.numbers(Purpose.DEVIATION_SCALES).random((2, len(self)))
        reused = self.deviations if prior.reused else ()
        return Scattering.of(
            reused,
            prior.impulse.quantiles(turns(self.deviations), level[0]),
            prior.acceleration.quantiles(self.wandering, level[1]),
            fresh=numbers.standard_normal((len(self), bodies, bodies, 2)),
            shaking=numbers.standard_normal((len(self), bodies, INSTANTS, 2)),
            noise=numbers.standard_normal((len(reused), len(self), 2)),
        )

    @cached_property
    def _acting(self) -> Worlds:
        """The draws with each body's own friction: what counterfactuals are simulated with."""
        return self.drawn if self.friction is None else apply_friction(self._extended[0], self.friction.log_ratio)
