"""The search for what a model lacks."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vrdp_prob.discovery.checking import FEWEST_VIDEOS, check_searched, check_video_count
from vrdp_prob.discovery.describe import describe
from vrdp_prob.discovery.finding import Finding, FoundCause, UpperBound, Verdict
from vrdp_prob.discovery.notes import limits, not_asked, notes_of_search
from vrdp_prob.discovery.outcome import noise_of
from vrdp_prob.discovery.page.figures import residual_figures
from vrdp_prob.discovery.selection.believed import extended_model, models_of_the_others
from vrdp_prob.discovery.selection.estimates import upper_bounds
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.tried import tried_causes
from vrdp_prob.discovery.stages import Stages
from vrdp_prob.errors import check_whole_number
from vrdp_prob.inference import default_model
from vrdp_prob.inference.infer import check_model
from vrdp_prob.inference.runs.checkpoint import (
    Checkpoint,
    check_importable,
    effects_facts,
    model_facts,
    program_facts,
    videos_facts,
)
from vrdp_prob.inference.runs.journal import journal
from vrdp_prob.inference.runs.parallel import linear_algebra_in_one_thread, several_processes
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.several_videos.fitting import check_videos
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.plain_words import listed
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks
from vrdp_prob.workers import check_processes

COUNTED_ANEW = (
    "The videos begin further apart than any of them is long, so times are told from the first frame of each video."
)


@linear_algebra_in_one_thread
def discover(
    videos: Sequence[Tracks],
    *,
    model: PhysicsModel | None = None,
    seed: int = 0,
    catalogue: Sequence[Effect] | None = None,
    searched: int | None = None,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
    checkpoint: Path | str | None = None,
) -> Finding:
    """Say whether a model explains some videos, and if not, which causes it lacks.

    Parameters
    ----------
    videos
        What was seen, at least three videos of one table. Those in which nothing moves are left out.
    model
        The physics that is put to the test.
    seed
        Seed of all randomness: the same seed gives the same finding.
    catalogue
        Causes that are looked for; all that the package knows and the model has not where None.
    searched
        Number of videos, spread evenly over all, in which all of these are looked for; in all where None. What is found
        in fewer, or could be seen with all, is then asked of all videos, from which everything that is told comes. A
        cause that acts in others alone is left to the checks.
    processes
        Number of processes that fit videos and try causes side by side; as many as there are cores where None.
    progress
        Told how far the work is.
    checkpoint
        Folder that keeps what is done, so that the same call after a kill goes on from there and says the same. It
        holds pickles: one that somebody else made may hold any program.

    Raises
    ------
    InputError
        If there are fewer than three videos that show motion, or are to be searched, two have one name, the model is
        none, seed or processes are no whole number of at least 0 or 1, the videos have no common world, the checkpoint
        belongs to another run, or one is asked for with an effect whose class other processes cannot import.
    """
    check_video_count(videos)
    check_searched(searched)
    check_whole_number("seed", seed, least=0)
    check_processes(processes)
    check_model(model)
    check_videos(videos)
    videos, still = _in_motion(videos)
    physics = default_model() if model is None else model
    looked_for = _catalogue(physics, catalogue)
    if checkpoint is not None:
        check_importable((*physics.effects, *looked_for))
    own = None if checkpoint is None else Checkpoint(checkpoint, _facts(videos, physics, looked_for, seed, searched))
    compile_model(physics)
    timed = videos if _reads_stamps((*physics.effects, *looked_for)) else _from_first_frames(videos)
    with several_processes(processes), journal(own):
        stages = Stages(physics, tuple(looked_for), seed, progress)
        asked = None if searched is None or searched >= len(timed) else stages.asked_of_all(timed, searched)
        outcome = stages.outcome(timed, asked)
        found, causes = outcome.found, outcome.causes
        tried = tried_causes(found, _names_of(found, causes), seed=seed)
        beside = []
        if asked is not None:
            found = found.asking(looked_for)
            with (progress or SilentProgress()).stage("Asking what is left"):
                beside = asked.sentences(found)
    doubtful, bounds = outcome.verdict is Verdict.UNKNOWN, _bounds(found, causes)
    return Finding(
        verdict=outcome.verdict,
        causes=causes,
        checks=outcome.checks,
        checks_after=outcome.after,
        upper_bounds=tuple(_without_strengths(bounds) if doubtful else bounds),
        model=physics,
        extended=extended_model(found.best, found.overdispersion),
        videos=tuple(tracks.video for tracks in videos),
        description=describe(found.best.fit, outcome.after) if doubtful else None,
        notes=(
            *notes_of_search(found, outcome, _told(found, causes)),
            *beside,
            *limits(videos),
            *not_asked(videos),
            *([] if timed is videos else [COUNTED_ANEW]),
            *([f"Nothing moves in {listed(still)}, so nothing was asked of what is seen there."] if still else []),
        ),
        figures=residual_figures(
            found.base.fit,
            found.best.fit if found.best.causes else None,
            failing={check.name for check in (*outcome.checks, *outcome.after) if check.significant},
        ),
        fit=found.best.fit,
        left_out=models_of_the_others(found.base, found.best, found.overdispersion),
        tried=tuple(tried),
        gain=outcome.gain,
        predicted=found.base.held_out,
        noise=noise_of(found.base),
    )


def _reads_stamps(effects: Sequence[Effect]) -> bool:
    """Whether an effect of the user's own may depend on what time it is, and not on how long a video has run."""
    ours = set(known_effects().values())
    return any(type(effect) not in ours and not effect.reads_video_start for effect in effects)


