"""Fits of a model with further causes: from their scores, from the beginning, or in the place of kicks."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vrdp_prob.discovery.candidates.dropped_frames import Dropped, choices
from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.candidates.proposals import hidden_things
from vrdp_prob.discovery.candidates.scores import CauseScore, mends_any_course
from vrdp_prob.discovery.candidates.surfaces import Placed
from vrdp_prob.discovery.selection.gains import merit
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.met_surfaces import fit_with_surfaces
from vrdp_prob.discovery.selection.restamped import fit_with_dropped_frames
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.second_look import explained
from vrdp_prob.models.effects.dropped_frames import DroppedFrames
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import Advance

SHORT, MENDINGS = 0.5, 3
"""Share of what was promised or brought by another that a cause must bring, and number of refits searched anew."""


@dataclass(frozen=True)
class Extensions:
    """Makes models with further causes.

    Parameters
    ----------
    leavings
        What models leave.
    needed
        Gain (nats) in the predictive density that a cause must bring.
    advance
        Told of each fit.
    """

    leavings: Leavings
    needed: float
    advance: Advance

    @property
    def seed(self) -> int:
        """Of searches."""
        return self.leavings.seed

    def made_of(self, trial: Trial, scores: Sequence[CauseScore], *, beside: Sequence[Trial] = ()) -> list[Trial]:
        """Fits with one cause more, the best first; those that were made before stand `beside`.

        Where the score of a cause promises more than any refit has brought, and its own brought far less, that goes on
        if it broke off on a long way; and videos are searched anew that have lost their course of events on it, or hold
        it back. So it is with the cause whose score promises most of all, whatever others have brought, if that is as
        much as a cause needs at all. What mends any course is no measure of other causes.
        Those that bring a good part of the most are followed to the end; where none explains the videos these are also
        those that broke off and whose scores promise a good part of the most.
        """
        promised = {one.effect.name: one.size / 2 for one in scores if not mends_any_course(one.effect)}
        promised = {name: size for name, size in promised.items() if size > self.needed}
        found = self._all(trial.with_cause, scores)
        found, promised = self._taken_further(trial, found, promised, beside)
        close = _close_to_the_best(trial, found, promised, beside)
        rest = [one for one in found if one not in close]
        of_causes = {one.effect.name: one for one in scores}
        followed = in_processes(partial(_followed_to_the_end, trial, of_causes, self.seed), close)
        return sorted([*followed, *rest], key=merit, reverse=True)

    def _taken_further(
        self, trial: Trial, found: Sequence[Trial], promised: Mapping[str, float], beside: Sequence[Trial]
    ) -> tuple[list[Trial], dict[str, float]]:
        """Refits of a model, a few of which have gone on that brought far less than was promised, and what still is.

        What goes on and gains nothing is promised no more.
        """
        found, promised = list(found), dict(promised)
        leader = "" if explaining(beside) else max(promised, key=lambda name: promised[name], default="")
        for _ in range(MENDINGS):
            most = _brought_most(trial, [*beside, *found])
            short = [
                one
                for one in found
                if (told := promised.get(name := one.causes[-1].name, 0.0)) > max(one.brought(trial), 0.0)
                and (name == leader or told > max(most, one.brought(trial) / SHORT))
                and (_broke_off(one) or one.fallen_from(trial))
            ]
            if not short:
                break
            hopeful = max(short, key=lambda one: promised[one.causes[-1].name])
            further = self._mended(trial, hopeful, promised[hopeful.causes[-1].name])
            gained = further.brought(trial) - hopeful.brought(trial)
            if gained < self.needed:
                promised.pop(hopeful.causes[-1].name)
            if gained > 0:
                found = [further if one is hopeful else one for one in found]
        return found, promised

    def _mended(self, trial: Trial, one: Trial, promised: float) -> Trial:
        """A refit of a model that has gone on, with videos searched anew that have lost their way or hold it back."""
        further = one.continued()
        if fallen := further.fallen_from(trial):
            further = further.mended(fallen, seed=self.seed)
        return further if further.brought(trial) >= promised else further.freed(trial, seed=self.seed)

    def _all(self, refit: Callable[[FirstGuess], Trial | None], starts: Sequence[FirstGuess]) -> list[Trial]:
        return [one for one in in_processes(refit, starts, advance=self.advance) if one is not None]

    def from_the_beginning(
        self, trial: Trial, causes: Sequence[Effect], believed: PhysicsModel | None = None
    ) -> Trial | None:
        """The fit from the beginning with further causes; None where videos have no world in common.

        Parameters
        ----------
        trial
            The model that lacks them.
        causes
            The causes.
        believed
            The model with them that believes what other fits have told, under which the videos are fitted first: from
            there the fit goes on without that belief.
        """
        model = trial.fit.extended(*causes)

        def fitted() -> SharedFit:
            tracks = [part.clues.tracks for part in trial.fit.fits]
            first = believed or model
            fit = fit_together(tracks, model=first, shared=trial.fit.shared, seed=self.seed, model_error=False)
            return fit if believed is None else fit.under(model, model_error=False)

        return self._began_anew(trial, causes, fitted)

    def with_surfaces(self, trial: Trial, placed: Sequence[Placed]) -> Trial | None:
        """The fit from the beginning with walls and discs that tracks show, all of them at once.

        A fit without them has lost its way at the first that a body met, so that scores call for what mends its course.
        Where walls that count as stated explain the videos and leave something, or overlap what is seen, they may be a
        little off, and hold all videos there: then they are unknown from the beginning. None where videos have no world
        in common.
        """
        effects = [one.effect for one in placed]
        walls = [one for one in placed if one.wall is not None]
        found = self._began_anew(trial, effects, partial(fit_with_surfaces, trial, placed, walls, seed=self.seed))
        if not walls or (found is not None and not (explained(found.fit.fits) and self.leavings.something(found))):
            return found
        near = self._began_anew(trial, effects, partial(fit_with_surfaces, trial, placed, [], seed=self.seed))
        return max((one for one in (found, near) if one is not None), key=merit, default=None)

    def with_dropped_frames(self, trial: Trial, dropped: Sequence[Dropped]) -> Trial | None:
        """The fit from the beginning with the frames that tracks show to be missing, and what else it shows of them.

        None where videos have no world in common.
        """
        effect = DroppedFrames()
        found = self._began_anew(trial, [effect], partial(fit_with_dropped_frames, trial, dropped, seed=self.seed))
        if found is None:
            return None
        prices = [
            choices(tracks, sum(name in effect.stepwise for name, _ in structure.held))
            for structure, tracks in zip(found.fit.structures, trial.fit.tracks, strict=True)
        ]
        return replace(found, choices={**found.choices, effect.name: np.array(prices)})

    def hidden_instead(self, kicked: Trial, kicks: Effect, trial: Trial, *, known: Collection[str] = ()) -> list[Trial]:
        """Fits with something unseen in the place of the kicks of a model.

        Parameters
        ----------
        kicked, kicks
            The model, and its kicks.
        trial
            The model without them.
        known
            Names of causes whose fits are there already.
        """
        left = [effect for effect in self.leavings.further(kicked) if effect.name not in known]
        return self.instead(kicked, kicks, trial, hidden_things(kicked.fit, left))

    def instead(self, best: Trial, cause: Effect, lesser: Trial, starts: Sequence[FirstGuess]) -> list[Trial]:
        """Fits with others in the place of a cause, from where that has brought the videos.

        Parameters
        ----------
        best, cause
            The model, and the cause.
        lesser
            The model without it.
        starts
            The others, with the values from which their fits begin.
        """
        least = lesser.fit.joint.log_density
        return self._all(partial(best.with_cause_in_place, replaced=cause, least=least), starts)

    def _began_anew(self, trial: Trial, causes: Sequence[Effect], fitted: Callable[[], SharedFit]) -> Trial | None:
        """A trial with further causes by a fit from the beginning; None where videos have no world in common."""
        try:
            return trial.and_causes(causes, fitted())
        except ImpossibleStartError:  # what single videos say of the causes fits no world of all of them
            return None
        finally:
            self.advance(1)


def explaining(trials: Sequence[Trial]) -> list[Trial]:
    """Those whose last cause does not just mend any course."""
    return [one for one in trials if not mends_any_course(one.causes[-1])]


def _brought_most(trial: Trial, found: Sequence[Trial]) -> float:
    """What the refit of a model brings that brings most and does not just mend any course."""
    return max((one.brought(trial) for one in explaining(found)), default=0.0)


def _close_to_the_best(
    trial: Trial, found: Sequence[Trial], promised: Mapping[str, float], beside: Sequence[Trial]
) -> list[Trial]:
    """Refits that are worth following: they bring a good part of the most, or broke off and promise that."""
    most, leading = _brought_most(trial, [*beside, *found]), max(promised.values(), default=0.0)
    nothing_explains = not any(explained(one.fit.fits) for one in explaining(found))
    return [
        one
        for one in found
        if one.brought(trial) > SHORT * most > 0
        or (nothing_explains and _broke_off(one) and promised.get(one.causes[-1].name, 0.0) > SHORT * leading)
    ]


def _broke_off(one: Trial) -> bool:
    """Whether a refit ended before it had arrived."""
    return not one.fit.joint.converged


def _followed_to_the_end(trial: Trial, scores: Mapping[str, CauseScore], seed: int, one: Trial) -> Trial:
    """A refit of a model after as many steps as it needs, freed of videos that hold it back, and begun elsewhere."""
    return one.continued().freed(trial, seed=seed).begun_elsewhere(trial, scores[one.causes[-1].name])
