"""The worlds of a video: as it was, as it goes on, and with one object changed; each simulated once and shared.

The facts that questions ask about combine what was seen (see `seen`) with posterior draws (see `refit` for what comes
next and `counterfactual` for what if).
"""

from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.errors import InputError
from vrdp_prob.inference.identifiability import BodyStatus
from vrdp_prob.inference.samples import Convergence
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.counterfactual import Counterfactual
from vrdp_prob.reasoning.defaults import DEFAULT, Defaults, with_defaults
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import Motion, draw_attributes
from vrdp_prob.reasoning.friction import OwnFriction, apply_friction, own_friction, with_friction_ratio
from vrdp_prob.reasoning.notes import share_words
from vrdp_prob.reasoning.refit import state_at_end
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.stretch import advance
from vrdp_prob.reasoning.timeline import Timeline, WorldDraws
from vrdp_prob.reasoning.values import Change, Label
from vrdp_prob.scene import Body, Tracks

DRAWS = 400
"""Posterior draws that answer the questions, unless the caller says otherwise."""

FUTURE_FRAMES = 58
"""Frames after the video that predictive questions ask about: 128 to 185 of a CLEVRER video."""

RELEVANT_SHARE = 0.01
"""An object counts as one that an answer depends on if it collides in this share of the draws."""


@runtime_checkable
class PosteriorLike(Protocol):
    """What is needed of a posterior."""

    @property
    def tracks(self) -> Tracks:
        """What was seen."""
        ...

    @property
    def model(self) -> PhysicsModel:
        """The physics."""
        ...

    @property
    def seed(self) -> int:
        """Seed of all randomness."""
        ...

    @property
    def convergence(self) -> Convergence:
        """How far the draws can be trusted."""
        ...

    @property
    def status(self) -> "StatusByBody":
        """What the data say about each body, by id."""
        ...

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        """Posterior draws."""
        ...


@runtime_checkable
class StatusByBody(Protocol):
    """A mapping from the id of a body to its status."""

    def __getitem__(self, body: str, /) -> BodyStatus: ...


