"""Forward selection of causes by how well whole videos are predicted that the model was not fitted to."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.overdispersion import overdispersion
from vrdp_prob.discovery.proposals import hidden_things
from vrdp_prob.discovery.scores import CauseScore, happens_once, score_causes
from vrdp_prob.discovery.single_videos import causes_of_lost_videos, lost_videos
from vrdp_prob.discovery.trials import Trial, gain, weights, with_own_population
from vrdp_prob.inference.parallel import in_processes
from vrdp_prob.inference.several_videos.ascent import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.second_look import doubtful
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.progress import Advance, ProgressDisplay, SilentProgress

SHORTLIST_LEVEL = 0.01
"""Causes whose score chance makes as large more often are not refitted."""
CLOSE = 0.5
"""Share of the largest statistic below which a cause is refitted only if those above it leave something."""
HOPEFUL = 0.2
"""Share of the largest statistic below which a cause cannot be the best one, nor a rival of it."""
MOST_REFITTED, MOST_RIVALS = 5, 2
MOST_CAUSES = 5
MOST_SWAPS = 3
SHORT, MENDINGS = 0.5, 3
"""Share of what was promised or brought by another that a cause must bring, and number of refits searched anew."""
PLAIN = 50.0
"""Gain of a cause, in those that are needed, from which it is not put in doubt again."""
ESTABLISHED = 0.8
"""Probability that a cause must have beside the model without it."""
FALSE_ALARM = 0.05
"""Prior odds that the model lacks something; all causes of the catalogue share them alike."""


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    scores
        Scores of all causes before the step, the least probable by chance first, where all that is left is noise.
    beside_chance
        The same beside what the model leaves to chance.
    tried
        Refits with one more cause, the best first; what patches several videos comes last, unless the best other one
        is in doubt.
    overdispersion
        Of each video, by what the model leaves unexplained before the step.
    pair
        A refit of `tried` and one with a further cause, which are established together; None where nothing was left to
        look for a second cause in, or no two are.
    """

    scores: tuple[CauseScore, ...]
    beside_chance: tuple[CauseScore, ...]
    tried: tuple[Trial, ...]
    overdispersion: Float[np.ndarray, "video"]
    pair: tuple[Trial, Trial] | None = None


@dataclass(frozen=True)
class Search:
    """How a search went.

    Parameters
    ----------
    base
        The model that was given.
    best
        The model with every cause that was found.
    steps
        The steps, the last of which added nothing.
    lesser
        For each cause of `best`: the model without it.
    rivals
        For each cause of `best`: models in which another cause takes its place, as far as any came close.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    overdispersion
        Factor of each video by which gains are divided.
    """

    base: Trial
    best: Trial
    steps: tuple[Step, ...]
    lesser: tuple[Trial, ...]
    rivals: tuple[tuple[Trial, ...], ...]
    needed: float
    overdispersion: Float[np.ndarray, "video"]


def search(
    fit: SharedFit, catalogue: Sequence[Effect], *, seed: int, progress: ProgressDisplay | None = None
) -> Search:
    """Look for causes that a model lacks, one after the other.

    Parameters
    ----------
    fit
        Fit of the model to all videos.
    catalogue
        Causes that are looked for.
    seed
        Of the null distributions.
    progress
        Told how far the work is.
    """
    needed = float(np.log(len(catalogue) / FALSE_ALARM))
    with (progress or SilentProgress()).stage("Trying causes", total=None) as advance:
        searcher = _Searcher(tuple(catalogue), seed, needed, advance)
        chain = [Trial((), with_own_population(fit)).continued()]
        steps = [searcher.first(chain[0])]
        while len(chain) <= MOST_CAUSES:
            step = steps[-1] = searcher.tried(chain[-1])
            base, winner = searcher.chosen(chain[-1], step)
            found_better_course = base is not chain[-1]
            chain[-1] = base
            if winner is not None:
                chain.append(winner)
                steps.append(searcher.first(winner))
            elif found_better_course:
                steps[-1] = searcher.first(base)
            else:
                break
        best = searcher.unpatched(chain[-1])
        if best is not chain[-1]:
            chain.append(best)
            steps.append(searcher.first(best))
        best, lesser, rivals = searcher.compared(chain, steps)
    return Search(chain[0], best, tuple(steps), lesser, rivals, needed, steps[-1].overdispersion)


