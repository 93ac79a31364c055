"""Forward selection: one cause after the other, by how much better left-out videos are predicted with it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vrdp_prob.discovery.candidates.scores import mends_any_course
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.gains import OUT_OF_REACH, gain, merit
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.lesser_models import LesserModels
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.trials import Trial

MOST_CAUSES = 5
CAUSES_LEFT = f"The search ended after {MOST_CAUSES} causes, the most that are looked for; there may be more."
MOST_ROUNDS = 3
"""How often causes are looked for once more since a better course of events was found."""
COURSES_LEFT = (
    f"Better courses of events were found more than {MOST_ROUNDS} times while causes were looked for; beside the last "
    "of them no cause was."
)
TRIFLING = 0.1
"""Share of what a model lacks that a better course must bring for causes to be looked for once more."""
MOSTLY = 0.5
"""Share of what a cause brings that is brought in one video if it may be a course of events there."""


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    base
        The model on which causes were tried.
    left
        What the model leaves before the step.
    tried
        Refits with one more cause, the best first; what patches several videos comes last, unless the best other one
        is in doubt.
    pair
        A refit of `tried` and one with a further cause, which are established together; None where nothing was left to
        look for a second cause in, or no two are.
    """

    base: Trial
    left: Left
    tried: tuple[Trial, ...] = ()
    pair: tuple[Trial, Trial] | None = None


