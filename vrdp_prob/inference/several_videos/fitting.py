"""The joint fit of several videos: each by itself first, then all together, then what the model leaves unexplained."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from vrdp_prob.errors import InputError
from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.map_fit import MapFit, NoWorldError
from vrdp_prob.inference.runs.journal import kept
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.misfit import judge
from vrdp_prob.inference.search.model_error_fit import TURNS, next_model_error
from vrdp_prob.inference.search.plan import IN_DOUBT, FitPlan
from vrdp_prob.inference.several_videos.agreement import following_ones
from vrdp_prob.inference.several_videos.ascent import WHOLE, Effort, climb
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError, NoCommonWorldError
from vrdp_prob.inference.several_videos.joining import CLIMBS, Climb, joined
from vrdp_prob.inference.several_videos.joint_fit import JointFit, with_alternatives
from vrdp_prob.inference.several_videos.linking import check_names, link
from vrdp_prob.inference.several_videos.parts import carried_starts, fit_alone, link_fits
from vrdp_prob.inference.several_videos.second_look import (
    look_again,
    loses_single_videos,
    lost_together,
    lost_videos,
    may_take_another_course,
)
from vrdp_prob.inference.several_videos.transfer import first_numbers
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Held, Owned, Structure, structure_of, unknowns
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks

MENDING_LOOKS, SEARCHES = 2, 3
"""Fits that are made anew of a video that may have lost its course of events in a joint fit, and how often that is done
as long as it finds more."""

NEWS = 5.0
"""Gain (nats) of other courses of events that is worth a change of all that follows from a fit."""


@dataclass(frozen=True)
class SharedFit:
    """The most probable values of several videos with shared parameters.

    Parameters
    ----------
    model
        The physics.
    joint
        The most probable values, the Gaussian around them, and the evidence.
    fits
        Each video's part of it, as a fit of its own: its best point and whether the model explains it.
    structures
        Which bodies of each video have which unknowns.
    shared
        Names of the quantities that were asked to be shared; None for all that have one value per video.
    """

    model: PhysicsModel
    joint: JointFit
    fits: tuple[MapFit, ...]
    structures: tuple[Structure, ...]
    shared: tuple[str, ...] | None

    @property
    def log_evidence(self) -> float:
        """Log probability (nats) of the tracks under the model, up to a constant of the tracks (Laplace)."""
        return self.joint.log_evidence

    @property
    def videos(self) -> tuple[str, ...]:
        """Names of the videos."""
        return tuple(video.name for video in self.joint.videos)

    @property
    def tracks(self) -> tuple[Tracks, ...]:
        """What was seen in each video."""
        return tuple(part.likelihood.tracks for part in self.fits)

    def extended(self, *effects: Effect) -> PhysicsModel:
        """Its model with further causes, whose places and times are expected where these videos show something."""
        model = self.model
        for effect in effects:
            model = model.with_effect(effect, self.tracks)
        return model

    def value(self, name: str) -> float | None:
        """Most probable value of a number that all videos share, in its unit; None where they share no such number."""
        place = next((k for k, key in enumerate(self.joint.numbers.keys) if key == (name, ())), None)
        if place is None:
            return None
        mean = float(self.joint.gaussian.mean[place])
        return math.exp(mean) if self.joint.numbers.logarithms[place] else mean

    def of_tracks(self, videos: Sequence[Tracks]) -> "SharedFit":
        """The same fit for `under` to go on from, where a model has as causes what its own tracks state.

        Parameters
        ----------
        videos
            The same videos in the same order, of which less is stated (fewer walls).
        """
        fits = [replace(part, clues=Clues.of(tracks)) for part, tracks in zip(self.fits, videos, strict=True)]
        return replace(self, fits=tuple(fits))

    def of_some(self, chosen: Sequence[int]) -> "SharedFit":
        """The fit of some of its videos, from where all have brought them.

        Parameters
        ----------
        chosen
            Numbers of the videos.
        """
        return self.part(chosen).under(self.model, model_error=False)

    def part(self, chosen: Sequence[int]) -> "SharedFit":
        """Some of its videos as they are in it, with what all say of the numbers that they share.

        Parameters
        ----------
        chosen
            Numbers of the videos.

        Returns
        -------
        No maximum by itself, whose log density is NaN.
        """
        gaussian = replace(self.joint.gaussian, locals=tuple(self.joint.gaussian.locals[index] for index in chosen))
        videos = tuple(self.joint.videos[index] for index in chosen)
        joint = replace(self.joint, videos=videos, gaussian=gaussian, log_density=math.nan, alternatives=())
        fits = tuple(self.fits[index] for index in chosen)
        structures = tuple(self.structures[index] for index in chosen)
        return replace(self, joint=joint, fits=fits, structures=structures)

    @kept
    def under(
        self,
        model: PhysicsModel,
        *,
        start: Mapping[str, float] | None = None,
        own: Sequence[Mapping[Owned, float]] | None = None,
        held: Sequence[Held] | None = None,
        least: float | None = None,
        effort: Effort = WHOLE,
        model_error: bool = True,
    ) -> "SharedFit":
        """The fit of another model, from the values of this one; much faster than a new one.

        Parameters
        ----------
        model
            The other model.
        start
            Where its shared parameters begin, by name and in their units; else where they are now, and new ones at the
            value at which their effect vanishes (or at the middle of their prior where that is infinitely far).
        own
            Where further numbers of each video begin, by name and owner and in their units.
        held
            Numbers of each video that are not unknown though the model has them; those that are none now where None.
        least
            Log posterior that must be reached at the start, where the videos' own numbers alone have followed.
        effort
            How long the common climb of all videos goes on.
        model_error
            Whether what the model leaves unexplained is looked for.

        Raises
        ------
        ImpossibleStartError
            If a video has no world at the start, or less than that is reached.
        """
        joint = self.joint
        structures = self.structures
        if held is not None:
            structures = tuple(replace(one, held=mine) for one, mine in zip(structures, held, strict=True))
        numbers, videos = link_fits(self.fits, model, self.shared, structures)
        shared, towards = first_numbers(joint, numbers, self.vanishing(model.effects), start or {})
        locals_ = [
            video.split(old.likelihood.coordinates.carried(joint.point(index), video.likelihood.coordinates))[1]
            for index, (old, video) in enumerate(zip(joint.videos, videos, strict=True))
        ]
        for video, mine, values in zip(videos, locals_, own or [{}] * len(videos), strict=True):
            entries = video.likelihood.coordinates.entries
            for number, place in enumerate(video.local_places):
                entry = entries[place]
                if (entry.field, entry.owner) in values:
                    mine[number] = entry.transform.to_coordinate(values[entry.field, entry.owner])
        found = climb(numbers, videos, shared, locals_, towards=towards, least=least, effort=effort)
        return _finished(found, model, self.fits, structures, self.shared, model_error=model_error)

    def mended(self, lost: Sequence[int], *, seed: int, thorough: bool = False, yielding: bool = False) -> "SharedFit":
        """The fit with a new search for what happened in some videos, given what the others say; the better of both.

        Numbers of a video that are held are held in its search, too.

        Parameters
        ----------
        lost
            Videos that may have lost their course of events.
        seed
            Seed of the searches.
        thorough
            Whether a search goes on where it explains a video as well as others are explained.
        yielding
            Whether what is found given what the others say is taken where it explains a video only about as well: it
            may be explained as well on a course of events that holds the others back.
        """
        joint = self.joint
        others = [index for index in range(len(self.fits)) if index not in lost]
        if not lost or not others:
            return self
        rest = climb(
            joint.numbers,
            [joint.videos[index] for index in others],
            joint.gaussian.mean,
            [joint.gaussian.locals[index].centre for index in others],
        )
        settled = [
            replace(fit, modes=(replace(fit.modes[0], point=joint.point(index)),))
            for index, fit in enumerate(self.fits)
        ]
        for place, index in enumerate(others):
            fit, point = self.fits[index], rest.point(place)
            misfit = judge(rest.videos[place].likelihood, point, fit.clues)
            settled[index] = replace(fit, modes=(replace(fit.modes[0], point=point),), misfit=misfit)
        fits = look_again(
            settled,
            lost,
            self.model,
            self.shared,
            seed=seed,
            looks=MENDING_LOOKS,
            asked=others,
            thorough=thorough,
            held=[structure.held for structure in self.structures],
            yielding=yielding,
        )
        changed = [index for index in lost if fits[index] is not settled[index]]
        if not changed:
            return self
        structures = list(self.structures)
        for index in changed:
            structures[index] = structure_of(fits[index].likelihood.coordinates, self.structures[index].held)
        return self._with_fits(fits, structures, rest)

    def with_courses_of(self, other: "SharedFit", chosen: Sequence[int]) -> "SharedFit":
        """The fit with what happens in some videos in another fit of them; itself where that is less probable.

        Parameters
        ----------
        other
            A fit of the same videos under a model with the same effects.
        chosen
            The videos.
        """
        fits, structures = list(self.fits), list(self.structures)
        for index in chosen:
            fits[index], structures[index] = other.fits[index], other.structures[index]
        return self._with_fits(fits, structures, self.joint)

    def _with_fits(self, fits: Sequence[MapFit], structures: Sequence[Structure], agreed: JointFit) -> "SharedFit":
        """The fit that is reached from others of single videos, and shared numbers; itself where that is worse."""
        numbers, videos = link_fits(fits, self.model, self.shared, structures)
        shared, _ = first_numbers(agreed, numbers, {}, {})
        locals_ = following_ones(numbers, videos, carried_starts(fits, videos), shared)
        try:
            found = climb(numbers, videos, shared, locals_)
        except ImpossibleStartError:  # a video has no world where the others agree
            return self
        if found.log_density < self.joint.log_density:
            return self
        return _finished(found, self.model, fits, tuple(structures), self.shared, model_error=False)

    def with_lost_courses(self, *, seed: int) -> "SharedFit":
        """The fit with its lost videos searched anew, as long as that finds more and loses no other one.

        Single lost videos of a model that explains the others are searched several times: it is their course that they
        lack.
        """
        found = self
        for search in range(SEARCHES):
            before = found
            for group in lost_together(found.fits):
                better = found.mended(group, seed=seed + search, thorough=True)
                if better is not found and set(lost_videos(better.fits)) <= set(lost_videos(found.fits)):
                    found = better
                    break
            if found is before and not loses_single_videos(found.fits):
                break
        return found

    def with_other_courses(self, *, seed: int, among: Collection[int] | None = None) -> "SharedFit":
        """The fit with videos searched anew, one half given what the other says; itself where little is gained.

        A single video on a wrong course of events, whose residuals look like noise still, can call for causes.

        Parameters
        ----------
        seed
            Seed of the searches.
        among
            The videos; all where None.
        """
        possible = [index for index, fit in enumerate(self.fits) if may_take_another_course(fit)]
        chosen = possible if among is None else [index for index in possible if index in among]
        found = self
        for half in (0, 1):
            found = found.mended([index for index in chosen if index % 2 == half], seed=seed, thorough=True)
        return found if found.joint.log_density > self.joint.log_density + NEWS else self

    def vanishing(self, effects: Sequence[Effect]) -> dict[str, float]:
        """Values of parameters at which nothing is left of some effects, given what this fit has found."""
        likes = [pair for effect in effects for pair in effect.vanishes_like.items()]
        alike = {name: value for name, other in likes if (value := self.value(other)) is not None}
        return {name: value for effect in effects for name, value in effect.vanishes_at.items()} | alike


def fit_together(
    videos: Sequence[Tracks],
    *,
    model: PhysicsModel,
    shared: Sequence[str] | None = None,
    seed: int = 0,
    model_error: bool = True,
    plan: FitPlan | None = None,
    progress: ProgressDisplay | None = None,
) -> SharedFit:
    """Find the most probable values of several videos at once.

    Parameters
    ----------
    videos
        What was seen.
    model
        The physics.
    shared
        Names of the quantities with one value for all videos; where None all that have one value per video (the
        model's shared parameters and the noise), and the restitutions of walls at the same place.
    seed
        Seed of the searches; a video is searched alike whatever the others are.
    model_error
        Whether what the model leaves unexplained in a video is looked for, and widens its part of the density.
    plan
        Stages in which each video is fitted by itself, and the optimiser that climbs for each and for all together;
        `FitPlan()` where None, with one attempt for each video and no search for yaws without a model error. What
        is made of the fit, as by `under` and `mended`, is made by Gauss-Newton. Second looks at single videos have
        stages of their own, and take its optimiser.
    progress
        Told how many videos are done.

    Raises
    ------
    InputError
        If there is no video, two have one name, a name is none that videos can share, or a video shows no motion.
    NoCommonWorldError
        If some video has no world at what the videos' own fits agree on; that is an `InputError`, too.
    """
    check_videos(videos)
    if shared is not None:
        check_names(shared, model)
    if plan is None:
        plan = FitPlan() if model_error else IN_DOUBT
    display = progress or SilentProgress()
    with display.stage("Fitting each video (MAP)", total=len(videos)) as advance:
        fitted = partial(fit_alone, model=model, seed=seed, plan=plan, model_error=model_error)
        try:
            alone = in_processes(fitted, videos, advance=advance)
        except NoWorldError as error:
            raise NoCommonWorldError(str(error)) from error
    with display.stage("Fitting all videos together"):
        try:
            fits, joint = joined(alone, model, shared, seed=seed, plan=plan)
        except ImpossibleStartError as error:
            raise NoCommonWorldError(
                f"the videos have no common world: {str(error) or 'one of them'} cannot be simulated with what all say "
                "of the numbers that they share; leave it out, or share less."
            ) from error
    structures = tuple(structure_of(one.likelihood.coordinates) for one in fits)
    names = None if shared is None else tuple(shared)
    climbing = CLIMBS[plan.optimiser]
    with display.stage("Allowing for what the model leaves"):
        found = _finished(joint, model, fits, structures, names, model_error=model_error, climbing=climbing)
        return replace(found, joint=_with_modes(found.joint, fits))


def _with_modes(joint: JointFit, fits: Sequence[MapFit]) -> JointFit:
    """The joint fit with the further modes that the videos' own fits found."""
    if all(len(fit.modes) == 1 for fit in fits):
        return joint
    return with_alternatives(joint, carried_starts(fits, joint.videos))


def check_videos(videos: Sequence[Tracks]) -> None:
    """Refuse what are no tracks, no videos at all, and two of one name.

    Raises
    ------
    InputError
        In these cases.
    """
    if isinstance(videos, Tracks | str | Path) or not all(isinstance(one, Tracks) for one in videos):
        raise InputError("videos are no list of tracks; give those of several videos, which vrdp_prob.load_all reads.")
    if not videos:
        raise InputError("there are 0 videos; give tracks of at least one.")
    names = [tracks.video for tracks in videos]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{names.count(twice[0])} videos have the name '{twice[0]}'; name them apart.")


def _finished(
    joint: JointFit,
    model: PhysicsModel,
    fits: Sequence[MapFit],
    structures: tuple[Structure, ...],
    shared: tuple[str, ...] | None,
    *,
    model_error: bool,
    climbing: Climb = climb,
) -> SharedFit:
    """The joint fit with what the model leaves unexplained, and each video's part of it."""
    misfits = [
        judge(video.likelihood, joint.point(index), fits[index].clues) for index, video in enumerate(joint.videos)
    ]
    for _ in range(TURNS if model_error else 0):
        errors = [
            next_model_error(
                video.believing(joint.gaussian.mean, joint.gaussian.sd),
                joint.point(index),
                fits[index].clues,
                misfits[index],
            )
            for index, video in enumerate(joint.videos)
        ]
        if all(error is video.likelihood.model_error for error, video in zip(errors, joint.videos, strict=True)):
            break
        likelihoods = []
        for index, (video, structure, error) in enumerate(zip(joint.videos, structures, errors, strict=True)):
            if error is None:
                likelihoods.append(video.likelihood)
                continue
            tracks, reference = video.likelihood.tracks, video.likelihood.observations.position_reference
            coordinates = unknowns(tracks, model, structure, model_error=error)
            likelihoods.append(Likelihood(tracks, model, coordinates, model_error=error))
            misfits[index] = misfits[index].with_error(error, reference)
        joint = _again(joint, likelihoods, shared, climbing)
    parts = tuple(
        replace(
            fit,
            likelihood=video.likelihood,
            modes=(_mode(joint, index),),
            converged=joint.converged,
            misfit=misfit,
        )
        for index, (fit, video, misfit) in enumerate(zip(fits, joint.videos, misfits, strict=True))
    )
    return SharedFit(model, joint, parts, structures, shared)


def _again(
    joint: JointFit, likelihoods: Sequence[Likelihood], shared: tuple[str, ...] | None, climbing: Climb
) -> JointFit:
    """Climb with other densities from where a fit is."""
    numbers, videos = link(likelihoods, shared)
    known = dict(zip(joint.numbers.keys, joint.gaussian.mean, strict=True))
    start = np.array([known[key] for key in numbers.keys])
    locals_ = [
        video.split(old.likelihood.coordinates.carried(joint.point(index), video.likelihood.coordinates))[1]
        for index, (old, video) in enumerate(zip(joint.videos, videos, strict=True))
    ]
    return climbing(numbers, videos, start, locals_)


def _mode(joint: JointFit, index: int) -> Mode:
    """A video's part of the fit, with the precision that its numbers have by themselves and all videos together."""
    video, point = joint.videos[index], joint.point(index)
    return Mode(point, joint.precision(index), video.value(joint.gaussian.mean, joint.gaussian.locals[index].centre))
