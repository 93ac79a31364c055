"""Forward selection of causes by how well whole videos are predicted that the model was not fitted to."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.scores import mends_any_course
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.shortlist import HOPEFUL
from vrdp_prob.discovery.selection.trials import Trial, gain, merit, with_own_population
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.second_look import doubtful
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.progress import ProgressDisplay, SilentProgress

MOST_RIVALS = 2
MOST_CAUSES = 5
CAUSES_LEFT = f"The search ended after {MOST_CAUSES} causes, the most that are looked for; there may be more."
MOST_SWAPS = 3
MOST_ROUNDS = 3
"""How often causes are looked for once more since a better course of events was found."""
COURSES_LEFT = (
    f"Better courses of events were found more than {MOST_ROUNDS} times while causes were looked for; beside the last "
    "of them no cause was."
)
TRIFLING = 0.1
"""Share of what a model lacks that a better course must bring for causes to be looked for once more."""
OUT_OF_REACH = 2.0
"""Gain, in those that are needed, by which a cause is ahead of others for none of them to be as probable as it is."""
MOSTLY = 0.5
"""Share of what a cause brings that is brought in one video if it may be a course of events there."""
PLAIN = 50.0
"""Gain of a cause, in those that are needed, from which it is not put in doubt again."""
FALSE_ALARM = 0.05
"""Prior odds that the model lacks something; all causes of the catalogue share them alike."""


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
class Search:
    """How a search went.

    Parameters
    ----------
    base
        The model that was given, with the best courses of events that were found, whatever was tried beside it.
    best
        The model with every cause that was found.
    steps
        The steps, the last of which added nothing.
    lesser
        For each cause of `best`: the model without it.
    rivals
        For each cause of `best`: models in which another cause takes its place, as far as any came close.
    refits
        What every model leaves, and the refits of it.
    limit
        The limit that ended the search, in a sentence; empty where it ended since nothing more was found.
    """

    base: Trial
    best: Trial
    steps: tuple[Step, ...]
    lesser: tuple[Trial, ...]
    rivals: tuple[tuple[Trial, ...], ...]
    refits: Refits
    limit: str = ""

    @property
    def needed(self) -> float:
        """Gain (nats) in the predictive density that a cause must bring."""
        return self.refits.needed

    @property
    def left(self) -> Left:
        """What the best model leaves."""
        return self.refits.leavings.of(self.best)

    @property
    def overdispersion(self) -> Float[np.ndarray, "video"]:
        """Factor of each video by which gains are divided."""
        return self.left.overdispersion

    def asking(self, catalogue: Sequence[Effect]) -> "Search":
        """The search with what the best model leaves asked for the traces of other causes; none of them is tried."""
        return replace(self, refits=replace(self.refits, catalogue=tuple(catalogue)))

    @property
    def near(self) -> tuple[tuple[Trial, ...], ...]:
        """For each cause of the best model: rivals that may be as probable as that."""
        divisor, least = self.overdispersion, OUT_OF_REACH * self.needed
        return tuple(tuple(one for one in some if gain(self.best, one, divisor)[0] < least) for some in self.rivals)

    def without(self, causes: Sequence[Effect]) -> "Search":
        """The search with a best model that lacks some of its causes, and those that bring too little without these."""
        if not causes:
            return self
        if len(causes) == len(self.best.causes):
            return self._with_best(self.base)
        return self._with_best(self.best.without(*causes).continued())

    def with_rival(self, cause: Effect, believable: Callable[[Trial], bool]) -> "Search | None":
        """The search with another cause in the place of one of the best model; None where none explains as much.

        Parameters
        ----------
        cause
            The cause whose place is taken.
        believable
            Whether a model with a rival in it is one to go on with.
        """
        number = self.best.causes.index(cause)
        for rival in sorted(self.rivals[number], key=merit, reverse=True):
            if gain(self.best, rival, self.overdispersion)[0] < self.needed and believable(rival):
                found = self._with_best(rival.continued())
                if rival.causes[-1] in found.best.causes:
                    return found
        return None

    def _with_best(self, best: Trial) -> "Search":
        """The search with another best model, as far as its causes are established."""
        best, lesser = _Searcher(self.refits).established(best)
        return replace(self, best=best if best.causes else self.base, lesser=lesser, rivals=tuple(() for _ in lesser))


def gain_needed(causes: int) -> float:
    """Gain (nats) in the predictive density that a cause must bring where so many are looked for."""
    return float(np.log(max(causes, 1) / FALSE_ALARM))


def search(
    fit: SharedFit,
    catalogue: Sequence[Effect],
    needed: float,
    *,
    seed: int,
    progress: ProgressDisplay | None = None,
    beginning: Beginning | None = None,
) -> Search:
    """Look for causes that a model lacks, one after the other.

    Parameters
    ----------
    fit
        Fit of the model to all videos.
    catalogue
        Causes that are looked for.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    seed
        Of the null distributions.
    progress
        Told how far the work is.
    beginning
        What the search goes on from; from the model alone where None, or where these causes bring too little.
    """
    with (progress or SilentProgress()).stage("Trying causes", total=None) as advance:
        searcher = _Searcher(Refits(tuple(catalogue), seed, needed, advance), beginning)
        base = Trial((), with_own_population(fit), stated=fit.model.beliefs).continued()
        chain, steps, limit = searcher.forward(base)
        best = searcher.unpatched(chain[-1])
        if best is not chain[-1]:
            chain.append(best)
            steps.append(searcher.untried(best))
        best, lesser, rivals = searcher.compared(chain, steps)
        if not best.causes:  # what was tried, and what is told, is of the model that was given
            best = chain[0]
    return Search(chain[0], best, tuple(steps), lesser, rivals, searcher.refits, limit)


@dataclass(frozen=True)
class _Searcher:
    """What is looked for.

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
    def seed(self) -> int:
        return self.refits.seed

    @property
    def needed(self) -> float:
        return self.refits.needed

    @property
    def leavings(self) -> Leavings:
        return self.refits.leavings

    def _near(self, cause: Effect) -> frozenset[str]:
        """Names of effects that could take the place of a cause in the videos that the search begins with."""
        return frozenset() if self.beginning is None else self.beginning.rivals.get(cause.name, frozenset())

    def forward(self, base: Trial) -> tuple[list[Trial], list[Step], str]:
        """The models that follow one another, each with a cause more, the step from each, and what limit ended them.

        The last step adds nothing. Where some causes are known to begin with, the second model has these.
        """
        begun = None if self.beginning is None else self.beginning.fitted(base, self.refits)
        chain = [base] if begun is None else [base, begun]
        steps, rounds = [self.untried(one) for one in chain], 0
        while len(chain) <= MOST_CAUSES:
            step = steps[-1] = self.tried(chain[-1])
            found, winner = self.chosen(chain[-1], step)
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
        return None if self.doubted(second, trial, divisor) or self.doubted(second, first, divisor) else (first, second)

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
            if self.doubted(winner, trial, self.leavings.of(winner).overdispersion):
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
        lesser = self._left_out(last, steps[-1].left.overdispersion, *last.beyond(before[-1]))
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
        if others and not self.doubted(others[0], trial, np.ones(len(trial.fit.videos))):
            return [*others, *sorted(patching, key=merit, reverse=True)]
        return sorted(found, key=merit, reverse=True)

    def doubted(self, trial: Trial, lesser: Trial, divisor: Float[np.ndarray, "video"]) -> bool:
        """Whether a cause brings too little, or brings it in too few of the videos that could have been drawn."""
        return self.refits.doubted(trial, lesser, divisor)

    def compared(
        self, chain: Sequence[Trial], steps: Sequence[Step]
    ) -> tuple[Trial, tuple[Trial, ...], tuple[tuple[Trial, ...], ...]]:
        """The best model, each of its causes left out, and others in the place of each.

        A cause that was found first may fit worse than another once a further one has joined; then they are swapped.
        """
        best = chain[-1]
        known = [one for one in chain[-2:-1] if one.causes == best.causes[:-1]]
        divisor = steps[-1].left.overdispersion
        lesser = (*self._lesser(best, best.causes[: len(best.causes) - len(known)], divisor), *known)
        sure = partial(_sure, divisor=divisor)
        for _ in range(MOST_SWAPS):
            best, lesser = self._pruned(best, lesser, divisor)
            rivals = self._rivals(best, lesser, steps)
            others = (one for some in rivals for one in some)
            better = max(others, key=sure, default=best)
            if sure(better) > sure(best) and self.refits.is_nothing(better, best, divisor):
                better = best
            if sure(better) <= sure(best):
                break
            best, lesser = better, self._lesser(better, better.causes, divisor)
        else:
            rivals = self._rivals(best, lesser, steps)
        return best, lesser, rivals

    def established(self, best: Trial) -> tuple[Trial, tuple[Trial, ...]]:
        """A model without those of its causes that bring too little, and the same without each of the others."""
        divisor = self.leavings.of(best).overdispersion
        return self._pruned(best, self._lesser(best, best.causes, divisor), divisor)

    def _pruned(
        self, best: Trial, lesser: tuple[Trial, ...], divisor: Float[np.ndarray, "video"]
    ) -> tuple[Trial, tuple[Trial, ...]]:
        while (left := self._without_doubted(best, lesser, divisor)) is not None:
            best, lesser = left, self._lesser(left, left.causes, divisor)
        return best, lesser

    def _without_doubted(
        self, best: Trial, lesser: Sequence[Trial], divisor: Float[np.ndarray, "video"]
    ) -> Trial | None:
        """A model without the weakest of its causes that are not established; None where all are."""
        weakest_first = sorted(lesser, key=partial(_sure, divisor=divisor), reverse=True)
        return next((one for one in weakest_first if self.doubted(best, one, divisor)), None)

    def unpatched(self, best: Trial) -> Trial:
        """A model without those of its causes that patch several videos and explain few of them."""
        while (patching := next((cause for cause in best.causes if best.patches(cause)), None)) is not None:
            best = self._left_out(best, self.leavings.of(best).overdispersion, patching)
        return best

    def _lesser(self, best: Trial, causes: Sequence[Effect], divisor: Float[np.ndarray, "video"]) -> tuple[Trial, ...]:
        """A model without each of some causes."""
        return tuple(self._left_out(best, divisor, cause) for cause in causes)

    def _left_out(self, best: Trial, divisor: Float[np.ndarray, "video"], *causes: Effect) -> Trial:
        """A model without some of its causes, searched the longer the less these seem to bring.

        What a cause brings that may as well vanish are courses of events, which the model without it may find, too.
        """

        def takes_a_search(lesser: Trial) -> bool:
            little = gain(best, lesser)[0] < PLAIN * self.needed
            return little or self.refits.is_nothing(best, lesser, divisor)

        found = best.without(*causes)
        if takes_a_search(found):
            found = found.mended(doubtful(found.fit.fits), seed=self.seed)
        return found.continued() if takes_a_search(found) else found

    def _rivals(self, best: Trial, lesser: Sequence[Trial], steps: Sequence[Step]) -> tuple[tuple[Trial, ...], ...]:
        """For each cause of a model: models in which another one takes its place.

        A rival was tried when that cause was, and came close to it; what happened once may as well have been something
        unseen that a body met. Of a single cause all that was tried on the model that was given are rivals.
        """
        found = []
        for cause, without in zip(best.causes, lesser, strict=True):
            step = _tried_at(cause, steps)
            others = [one for one in step.tried if one.causes[-1].name not in best.names]
            if not step.tried:  # the search has begun with the cause
                others = self._instead(without, self.leavings.of(without), self._near(cause).difference(best.names))
            elif len(best.causes) > 1 or step is not steps[0]:
                least = HOPEFUL * max(gain(one, step.base)[0] for one in step.tried)
                close = {
                    one.causes[-1].name
                    for one in others
                    if gain(one, step.base)[0] > least and not one.patches(one.causes[-1])
                }
                others = self._instead(without, step.left, close)
                if len(best.causes) == 1:
                    made = {*best.names, *(one.causes[-1].name for one in others)}
                    others += [one for one in steps[0].tried if one.causes[-1].name not in made]
            if cause is best.causes[-1] and isinstance(cause, ExternalImpulse):
                made = {one.causes[-1].name for one in others}
                hidden = in_processes(Trial.continued, self.refits.extensions.hidden_instead(best, without, known=made))
                others += sorted(hidden, key=merit, reverse=True)
            found.append(tuple(one for one in others if not one.patches(one.causes[-1])))
        return tuple(found)

    def _instead(self, without: Trial, left: Left, names: Collection[str]) -> list[Trial]:
        """Models with one of some causes in the place of the one that a model lacks, by the scores in what is left."""
        again = [one for one in left.scores if one.effect.name in names][:MOST_RIVALS]
        return self.refits.extensions.made_of(without, again)


def _tried_at(cause: Effect, steps: Sequence[Step]) -> Step:
    """The step at which a cause was tried first; for a wall or a disc that kicks led to, that of these."""
    for name in (cause.name, ExternalImpulse.name):
        for step in steps:
            if any(one.name == name for trial in step.tried for one in trial.beyond(step.base)):
                return step
    return steps[0]


def _is_trifle(better: Trial, before: Trial) -> bool:
    """Whether a better course of events brings too little of what a model lacks for causes to be looked for anew."""
    return gain(better, before)[0] <= TRIFLING * before.lacking


def _in_one_video(trial: Trial, base: Trial) -> list[int]:
    """The video in which a model gains most of what it gains, if there is one."""
    gained = trial.log_density - base.log_density
    most = int(np.argmax(gained))
    return [most] if gained[most] > MOSTLY * gained.sum() else []


def _sure(trial: Trial, divisor: Float[np.ndarray, "video"]) -> float:
    """How probable (nats) a model is, where gains of videos are divided."""
    return float((trial.log_density / divisor).sum()) + trial.log_prior