class PosteriorWorlds:
    """All worlds of a posterior; the facts that the operations of a question ask for.

    Parameters
    ----------
    posterior
        The posterior of one video.
    draws
        Number of posterior draws to use.
    defaults
        Whether an object that never collided has default mass and restitution (`fixed`), or values drawn from the prior
        (`prior`).
    chance
        Where draws of what the tracks leave open come from; the posterior's seed where None.
    progress
        Who follows the simulation of each world.

    Raises
    ------
    InputError
        If there is no draw, or `defaults` is neither.
    """

    def __init__(
        self,
        posterior: PosteriorLike,
        *,
        draws: int = DRAWS,
        defaults: Defaults = "fixed",
        chance: Chance | None = None,
        progress: ProgressDisplay | None = None,
    ) -> None:
        if draws < 1:
            raise InputError(f"draws is {draws}; ask for at least 1.")
        self.posterior = posterior
        self._progress = progress or SilentProgress()
        statuses = [(str(status.mass.status), str(status.restitution.status)) for status in self._statuses()]
        generator = Seeded(posterior.seed).numbers(Purpose.DEFAULTS)
        self._drawn = with_defaults(posterior.worlds(draws), statuses, defaults, generator)
        self._seen = SeenVideo(posterior.tracks, len(self._drawn), chance or Seeded(posterior.seed))
        self._changed: dict[tuple[Change, int], WorldDraws] = {}

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The objects."""
        return self.posterior.tracks.bodies

    @property
    def draws(self) -> int:
        """Number of draws."""
        return len(self._drawn)

    @property
    def effective_draws(self) -> float:
        """Number of independent draws that they are worth."""
        effective = self.posterior.convergence.ess_bulk
        return float(self.draws if effective is None or not np.isfinite(effective) else min(self.draws, effective))

    @property
    def seen(self) -> SeenVideo:
        """What the tracks tell."""
        return self._seen

    def attribute(self, name: str) -> tuple[Label, ...]:
        """Value of an attribute in each draw, one entry for each object."""
        return self._attributes[name]

    def motion(self) -> Motion:
        """Who moves when."""
        return self._seen.motion

    def events(self) -> EventTable:
        """What happens in the video."""
        return self._seen.events

    def unseen_events(self) -> EventTable:
        """What happens after the video, without collisions of pairs that met before."""
        return self.future.events

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        """What happens in the time of the video when one object is changed from the beginning."""
        return self.counterfactual(change, body).events

    @cached_property
    def factual(self) -> Rollout:
        """Rollouts of the draws from their release on, at the frames of the video."""
        return self._simulate(self._drawn, self._seen.tracks.times)

    @cached_property
    def future(self) -> WorldDraws:
        """What happens after the video, at frames after its last one."""
        with self._progress.stage("What happens next"):
            return self._future()

    def counterfactual(self, change: Change, body: int) -> WorldDraws:
        """What happens when one object (by its place) is changed from the beginning."""
        if (change, body) not in self._changed:
            with self._progress.stage(f"Object {self.bodies[body].id} {change}"):
                world = Counterfactual(
                    self._seen, self._acting, self._model, self.turning, change=change, body=body
                ).run()
            self._changed[change, body] = world
        return self._changed[change, body]

    def relies_on_default(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """Objects of default mass or restitution whose collisions decide what happens in a simulated world."""
        share = self._world(world).collided.mean(axis=0)
        return tuple(
            body.id
            for body, part in zip(self.bodies, share, strict=True)
            if part > RELEVANT_SHARE and self._is_default(body.id)
        )

    def limits(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """What limits a simulated world, in sentences."""
        share = self._world(world).broke_off
        if share == 0:
            return ()
        return (f"In {share_words(share)} of the draws the simulation of a world broke off early.",)

    def _world(self, world: str | tuple[Change, int]) -> WorldDraws:
        return self.future if isinstance(world, str) else self.counterfactual(*world)

    def turning(self, body: int, time: float) -> tuple[Float[np.ndarray, "draw"], Float[np.ndarray, "draw"]]:
        """Angle (rad) and spin (rad/s) of a body in every draw.

        From the rollouts of the draws; where the angle was measured, the measured turning is followed instead, from the
        angle that the rollout has when the body is first seen: the measured angle's zero is arbitrary.
        """
        times = self._seen.tracks.times
        frame = int(np.abs(times - time).argmin())
        turned = self.factual.trajectory[:, :, body, 2].numpy()
        angle, spin = turned[:, frame], self.factual.velocity[:, frame, body, 2].numpy()
        measured = self._seen.tracks.angles
        if measured is None or np.isfinite(measured[:, body]).sum() < 2:
            return angle, spin
        known = np.flatnonzero(np.isfinite(measured[:, body]))
        rate = np.gradient(np.interp(times, times[known], measured[known, body]), times)
        passed = np.interp(times[frame], times[known], measured[known, body]) - measured[known[0], body]
        return turned[:, known[0]] + passed, np.full(self.draws, rate[frame])

    @cached_property
    def _attributes(self) -> dict[str, tuple[Label, ...]]:
        return draw_attributes(self.bodies, self.draws, self._seen.chance.numbers(Purpose.ATTRIBUTES))

    @cached_property
    def _extended(self) -> tuple[Worlds, PhysicsModel]:
        """The draws and the model with a friction ratio for each body, as they are where there is no friction."""
        return with_friction_ratio(self._drawn, self.posterior.model) or (self._drawn, self.posterior.model)

    @property
    def _model(self) -> PhysicsModel:
        return self._extended[1]

    @cached_property
    def _friction(self) -> OwnFriction | None:
        """Friction of each body by its own flights."""
        if with_friction_ratio(self._drawn, self.posterior.model) is None:
            return None
        return own_friction(self._seen, *self._extended)

    @cached_property
    def _acting(self) -> Worlds:
        """The draws with each body's own friction: what counterfactuals are simulated with."""
        if self._friction is None:
            return self._drawn
        return apply_friction(self._extended[0], self._friction.log_ratio)

    def _statuses(self) -> list[BodyStatus]:
        return [self.posterior.status[body.id] for body in self.bodies]

    def _is_default(self, body: str) -> bool:
        status = self.posterior.status[body]
        return DEFAULT in (str(status.mass.status), str(status.restitution.status))

    def _simulate(self, worlds: Worlds, times: Float[np.ndarray, "time"]) -> Rollout:
        with torch.no_grad():
            return simulate(worlds, torch.from_numpy(times.copy()), self.posterior.model)

    def _future(self) -> WorldDraws:
        seen, model = self._seen, self._model
        state, log_ratio = state_at_end(seen, self._extended[0], model, self.turning, self._friction)
        worlds = self._extended[0] if self._friction is None else apply_friction(self._extended[0], log_ratio)
        end = float(seen.tracks.times[-1])
        times = end + np.arange(FUTURE_FRAMES + 1) / seen.tracks.frame_rate
        # in view of the last frame, bodies are held to start there; those that left are on their way since they did
        here = seen.presence[:, 1] >= len(seen.tracks.times)
        unseen = np.where(here, end - state.release[0], 0.0)
        state.position += state.velocity * unseen[:, None]
        state.release[:, here] = end
        stretch = advance(worlds, state, times[1:], model)
        timeline = Timeline(seen.universe, seen.draws, seen.tracks.camera)
        timeline.met[:, seen.universe.collisions] = seen.events.happens[:, seen.universe.collisions]
        for meeting in stretch.meetings():
            late = meeting.time > end
            timeline.note_meeting(meeting, late)
        timeline.note_crossings(stretch.times, stretch.position, stretch.exists, np.ones_like(timeline.collided))
        trajectory = np.concatenate([stretch.position, stretch.angle[..., None]], axis=-1)
        broke_off = float(stretch.broke_off.mean())
        return WorldDraws(stretch.times, trajectory, stretch.exists, timeline.table, timeline.collided, broke_off)