@dataclass(frozen=True)
class ForwardSelection:
    """Causes that a model lacks, one after the other.

    Parameters
    ----------
    refits
        What makes the refits.
    beginning
        What the search goes on from, beside the model that is given.
    """

    refits: Refits
    beginning: Beginning | None = None

    @property
    def needed(self) -> float:
        """Gain (nats) in the predictive density that a cause must bring."""
        return self.refits.needed

    @property
    def leavings(self) -> Leavings:
        """What models leave."""
        return self.refits.leavings

    @cached_property
    def _lesser(self) -> LesserModels:
        return LesserModels(self.refits)

    def models(self, base: Trial) -> tuple[list[Trial], list[Step], str]:
        """The models that follow one another, each with a cause more, the step from each, and what limit ended them.

        The last step adds nothing. Where some causes are known to begin with, the second model has these.
        """
        begun = None if self.beginning is None else self.beginning.fitted(base, self.refits)
        chain = [base] if begun is None else [base, begun]
        steps, rounds = [self.untried(one) for one in chain], 0
        while len(chain[-1].cause_names) < MOST_CAUSES:
            step = steps[-1] = self.tried(chain[-1])
            found, winner = self.chosen(chain[-1], step)
            if winner is None and found is chain[-1]:
                found = self.refits.searched_where_checks_fail(found)
            is_exhausted = _is_trifle(found, chain[-1])
            if found is not chain[-1]:
                chain[-1], steps[-1] = found, replace(step, left=self.leavings.of(found))
                back = self.handed_back(chain, steps) if rounds < MOST_ROUNDS else chain
                compared = zip(back, chain, steps, strict=False)
                steps = [
                    step if one is other else replace(step, left=self.leavings.of(one)) for one, other, step in compared
                ]
                is_shorter, chain = len(back) < len(chain), back
                if is_shorter:
                    rounds, steps[-1] = rounds + 1, self.untried(chain[-1])
                    continue
            if winner is not None:
                chain.append(winner)
                steps.append(self.untried(winner))
            elif is_exhausted:
                return chain, steps, ""
            elif rounds == MOST_ROUNDS:
                return chain, steps, COURSES_LEFT
            else:
                rounds += 1
        return chain, steps, CAUSES_LEFT

    def untried(self, trial: Trial) -> Step:
        """A step in which nothing was tried yet."""
        return Step(trial, self.leavings.of(trial))

    def tried(self, trial: Trial) -> Step:
        """The step with the causes tried that may be the best one."""
        found, pair = self.refits.of(trial), None
        first = self._to_go_on_from(trial, found)
        if first is not None and self.refits.leaves_unexplained(trial, first):
            found = self.refits.with_lost(trial)
            first = self._to_go_on_from(trial, found)
        if first is not None:
            first = self.refits.with_lost_found(trial, first)
            found = self.refits.of(trial)
        if not self.refits.settled(trial, found):
            pair = None if first is None else self._pair(trial, first)
            if pair is None:
                found = self.refits.with_lost(trial)
        return Step(trial, self.leavings.of(trial), tuple(self._in_order(trial, found)), pair)

    def _to_go_on_from(self, trial: Trial, found: Sequence[Trial]) -> Trial | None:
        """The refit that a second cause is looked for beside; None where the best settles it or none brings enough."""
        return None if self.refits.settled(trial, found) else self.refits.provisional(trial, found)

    def _pair(self, trial: Trial, first: Trial) -> tuple[Trial, Trial] | None:
        """A cause and a second one beside it, if both together are established.

        What two causes leave when one is known may follow chance as well as what both leave: then neither stands out
        beside chance by itself.
        """
        second = next(iter(self._in_order(first, self.refits.with_lost(first))), first)
        if second is first or gain(second, trial)[0] < 2 * self.needed or gain(second, first)[0] < self.needed:
            return None
        divisor = self.leavings.of(second).overdispersion
        return (
            None
            if self.refits.doubted(second, trial, divisor) or self.refits.doubted(second, first, divisor)
            else (first, second)
        )

    def chosen(self, trial: Trial, step: Step) -> tuple[Trial, Trial | None]:
        """The model to go on from, and the same with the cause that a step has established; None where it has none.

        Where the winner's refit has found a better course of events in some videos, that is no merit of the cause,
        though others may need the cause for theirs, and the model with that course is the one to go on from; so it is
        where a search finds one that the winner's kicks stood for, or what it brings in a single video.
        """
        winner = next((one for one in step.tried[:1] if gain(one, trial)[0] >= self.needed), None)
        if winner is not None:
            without = winner.without(*winner.beyond(trial))
            trial = self._with_both_courses(without, trial)
            kicked = winner.acting(winner.causes[-1]) if mends_any_course(winner.causes[-1]) else []
            if mendable := kicked or _in_one_video(winner, trial):
                mended = self.refits.courses.searched_anew(trial, mendable)
                trial = mended if gain(mended, trial)[0] > self.needed else trial
            if self.refits.doubted(winner, trial, self.leavings.of(winner).overdispersion):
                winner = None
        return trial, self.or_first_of(step.pair, winner)

    def handed_back(self, chain: Sequence[Trial], steps: Sequence[Step]) -> list[Trial]:
        """The models up to the first that gains by the course which the last one has found since, with that course.

        What it brings is no merit of the causes beside which it was found: these are looked for once more. But not for
        a trifle: where nothing explains the videos, one wrong course is as good as another. The last one stays where it
        is ahead of the model without it, and of all that was tried in its place, by so much more than the course brings
        that none of them could overtake it; but not kicks, which mend any course.
        """
        *before, last = chain
        if not before:
            return [last]
        lesser = self._lesser.left_out(last, steps[-1].left.overdispersion, *last.beyond(before[-1]))
        better = self._with_both_courses(lesser, before[-1])
        if _is_trifle(better, before[-1]):
            return list(chain)
        course = gain(better, before[-1])[0]
        head = self.handed_back([*before[:-1], better], steps[:-1])
        if len(head) < len(before) or mends_any_course(last.causes[-1]) or last.fallen_from(better):
            return head
        others = [one for one in steps[-2].tried if one.causes[-1] not in last.causes]
        ahead = min(gain(last, one)[0] for one in (better, *others))
        return [*head, last] if ahead > course + OUT_OF_REACH * self.needed else head

    def _with_both_courses(self, found: Trial, before: Trial) -> Trial:
        """The model of before with the better course of both in each video; itself where that brings too little.

        Videos that have lost their course with it are searched anew. A cause beside which both courses are kept would
        have the credit for the one that is lost without it.
        """
        ways = (found.with_courses_of(before), before.with_courses_of(found))
        both = max(ways, key=lambda one: float(one.log_density.sum()))
        if gain(both, before)[0] <= self.needed:
            return before
        return self.refits.courses.searched_anew(both, both.fallen_from(before))

    def or_first_of(self, pair: tuple[Trial, Trial] | None, winner: Trial | None) -> Trial | None:
        """The best single cause, or the first of an established pair that brings more.

        Kicks explain more than either of two causes does, and less than both.
        """
        if pair is None or (winner is not None and gain(pair[1], winner)[0] < self.needed):
            return winner
        return pair[0]

    def _in_order(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Trials by merit; those that patch or lose several videos last, unless the best other one is in doubt."""
        patching = [one for one in found if one.patches(one.causes[-1]) or one.loses_most_of(trial)]
        others = sorted((one for one in found if one not in patching), key=merit, reverse=True)
        if others and not self.refits.doubted(others[0], trial, np.ones(len(trial.fit.videos))):
            return [*others, *sorted(patching, key=merit, reverse=True)]
        return sorted(found, key=merit, reverse=True)


def _is_trifle(better: Trial, before: Trial) -> bool:
    """Whether a better course of events brings too little of what a model lacks for causes to be looked for anew."""
    return gain(better, before)[0] <= TRIFLING * before.lacking


def _in_one_video(trial: Trial, base: Trial) -> list[int]:
    """The video in which a model gains most of what it gains, if there is one."""
    gained = trial.log_density - base.log_density
    most = int(np.argmax(gained))
    return [most] if gained[most] > MOSTLY * gained.sum() else []
