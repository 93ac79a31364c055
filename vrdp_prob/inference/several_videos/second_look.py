"""Videos whose own fit is worse than those of the others are fitted anew, with what the others say of shared numbers.

What makes a fit miss the order of events in one video is often a friction that bends to the motion of one body; where
the other videos hold it, the search finds its way.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool

from vrdp_prob.inference.map_fit import MapFit, NoWorldError, fit_map
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.plan import IN_DOUBT, TURNING, FitPlan, Optimiser
from vrdp_prob.inference.several_videos.agreement import consensus
from vrdp_prob.inference.several_videos.beliefs import believing
from vrdp_prob.inference.several_videos.parts import carried_starts, link_fits, plain_likelihood, stream
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Held, Structure, structure_of

WORSE = 1.08
"""Residuals that are larger than those of the video in the middle by this factor call for another look..."""
FAR_WORSE = 1.5
"""...and by this one the video is not asked for the shared numbers."""
LOOKS = 4
"""Fits that are made anew of one video, with and without what the others say by turns..."""
EXPLAINED = 1.2
"""...and one more, with the yaws of its cubes turned, if the video in the middle leaves no more than so many noise
sd."""
LOST = 1.2
"""Residuals in units of the noise from which a video may have lost its course of events."""
SHARE_ASTRAY = 0.5
"""Share of the videos, at most, that may be on wrong courses and are looked at again; where more are, the model lacks
something."""
SHARE_LOST = 0.25
"""Share of the videos, at most, that have lost their courses by themselves; where more have, a cause is missing."""
SAME = 0.01
"""Fits whose residuals differ by a smaller share are taken for the same one, and unless they are far worse than those
of other videos no further one is looked for in the same way: with what the others say, or without, since what they say
may be wrong where cubes whose yaws nobody measured are on wrong islands."""
LESS_PROBABLE = 20.0
"""Nats by which a fit may be less probable than the one it replaces: residuals of a video that has gone astray
altogether count as outliers, and what is left looks small."""
WIDER, LEAST_SD = 2.0, 0.02
"""What the others say is believed with so many times its standard deviation, and at least with this one."""


def most_astray(videos: int) -> int:
    """Most of so many videos that may be on wrong courses without the model being to blame."""
    return int(SHARE_ASTRAY * videos)


def most_lost(videos: int) -> int:
    """Most of so many videos that may have lost their courses by themselves."""
    return max(int(SHARE_LOST * videos), 1)


def trusted(fits: Sequence[MapFit]) -> Bool[np.ndarray, "video"]:
    """Whose fits are not far worse than those of the others."""
    return _excess(fits) < FAR_WORSE


def doubtful(fits: Sequence[MapFit], among: Collection[int] | None = None) -> list[int]:
    """Videos that are fitted worse than the others, the worst first.

    Parameters
    ----------
    fits
        The fits, each by itself.
    among
        Videos that may be; all where None.
    """
    excess = _excess(fits)
    possible = range(len(fits)) if among is None else among
    found = [
        int(index)
        for index in np.argsort(-excess, kind="stable")
        if excess[index] > WORSE and index in possible and may_take_another_course(fits[index])
    ]
    return found[: most_astray(len(fits))]


def explained(fits: Sequence[MapFit], within: float = EXPLAINED) -> bool:
    """Whether a model explains most videos within so many noise sd, so that a wrong yaw takes the place of nothing."""
    return float(np.median([one.misfit.ratio for one in fits])) < within


def lost_videos(fits: Sequence[MapFit]) -> list[int]:
    """Videos that may have taken the wrong course of events, the worst first."""
    order = sorted(range(len(fits)), key=lambda index: -fits[index].misfit.ratio)
    return [index for index in order if fits[index].misfit.ratio > LOST and may_take_another_course(fits[index])]


def loses_single_videos(fits: Sequence[MapFit]) -> bool:
    """Whether a model explains most videos and loses few, which rather lack their course of events than a cause."""
    return explained(fits) and 0 < len(lost_videos(fits)) <= most_lost(len(fits))


def outweigh(fits: Sequence[MapFit], some: Collection[int]) -> bool:
    """Whether some videos leave more beyond the noise than all others together, in squares of their residuals."""
    beyond = np.array([one.clues.tracks.seen.sum() * (one.misfit.ratio**2 - 1.0) for one in fits])
    among = np.isin(np.arange(len(fits)), list(some))
    return bool(beyond[among].sum() > beyond[~among].sum())


def lost_together(fits: Sequence[MapFit]) -> list[list[int]]:
    """Lost videos in groups that are searched one after the other, each of half of all videos at most.

    Those far worse than the others come first and alone: they mislead the fit of these.
    """
    lost, as_good = lost_videos(fits), trusted(fits)
    groups = [[index for index in lost if not as_good[index]], [index for index in lost if as_good[index]]]
    return [group[: most_astray(len(fits))] for group in groups if group]


def may_take_another_course(fit: MapFit) -> bool:
    """Whether something else may happen in a video: one body without walls that does not stop has but one course."""
    tracks = fit.clues.tracks
    return len(tracks.bodies) > 1 or bool(tracks.walls) or len(fit.rollout.events) > 0


def look_again(
    fits: Sequence[MapFit],
    chosen: Sequence[int],
    model: PhysicsModel,
    shared: Sequence[str] | None,
    *,
    seed: int,
    looks: int = LOOKS,
    islands: bool = False,
    asked: Collection[int] | None = None,
    thorough: bool = False,
    optimiser: Optimiser = Optimiser.GAUSS_NEWTON,
    held: Sequence[Held] | None = None,
    yielding: bool = False,
) -> list[MapFit]:
    """The fits of single videos, with some of them searched anew, and improved where that is better.

    Parameters
    ----------
    fits
        The fits, each by itself.
    chosen
        Videos that are looked at again.
    model
        The physics.
    shared
        Names of the quantities that are shared; all that have one value per video where None.
    seed
        Seed of the searches.
    looks
        Fits that are made anew of one video, at most.
    islands
        See `consensus`.
    asked
        Videos that say something of the shared parameters, as far as they are trusted; all where None.
    thorough
        Whether the looks go on where a fit is as good as those of other videos.
    optimiser
        What refines starts.
    held
        Numbers of each video's own that are not unknown though the model has them; none where None.
    yielding
        Whether looks are only made with what the others say, and a fit is taken that explains the video about as well.
    """
    if not chosen:
        return list(fits)
    excess = _excess(fits)
    goal = 0.0 if thorough else WORSE * float(np.median([one.misfit.residual_sd for one in fits]))
    ways = [(yielding or look % 2 == 0, IN_DOUBT) for look in range(looks)]
    if explained(fits):
        ways.append((True, TURNING))
    ways = [(believing, replace(plan, optimiser=optimiser)) for believing, plan in ways]
    among = range(len(fits)) if asked is None else asked
    structures = [
        structure_of(fit.likelihood.coordinates, known)
        for fit, known in zip(fits, held or [{}] * len(fits), strict=True)
    ]
    told = _told(fits, structures, model, shared, among, islands=islands)
    look = _Look(model, told, goal, seed, tuple(ways), yielding=yielding)
    doubted = [
        _Doubted(
            fits[index],
            far_worse=bool(excess[index] >= FAR_WORSE),
            turned_on=thorough and fits[index].misfit.ratio > LOST,
            held=structures[index].held,
        )
        for index in chosen
    ]
    better = look.looked(doubted, at_once=True) if thorough else in_processes(look, doubted)
    improved = dict(zip(chosen, better, strict=True))
    return [improved.get(index) or fit for index, fit in enumerate(fits)]


@dataclass(frozen=True)
class _Doubted:
    """A video that is looked at again.

    Parameters
    ----------
    fit
        Its fit.
    far_worse
        Whether that is far worse than those of other videos.
    turned_on
        Whether its cubes are turned on where it is explained: a video that was lost may be so by a wrong yaw still.
    held
        Which of its numbers are held.
    """

    fit: MapFit
    far_worse: bool
    turned_on: bool
    held: Held


@dataclass(frozen=True)
class _Look:
    """Searches for a better fit of a video.

    Parameters
    ----------
    model
        The physics.
    told
        The same with what other videos say as its prior.
    goal
        Residuals in units of the noise that are good enough.
    seed
        Seed of the searches.
    ways
        Whether each of them believes what other videos say, and how it is made.
    yielding
        Whether a fit is taken that explains the video about as well.
    """

    model: PhysicsModel
    told: PhysicsModel
    goal: float
    seed: int
    ways: tuple[tuple[bool, FitPlan], ...]
    yielding: bool = False

    def __call__(self, doubted: _Doubted) -> MapFit | None:
        """A better fit, if there is one, by one look after the other."""
        (found,) = self.looked([doubted], at_once=False)
        return found

    def looked(self, doubted: Sequence[_Doubted], *, at_once: bool) -> list[MapFit | None]:
        """Better fits of videos, where there are any.

        Parameters
        ----------
        doubted
            The videos.
        at_once
            Whether the looks that are sure to be made are made side by side: the first ones in each way, then the
            second ones. What comes out is the same.
        """
        videos = [_Looked(one, one.fit) for one in doubted]
        while asked := [(one, look) for one in videos for look in self._next(one, at_once=at_once)]:
            fits = in_processes(self._made, [(one.doubted, look) for one, look in asked])
            for (one, look), fit in zip(asked, fits, strict=True):
                one.made[look] = fit
            for one in videos:
                self._take(one)
        return [one.better for one in videos]

    def _next(self, one: "_Looked", *, at_once: bool) -> list[int]:
        """Looks at a video that are to be made now."""
        first: dict[tuple[bool, FitPlan], int] = {}
        for look in range(one.taken, len(self.ways)):
            if self.ways[look] not in one.settled:
                first.setdefault(self.ways[look], look)
        looks = [look for look in first.values() if look not in one.made]
        return looks if at_once else looks[:1]

    def _made(self, asked: tuple[_Doubted, int]) -> MapFit | None:
        doubted, look = asked
        believing, plan = self.ways[look]
        if plan.yaws and doubted.turned_on:
            plan = replace(plan, like_noise=0.0)
        tracks = doubted.fit.clues.tracks
        generator = stream(self.seed, f"{tracks.video} {look}")
        model = self.told if believing else self.model
        try:
            return fit_map(tracks, model, generator, plan=plan, model_error=False, held=doubted.held)
        except NoWorldError:  # the others say what this video cannot be
            return None

    def _take(self, one: "_Looked") -> None:
        """Take what was made of a video, in the order of the looks, as far as that is known."""
        while one.taken < len(self.ways):
            way = self.ways[one.taken]
            if way not in one.settled:
                if one.taken not in one.made:
                    return
                self._judge(one, way, one.made.pop(one.taken))
            one.taken = len(self.ways) if one.best.misfit.residual_sd < self.goal else one.taken + 1

    def _judge(self, one: "_Looked", way: tuple[bool, FitPlan], found: MapFit | None) -> None:
        if found is None:
            one.settled.add(way)
            return
        gained = one.best.misfit.residual_sd / found.misfit.residual_sd - 1
        better_from = -SAME if self.yielding else SAME
        if gained > better_from and found.log_density > one.best.log_density - LESS_PROBABLE:
            structure = structure_of(found.likelihood.coordinates, one.doubted.held)
            likelihood = plain_likelihood(found.clues, self.model, structure)
            one.best = one.better = replace(found, likelihood=likelihood)
        if abs(gained) < SAME and not one.doubted.far_worse:
            one.settled.add(way)


@dataclass
class _Looked:
    """How far a video was looked at.

    Parameters
    ----------
    doubted
        The video.
    best
        Its best fit so far.
    better
        The same if it is another one than before.
    taken
        Number of looks that are done with.
    made
        Fits of looks that come after these; None where there is no world.
    settled
        Ways in which no further look is made.
    """

    doubted: _Doubted
    best: MapFit
    better: MapFit | None = None
    taken: int = 0
    made: dict[int, MapFit | None] = field(default_factory=dict)
    settled: set[tuple[bool, FitPlan]] = field(default_factory=set)


def _excess(fits: Sequence[MapFit]) -> np.ndarray:
    """Residuals of each video over those of the one in the middle, both in units of the noise."""
    ratios = np.array([fit.misfit.ratio for fit in fits])
    return ratios / np.median(ratios)


def _told(
    fits: Sequence[MapFit],
    structures: Sequence[Structure],
    model: PhysicsModel,
    shared: Sequence[str] | None,
    asked: Collection[int],
    *,
    islands: bool,
) -> PhysicsModel:
    """The model with what those videos that are asked, and trusted, say of what all share as its prior.

    Where none of them is trusted it stays as it is.
    """
    numbers, videos = link_fits(fits, model, shared, structures)
    points = [starts[0] for starts in carried_starts(fits, videos)]
    believed = [bool(one) and index in asked for index, one in enumerate(trusted(fits))]
    if not any(believed):
        return model
    found = consensus(numbers, videos, points, believed, islands=islands)
    return believing(model, numbers.keys, found.mean, np.maximum(WIDER * found.sd, LEAST_SD))
