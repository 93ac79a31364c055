"""Fits from the beginning at the times at which frames were taken, where tracks show that frames are missing."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vrdp_prob.discovery.candidates.dropped_frames import SIGNIFICANT, Dropped, choices
from vrdp_prob.discovery.checks.clock import LateFrames
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.trials import FIRST, Trial
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.models.effects.dropped_frames import DROPPED_AFTER, FRAME_TIME, MOST_DROPPED, DroppedFrames
from vrdp_prob.models.unknowns import Held

ROUNDS = 12
"""How often a fit is asked for a further dropped frame of each video."""
LEAST = 0.2
"""Share of the time between two stamps by which a video must be late for a further frame to be tried: what other
unknowns take up of it is much, as long as a frame is missing."""


def fit_with_dropped_frames(trial: Trial, dropped: Sequence[Dropped], *, seed: int) -> SharedFit:
    """Fit a model with the frames that tracks show to be missing, and those that it shows itself by then.

    Parameters
    ----------
    trial
        The model without them.
    dropped
        The frames that each video lacks.
    seed
        Of the searches.

    Raises
    ------
    ImpossibleStartError
        If videos have no world in common.
    """
    tracks = trial.fit.tracks
    first = trial.with_stated_population(trial.fit.model)
    told = [one.restamped(video) for one, video in zip(dropped, tracks, strict=True)]
    fit = fit_together(told, model=first, shared=trial.fit.shared, seed=seed, model_error=False)
    start = {FRAME_TIME.name: float(np.median([one.frame_time for one in dropped]))}
    known = list(dropped)
    found = fit.of_tracks(tracks).under(
        first.with_effect(DroppedFrames(), tracks), start=start, held=_held(fit, known), effort=FIRST, model_error=False
    )
    for _ in range(ROUNDS):
        further = _further(found, known)
        more = _taken(found, known, further, seed=seed)
        if more is None:
            break
        found, known = more
    return found


def _taken(
    fit: SharedFit, known: Sequence[Dropped], further: Sequence[Dropped], *, seed: int
) -> tuple[SharedFit, list[Dropped]] | None:
    """The fit with further frames that are missing, in those videos that it explains better; None where it does none.

    Without the frame a video may have taken another course of events, so it is searched anew where it is no better.
    """
    changed = [k for k, (more, less) in enumerate(zip(further, known, strict=True)) if more != less]
    if not changed:
        return None
    try:
        found = fit.under(fit.model, held=_held(fit, further), effort=FIRST, model_error=False)
    except ImpossibleStartError:  # a video has no world with its further frame
        return None
    found = found.mended([k for k in changed if not _explains_better(found, fit, k)], seed=seed)
    better = [k for k in changed if _explains_better(found, fit, k)]
    if not better:
        return None
    taken = [more if k in better else less for k, (more, less) in enumerate(zip(further, known, strict=True))]
    if len(better) < len(changed):
        found = fit.with_courses_of(found, better)
    price = sum(choices(tracks, len(taken[k].after) - len(known[k].after)) for k, tracks in enumerate(fit.tracks))
    return (found, taken) if found.joint.log_density > fit.joint.log_density + price else None


def _explains_better(fit: SharedFit, other: SharedFit, video: int) -> bool:
    return fit.fits[video].misfit.ratio < other.fits[video].misfit.ratio


def _held(fit: SharedFit, dropped: Sequence[Dropped]) -> list[Held]:
    """What is known of each video, with the frames that it lacks."""
    return [
        {**structure.held, **{(one.name, None): time for one, time in zip(DROPPED_AFTER, mine.after, strict=False)}}
        for structure, mine in zip(fit.structures, dropped, strict=True)
    ]


def _further(fit: SharedFit, dropped: Sequence[Dropped]) -> list[Dropped]:
    """The same with the frames that each video lacks where its residuals show most plainly that all later are late."""
    model = ResidualModel.of(fit)
    return [_with_plainest(model, index, known) for index, known in enumerate(dropped)]


def _with_plainest(model: ResidualModel, index: int, known: Dropped) -> Dropped:
    video = model.videos[index]
    late = LateFrames.of(model, index, np.zeros((len(video.linear.residuals), 1)), lasting=True)
    possible = np.flatnonzero((late.frames > 0) & (late.statistic > SIGNIFICANT**2))
    if not len(possible):
        return known
    best = possible[np.argmax(late.statistic[possible])]
    frames, frame = float(late.lateness[best]) / known.frame_time, int(late.frames[best])
    after = sorted((*known.after, float(video.likelihood.tracks.times[frame - 1 : frame + 1].mean())))
    return replace(known, after=tuple(after)) if frames > LEAST and len(after) <= MOST_DROPPED else known