@dataclass(frozen=True)
class _Searcher:
    """What is looked for."""

    catalogue: tuple[Effect, ...]
    seed: int
    needed: float
    advance: Advance
    _known: dict[Trial, Step] = field(default_factory=dict)
    _refitted_before: dict[Trial, list[Trial]] = field(default_factory=dict)
    _searched: set[Trial] = field(default_factory=set)

    def first(self, trial: Trial) -> Step:
        """A step in which nothing was tried yet; a trial that is asked for again is not scored again."""
        if trial not in self._known:
            left = [effect for effect in self.catalogue if effect.name not in trial.names]
            found = trial.unexplained
            scores = beside = score_causes(trial.fit, found.plain, left, seed=self.seed)
            if found.accelerated:
                beside = score_causes(trial.fit, found.model, left, seed=self.seed)
            self._known[trial] = Step(tuple(scores), tuple(beside), (), overdispersion(found.model, seed=self.seed))
        return self._known[trial]

    def tried(self, trial: Trial) -> Step:
        """The step with the causes tried that may be the best one."""
        found, pair = self._refits(trial), None
        if not self._settled(trial, found):
            first = self._provisional(trial, found)
            if first is None:
                found = self._with_lost(trial)
            else:
                pair = self._pair(trial, first)
        return replace(self.first(trial), tried=tuple(self._in_order(trial, found)), pair=pair)

    def _refits(self, trial: Trial) -> list[Trial]:
        """Refits with one more cause, the best first; they are made the first time that they are asked for."""
        if trial not in self._refitted_before:
            self._refitted_before[trial] = self._new_refits(trial)
        return self._refitted_before[trial]

    def _new_refits(self, trial: Trial) -> list[Trial]:
        """Hidden things are tried only where nothing explains the videos better than kicks do."""
        scores = self.first(trial).scores
        likely = _shortlist(scores)
        close = [one for one in likely if one.size > CLOSE * likely[0].size]
        found = self._refitted(trial, close)
        if not self._settled(trial, found):
            found += self._refitted(trial, [one for one in likely if one not in close])
            found.sort(key=_merit, reverse=True)
        kicks = next((one for one in scores if isinstance(one.effect, ExternalImpulse) and one.sites), None)
        if kicks is not None and (not found or found[0].causes[-1].name == kicks.effect.name):
            found += self._hidden(trial, found, kicks)
        return sorted(found, key=_merit, reverse=True)

    def _with_lost(self, trial: Trial) -> list[Trial]:
        """The refits, and where they leave something fits from the beginning, which count among them from then on."""
        found = self._refits(trial)
        if trial not in self._searched and not self._settled(trial, found):
            self._searched.add(trial)
            found = self._refitted_before[trial] = sorted([*found, *self._lost(trial, found)], key=_merit, reverse=True)
        return found

    def _provisional(self, trial: Trial, found: Sequence[Trial]) -> Trial | None:
        """The lasting cause that brings most where all else is noise, if it brings enough."""
        lasting = [one for one in found if not happens_once(one.causes[-1])]
        first = max(lasting, key=lambda one: one.brought(trial) + one.log_prior, default=trial)
        return None if first.brought(trial) < self.needed else first

    def _pair(self, trial: Trial, first: Trial) -> tuple[Trial, Trial] | None:
        """A cause and a second one beside it, if both together are established.

        What two causes leave when one is known may follow chance as well as what both leave: then neither stands out
        beside chance by itself.
        """
        second = next(iter(self._in_order(first, self._with_lost(first))), first)
        if second is first or gain(second, trial)[0] < 2 * self.needed or gain(second, first)[0] < self.needed:
            return None
        divisor = self.first(second).overdispersion
        return None if self.doubted(second, trial, divisor) or self.doubted(second, first, divisor) else (first, second)

    def chosen(self, trial: Trial, step: Step) -> tuple[Trial, Trial | None]:
        """The model to go on from, and the same with the cause that a step has established; None where it has none.

        Where the winner's refit has found a better course of events, which is no merit of the cause, the model with
        that course is the one to go on from; so it is where a search finds one that the winner's kicks stood for.
        """
        winner = next((one for one in step.tried[:1] if gain(one, trial)[0] >= self.needed), None)
        if winner is not None:
            without = winner.without(winner.causes[-1])
            if gain(without, trial)[0] > self.needed:
                trial = without
            if happens_once(winner.causes[-1]):
                kicked = doubtful(trial.fit.fits, winner.acting(winner.causes[-1]))
                mended = trial.mended(kicked, seed=self.seed)
                trial = mended if gain(mended, trial)[0] > self.needed else trial
            if self.doubted(winner, trial, self.first(winner).overdispersion):
                winner = None
        return trial, self.or_first_of(step.pair, winner)

    def or_first_of(self, pair: tuple[Trial, Trial] | None, winner: Trial | None) -> Trial | None:
        """The best single cause, or the first of an established pair that brings more.

        Kicks explain more than either of two causes does, and less than both.
        """
        if pair is None or (winner is not None and gain(pair[1], winner)[0] < self.needed):
            return winner
        return pair[0]

    def _in_order(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Trials by merit; those that patch several videos last, unless the best other one is in doubt."""
        patching = [one for one in found if one.patches(one.causes[-1])]
        others = sorted((one for one in found if one not in patching), key=_merit, reverse=True)
        if others and not self.doubted(others[0], trial, np.ones(len(trial.fit.videos))):
            return [*others, *sorted(patching, key=_merit, reverse=True)]
        return sorted(found, key=_merit, reverse=True)

    def _settled(self, trial: Trial, found: Sequence[Trial]) -> bool:
        """Whether the best cause leaves nothing to explain, and is not a kick in each of several videos."""
        if not found or gain(found[0], trial)[0] < self.needed:
            return False
        if _mends_several(found[0]):
            return False
        left = self.first(found[0]).beside_chance
        return min((one.p_value for one in left), default=1.0) * len(left) > SHORTLIST_LEVEL

    def _lost(self, trial: Trial, found: Sequence[Trial]) -> list[Trial]:
        """Fits from the beginning, with causes that explain videos whose course of events nothing else explains.

        What happens once in each of several videos explains none of them: kicks mend any course.
        """
        if trial.choices:
            return []
        left = [effect for effect in self.catalogue if effect.name not in trial.names]
        likely = {one.effect.name for one in _shortlist(self.first(trial).scores)}
        reached = {one.causes[-1].name: one.brought(trial) for one in reversed(found)}
        best = next((one.fit for one in found if not _mends_several(one)), trial.fit)
        still_lost = lost_videos(best)
        lost = [one for one in lost_videos(trial.fit) if one in still_lost]
        told = causes_of_lost_videos(trial.fit, lost, left, likely, self.needed, seed=self.seed)
        again = [effect for effect, promised in told if reached.get(effect.name, 0.0) < promised]

        def searched(effect: Effect) -> Trial | None:
            model = trial.fit.model.with_effect(effect)
            tracks = [part.clues.tracks for part in trial.fit.fits]
            try:
                fit = fit_together(tracks, model=model, shared=trial.fit.shared, seed=self.seed, model_error=False)
                return Trial((*trial.causes, effect), with_own_population(fit), trial.choices)
            except ImpossibleStartError:  # what single videos say of the cause fits no world of all of them
                return None
            finally:
                self.advance(1)

        return [one for one in map(searched, again) if one is not None]

    def _hidden(self, trial: Trial, found: Sequence[Trial], kicks: CauseScore) -> list[Trial]:
        """Fits with something unseen in the place of kicks."""
        kicked = next((one for one in found if one.causes[-1].name == kicks.effect.name), None)
        kicked = kicked or next(iter(self._refitted(trial, [kicks])), None)
        if kicked is None:
            return []
        left = [effect for effect in self.catalogue if effect.name not in trial.names]
        starts = hidden_things(kicked.fit, left, kicks.p_value)
        return self._all(partial(kicked.with_cause_in_place, least=trial.fit.joint.log_density), starts)

    def doubted(self, trial: Trial, lesser: Trial, divisor: Float[np.ndarray, "video"]) -> bool:
        """Whether a cause brings too little, or brings it in too few of the videos that could have been drawn."""
        if gain(trial, lesser, divisor)[0] < self.needed:
            return True
        shares = weights([trial, lesser], [0.0, self.needed], np.random.default_rng(self.seed), overdispersion=divisor)
        return bool(shares[0] < ESTABLISHED)

    def compared(
        self, chain: Sequence[Trial], steps: Sequence[Step]
    ) -> tuple[Trial, tuple[Trial, ...], tuple[tuple[Trial, ...], ...]]:
        """The best model, each of its causes left out, and others in the place of each.

        A cause that was found first may fit worse than another once a further one has joined; then they are swapped.
        """
        best = chain[-1]
        known = [one for one in chain[-2:-1] if one.causes == best.causes[:-1]]
        lesser = (*self._lesser(best, best.causes[: len(best.causes) - len(known)]), *known)
        divisor = steps[-1].overdispersion

        def merit(trial: Trial) -> float:
            return float((trial.log_density / divisor).sum()) + trial.log_prior

        for _ in range(MOST_SWAPS):
            while lesser and self.doubted(best, weakest := max(lesser, key=merit), divisor):
                best, lesser = weakest, self._lesser(weakest, weakest.causes)
            rivals = self._rivals(best, lesser, steps)
            better = max((one for some in rivals for one in some), key=merit, default=best)
            if merit(better) <= merit(best):
                break
            best = better
            lesser = self._lesser(best, best.causes)
            rivals = self._rivals(best, lesser, steps)
        return best, lesser, rivals

    def unpatched(self, best: Trial) -> Trial:
        """A model without those of its causes that patch several videos and explain few of them."""
        patching = next((cause for cause in best.causes if best.patches(cause)), None)
        return best if patching is None else self.unpatched(self._left_out(best, patching))

    def _lesser(self, best: Trial, causes: Sequence[Effect]) -> tuple[Trial, ...]:
        """A model without each of some causes."""
        return tuple(self._left_out(best, cause) for cause in causes)

    def _left_out(self, best: Trial, cause: Effect) -> Trial:
        """A model without one of its causes, searched the longer the less the cause seems to bring."""
        found = best.without(cause)
        if gain(best, found)[0] < PLAIN * self.needed:
            found = found.mended(doubtful(found.fit.fits), seed=self.seed)
        return found.continued() if gain(best, found)[0] < PLAIN * self.needed else found

    def _rivals(self, best: Trial, lesser: Sequence[Trial], steps: Sequence[Step]) -> tuple[tuple[Trial, ...], ...]:
        """For each cause of a model: models in which another one takes its place.

        A rival was tried when that cause was, and came close to it.
        """
        found = []
        for cause, without in zip(best.causes, lesser, strict=True):
            step = next(one for one in steps if any(trial.causes[-1].name == cause.name for trial in one.tried))
            others = [one for one in step.tried if one.causes[-1].name not in best.names]
            if len(best.causes) > 1 or step is not steps[0]:
                most = max(float(one.log_density.sum()) for one in step.tried)
                least = HOPEFUL * (most - float(without.log_density.sum()))
                close = {one.causes[-1].name for one in others if gain(one, without)[0] > least}
                again = [one for one in step.scores if one.effect.name in close][:MOST_RIVALS]
                others = self._refitted(without, again)
            found.append(tuple(one for one in others if not one.patches(one.causes[-1])))
        return tuple(found)

    def _refitted(self, trial: Trial, scores: Sequence[CauseScore]) -> list[Trial]:
        """Fits with one cause more, the best first.

        Where the score of a cause promises more than any refit has brought, and its own brought far less, videos have
        lost their course of events on the way to it, and are searched anew.
        """
        found = self._all(trial.with_cause, scores)
        promised = {one.effect.name: one.size / 2 for one in scores if not happens_once(one.effect)}
        for _ in range(MENDINGS):
            most = max((one.brought(trial) for one in found), default=0.0)
            short = [
                one
                for one in found
                if promised.get(one.causes[-1].name, 0.0) > max(most, one.brought(trial) / SHORT, 0.0)
                and one.fallen_from(trial)
            ]
            if not short:
                break
            hopeful = max(short, key=lambda one: promised[one.causes[-1].name])
            mended = hopeful.mended(hopeful.fallen_from(trial), seed=self.seed)
            if mended is hopeful:
                promised.pop(hopeful.causes[-1].name)
            found = [mended if one is hopeful else one for one in found]
        most = max((one.brought(trial) for one in found), default=0.0)
        close = [one for one in found if one.brought(trial) > SHORT * most > 0]
        rest = [one for one in found if one not in close]
        return sorted([*in_processes(Trial.continued, close), *rest], key=_merit, reverse=True)

    def _all(self, refit: Callable[[CauseScore], Trial | None], scores: Sequence[CauseScore]) -> list[Trial]:
        return [one for one in in_processes(refit, scores, advance=self.advance) if one is not None]


def _merit(trial: Trial) -> float:
    """By which models are ordered: what they predict of left-out videos, less what their causes are believed less."""
    return float(trial.log_density.sum()) + trial.log_prior


def _mends_several(trial: Trial) -> bool:
    """Whether the last cause of a model happens once in each of several videos."""
    cause = trial.causes[-1]
    return happens_once(cause) and len(trial.acting(cause)) > 1


def _shortlist(scores: Sequence[CauseScore]) -> list[CauseScore]:
    """Causes that may be the best one, or come near it."""
    largest = max((one.size for one in scores), default=0.0)
    hopeful = [one for one in scores if one.p_value < SHORTLIST_LEVEL and one.size > HOPEFUL * largest]
    return sorted(hopeful, key=lambda one: -one.size)[:MOST_REFITTED]
