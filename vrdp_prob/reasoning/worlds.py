"""The worlds of a video: as it was, as it goes on, and with one object changed; each simulated once and shared.

The facts that questions ask about combine what was seen (see `seen`) with posterior draws (see `refit` for what comes
next and `counterfactual` for what if). Draws come in batches (see `stock`), so that a question that needs more of them
gets more, and no other world has to be simulated for it.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property

from vrdp_prob.errors import InputError
from vrdp_prob.models.simulator.rollout import Rollout
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning.batch import Batch
from vrdp_prob.reasoning.chance import Chance, Purpose, Seeded
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.coupled import Coupled
from vrdp_prob.reasoning.defaults import DEFAULT, Defaults
from vrdp_prob.reasoning.deviations import DeviationModel
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import Motion
from vrdp_prob.reasoning.notes import share_words
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.stock import Stock
from vrdp_prob.reasoning.timeline import WorldDraws
from vrdp_prob.reasoning.values import Label
from vrdp_prob.scene import Body

DRAWS = 400
"""Posterior draws that answer the questions, unless the caller says otherwise."""

DEVIATING = DeviationModel()
"""How motion deviates from the model where the caller does not say."""

RELEVANT_SHARE = 0.01
"""An object counts as one that an answer depends on if it collides in this share of the draws."""


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
    deviating
        How simulated motion deviates from the model, but for what the tracks say of it; None where it does not.
    own_courses
        Whether draws in which all happens as it was seen may follow their own course (see `own_course`).
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
        deviating: DeviationModel | None = DEVIATING,
        own_courses: bool = True,
        progress: ProgressDisplay | None = None,
    ) -> None:
        if draws < 1:
            raise InputError(f"draws is {draws}; ask for at least 1.")
        self.posterior = posterior
        chance = chance or Seeded(posterior.seed)
        self._stock = Stock(
            posterior, draws, defaults=defaults, chance=chance, deviating=deviating, own_courses=own_courses
        )
        self._progress = progress or SilentProgress()
        first = self._stock.batch(0)
        self._batches: tuple[Batch, ...] = () if first is None else (first,)

    @classmethod
    def _of(cls, other: "PosteriorWorlds", batches: Sequence[Batch]) -> "PosteriorWorlds":
        """Worlds of the same posterior in other batches of draws."""
        made = cls.__new__(cls)
        made.posterior, made._stock, made._progress = other.posterior, other._stock, other._progress
        made._batches = tuple(batches)
        return made

    @cached_property
    def more(self) -> "PosteriorWorlds | None":
        """The same worlds and those of one more batch; None where more draws would not be worth more."""
        if self.draws >= self._stock.worth:
            return None
        batch = self._stock.batch(len(self._batches))
        return None if batch is None else self._of(self, (*self._batches, batch))

    def coupled(self, kept: Mapping[Purpose, float]) -> "PosteriorWorlds":
        """The same posterior draws with what the tracks leave open drawn anew, but for what is kept (see `Coupled`)."""
        key = frozenset(kept.items())
        if key not in self._coupled:
            twins = [batch.coupled(Coupled(batch.chance, place, kept)) for place, batch in enumerate(self._batches)]
            self._coupled[key] = self._of(self, twins)
        return self._coupled[key]

    @property
    def exhausted(self) -> str:
        """Why there are no more draws, as a clause."""
        if self.draws >= self._stock.worth:
            return f"the posterior's draws are worth no more than {self._stock.worth:.0f} independent ones"
        return f"all {self.draws} draws of the posterior are used"

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The objects."""
        return self.posterior.tracks.bodies

    @property
    def draws(self) -> int:
        """Number of draws."""
        return sum(map(len, self._batches))

    @property
    def effective_draws(self) -> float:
        """Number of independent draws that they are worth."""
        return float(min(self.draws, self._stock.worth))

    @property
    def batches(self) -> tuple[Batch, ...]:
        """The batches of draws, in the order of every axis of draws."""
        return self._batches

    @property
    def seen(self) -> SeenVideo:
        """What the tracks tell, with the draws of the first batch."""
        return self._batches[0].seen

    @property
    def factual(self) -> Rollout:
        """Rollouts of the draws of the first batch from their release on, at the frames of the video."""
        return self._batches[0].released.rollout

    def attribute(self, name: str) -> tuple[Label, ...]:
        """Value of an attribute in each draw, one entry for each object."""
        parts = zip(*(batch.attributes[name] for batch in self._batches), strict=True)
        return tuple(Label.joined(part) for part in parts)

    def motion(self) -> Motion:
        """Who moves when."""
        return Motion.joined([batch.seen.motion for batch in self._batches])

    def events(self) -> EventTable:
        """What happens in the video."""
        return EventTable.joined([batch.seen.events for batch in self._batches])

    def unseen_events(self) -> EventTable:
        """What happens after the video, without collisions of pairs that met before."""
        return self.future.events

    def counterfactual_events(self, change: Change, body: int) -> EventTable:
        """What happens in the time of the video when one object is changed from the beginning."""
        return self.counterfactual(change, body).events

    @cached_property
    def future(self) -> WorldDraws:
        """What happens after the video, at frames after its last one."""
        with self._progress.stage("What happens next"):
            return WorldDraws.joined([batch.future for batch in self._batches])

    def counterfactual(self, change: Change, body: int) -> WorldDraws:
        """What happens when one object (by its place) is changed from the beginning."""
        if (change, body) not in self._changed:
            with self._progress.stage(f"Object {self.bodies[body].id} {change}"):
                parts = [batch.counterfactual(change, body) for batch in self._batches]
            self._changed[change, body] = WorldDraws.joined(parts)
        return self._changed[change, body]

    def relies_on_default(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """Objects of default mass or restitution whose collisions decide what happens in a simulated world."""
        share = self.world(world).collided.mean(axis=0)
        return tuple(
            body.id
            for body, part in zip(self.bodies, share, strict=True)
            if part > RELEVANT_SHARE and self._is_default(body.id)
        )

    def limits(self, world: str | tuple[Change, int]) -> tuple[str, ...]:
        """What limits a simulated world, in sentences."""
        share = float(self.world(world).broke_off.mean())
        if share == 0:
            return ()
        return (f"In {share_words(share)} of the draws the simulation of a world broke off early.",)

    def world(self, key: str | tuple[Change, int]) -> WorldDraws:
        """What happens after the video (`future`), or with a change."""
        return self.future if isinstance(key, str) else self.counterfactual(*key)

    @cached_property
    def _coupled(self) -> dict[frozenset[tuple[Purpose, float]], "PosteriorWorlds"]:
        return {}

    @cached_property
    def _changed(self) -> dict[tuple[Change, int], WorldDraws]:
        return {}

    def _is_default(self, body: str) -> bool:
        status = self.posterior.status[body]
        return DEFAULT in (str(status.mass.status), str(status.restitution.status))