def _from_first_frames(videos: Sequence[Tracks]) -> Sequence[Tracks]:
    """Videos with their times counted from their first frames, where they begin further apart than one is long.

    When something happened once in a video is believed to be while that video lasts.
    """
    starts, longest = [tracks.times[0] for tracks in videos], max(np.ptp(tracks.times) for tracks in videos)
    return videos if np.ptp(starts) <= longest else [tracks.from_first_frame() for tracks in videos]


def _in_motion(videos: Sequence[Tracks]) -> tuple[Sequence[Tracks], list[str]]:
    """The videos in which something moves, and the names of the others; all where too few are left."""
    moves = [Clues.of(tracks).show_motion for tracks in videos]
    if all(moves) or sum(moves) < FEWEST_VIDEOS:
        return videos, []
    moving = [tracks for tracks, one in zip(videos, moves, strict=True) if one]
    return moving, [tracks.video for tracks, one in zip(videos, moves, strict=True) if not one]


def _facts(
    videos: Sequence[Tracks], model: PhysicsModel, catalogue: Sequence[Effect], seed: int, searched: int | None
) -> dict[str, str]:
    """What a search depends on, in short texts by name."""
    names = ", ".join(sorted(effect.name for effect in catalogue))
    code = {**model_facts(model), **effects_facts(catalogue)}
    return {**videos_facts(videos), **code, **program_facts(seed=seed, catalogue=names, searched=searched)}


def _catalogue(model: PhysicsModel, catalogue: Sequence[Effect] | None) -> list[Effect]:
    present = {effect.name for effect in model.effects}
    known = [effect() for effect in known_effects().values()] if catalogue is None else catalogue
    return [effect for effect in known if effect.name not in present]


def _told(found: Search, causes: Sequence[FoundCause]) -> list[Effect]:
    """The effects of some causes."""
    names = {cause.name for cause in causes}
    return [effect for effect in found.refits.catalogue if effect.cause_name() in names]


def _names_of(found: Search, causes: Sequence[FoundCause]) -> set[str]:
    """Names of the effects as which some causes act, all ways of a cause, and no second thing of one that is told."""
    further = {effect.name for effect in found.refits.catalogue if effect.follows is not None}
    ways = {effect.name for effect in _told(found, causes)} - further
    return ways | {cause.effect for cause in causes}


def _bounds(found: Search, told: Sequence[FoundCause]) -> list[UpperBound]:
    """Bounds of the causes that are not told of, which have estimates instead."""
    estimated = {cause.name for cause in told}
    scores = {score.effect.name: score for score in found.left.beside_chance}
    left = sorted(found.refits.catalogue, key=lambda effect: effect.name not in scores)
    catalogue = {effect.name for effect in left}
    widening, videos = float(np.sqrt(found.overdispersion.mean())), found.base.fit.tracks
    return [
        bound
        for effect in left
        if effect.cause_name() not in estimated and effect.follows not in catalogue
        for bound in upper_bounds(effect, scores.get(effect.name), widening=widening, videos=videos)
    ]


def _without_strengths(bounds: Sequence[UpperBound]) -> list[UpperBound]:
    """Bounds where something is left that may be hiding any strength; what paths leave no room for they leave none."""
    return [one if one.measure is not None else replace(one, bound=None) for one in bounds]
