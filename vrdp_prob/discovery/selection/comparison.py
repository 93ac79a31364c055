"""The best model beside its likes: without each of its causes, and with another one in the place of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.forward import Step
from vrdp_prob.discovery.selection.gains import gain, merit
from vrdp_prob.discovery.selection.leavings import Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.shortlist import HOPEFUL
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.wall import Wall

MOST_RIVALS = 2
"""Causes that are fitted at most in the place of one."""
MOST_SWAPS = 3
"""How often a rival takes the place of a cause."""


@dataclass(frozen=True)
class Comparison:
    """What the best model is compared with.

    Parameters
    ----------
    refits
        What makes the refits.
    beginning
        What the search has gone on from, beside the model that was given.
    """

    refits: Refits
    beginning: Beginning | None = None

    @cached_property
    def _lesser(self) -> LesserModels:
        return LesserModels(self.refits)

    def compared(
        self, chain: Sequence[Trial], steps: Sequence[Step]
    ) -> tuple[Trial, tuple[Trial, ...], tuple[tuple[Trial, ...], ...]]:
        """The best model, each of its causes left out, and others in the place of each.

        A cause that was found first may fit worse than another once a further one has joined; then they are swapped.
        """
        best = chain[-1]
        known = [one for one in chain[-2:-1] if one.causes == best.causes[:-1]]
        divisor = steps[-1].left.overdispersion
        lesser = (*self._lesser.without_each(best, best.causes[: len(best.causes) - len(known)], divisor), *known)
        sure = partial(merit, overdispersion=divisor)
        for swaps in range(MOST_SWAPS + 1):
            best, lesser = self._lesser.pruned(best, lesser, divisor)
            rivals = self._rivals(best, lesser, steps)
            others = (one for some in rivals for one in some)
            better = max(others, key=sure, default=best)
            if swaps == MOST_SWAPS or sure(better) <= sure(best) or self.refits.is_nothing(better, best, divisor):
                break
            best, lesser = better, self._lesser.without_each(better, better.causes, divisor)
        return best, lesser, rivals

    def _rivals(self, best: Trial, lesser: Sequence[Trial], steps: Sequence[Step]) -> tuple[tuple[Trial, ...], ...]:
        """For each cause of a model: models in which another one takes its place.

        A rival was tried when that cause was, and came close to it; what happened once may as well have been something
        unseen that a body met. Of a single cause all that was tried on the model that was given are rivals.
        """
        found = []
        for cause, without in zip(best.causes, lesser, strict=True):
            step = _tried_at(cause, steps)
            if not step.tried:  # the search has begun with the cause
                near = [one for one in self._near(cause) if one.effect.name not in best.names]
                others = self._instead(best, cause, without, self.refits.leavings.of(without), near)
            elif len(best.causes) > 1 or step is not steps[0]:
                others = self._instead(best, cause, without, step.left, _close(step, best))
                if len(best.causes) == 1:
                    made = {*best.names, *(one.causes[-1].name for one in others)}
                    others += [one for one in steps[0].tried if one.causes[-1].name not in made]
            else:
                others = [one for one in step.tried if one.causes[-1].name not in best.names]
            if isinstance(cause, ExternalImpulse):
                made = {one.causes[-1].name for one in others}
                others += _continued(self.refits.extensions.hidden_instead(best, cause, without, known=made))
            found.append(tuple(one for one in others if not one.patches(one.causes[-1])))
        return tuple(found)

    def _instead(
        self, best: Trial, cause: Effect, without: Trial, left: Left, near: Sequence[FirstGuess]
    ) -> list[Trial]:
        """Models with one of some others in the place of a cause.

        They begin at their scores in what is left without it; walls and discs, which have none, where they were when
        they were tried.
        """
        extensions, names = self.refits.extensions, {one.effect.name for one in near}
        scored = [one for one in left.scores if one.effect.name in names][:MOST_RIVALS]
        placed = [one for one in near if isinstance(one.effect, Wall | HiddenObstacle)][:MOST_RIVALS]
        return [*extensions.made_of(without, scored), *_continued(extensions.instead(best, cause, without, placed))]

    def _near(self, cause: Effect) -> tuple[FirstGuess, ...]:
        """Effects that could take the place of a cause in the videos that the search begins with."""
        return () if self.beginning is None else self.beginning.rivals.get(cause.name, ())


def _continued(trials: Sequence[Trial]) -> list[Trial]:
    """Models after as many steps as their fits need, the best first."""
    return sorted(in_processes(Trial.continued, trials), key=merit, reverse=True)


def _close(step: Step, best: Trial) -> list[FirstGuess]:
    """Starts with what was tried at a step and came close to the best there, but for causes of a model, best first."""
    least = HOPEFUL * max(gain(one, step.base)[0] for one in step.tried)
    found: dict[str, FirstGuess] = {}
    for one in sorted(step.tried, key=merit, reverse=True):
        cause = one.causes[-1]
        if cause.name not in best.names and gain(one, step.base)[0] > least and not one.patches(cause):
            found.setdefault(cause.name, one.start_with(cause))
    return list(found.values())


def _tried_at(cause: Effect, steps: Sequence[Step]) -> Step:
    """The step at which a cause was tried first.

    A wall or a disc is tried again where kicks lead to it: then the last one, or that of the kicks.
    """
    if not isinstance(cause, Wall | HiddenObstacle):
        return _first_with(cause.name, steps) or steps[0]
    return _first_with(cause.name, steps[::-1]) or _first_with(ExternalImpulse.name, steps) or steps[0]


def _first_with(name: str, steps: Sequence[Step]) -> Step | None:
    """The first step at which an effect was tried; None where it never was."""
    return next(
        (step for step in steps if any(one.name == name for trial in step.tried for one in trial.beyond(step.base))),
        None,
    )
