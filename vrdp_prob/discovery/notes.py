"""What is said beside the causes that are found: what limits a finding, and what was not asked."""

from collections.abc import Sequence

import numpy as np

from vrdp_prob.datasets.folder import some
from vrdp_prob.discovery.finding import Verdict
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.outcome import Outcome
from vrdp_prob.discovery.selection.doubts import details_left, rivals_outside
from vrdp_prob.discovery.selection.estimates import mass_scale_notes
from vrdp_prob.discovery.selection.mimics import Unlisted
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.words import title
from vrdp_prob.inference.assembly import limits_of_tracks
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.plain_words import counted, listed
from vrdp_prob.scene import Shape, Tracks

TELLING = 2.0
"""Overdispersion of a video that is told of."""


def notes_of_search(found: Search, outcome: Outcome, told: Sequence[Effect]) -> list[str]:
    """What a search says beside its causes, in sentences.

    Parameters
    ----------
    found
        The search.
    outcome
        What is believed of it.
    told
        The effects of the causes that are told of.
    """
    doubtful = outcome.verdict is Verdict.UNKNOWN
    notes = []
    if doubtful and outcome.causes:
        notes.append(
            "Something outside the catalogue is, or may be, at work. Causes may only follow it, as likely as not, "
            "which their probabilities count."
        )
    notes += [_unlisted_note(one) for one in outcome.unlisted]
    notes += not_explained(found.best.fit.fits)
    if not found.best.fit.joint.converged:
        notes.append(
            "The joint fit ended before it had converged: some video is at the edge between two courses of events."
        )
    notes += outcome.reasons
    largest = found.best.unexplained.accelerated
    if largest:
        sizes = [f"{one.size:.2g}" for one in sorted(largest, key=lambda one: one.size)]
        duration = float(np.median([one.duration for one in largest]))
        notes.append(
            f"Something that no cause explains accelerates the bodies in {len(largest)} of the "
            f"{len(found.best.fit.videos)} videos at random, by {' to '.join(dict.fromkeys((sizes[0], sizes[-1])))} "
            f"m/s² for about {duration:.1g} s at a time. A cause has to explain more than such chance does, and "
            "intervals allow for it."
        )
    worst = int(np.argmax(found.overdispersion))
    if found.overdispersion[worst] > TELLING:
        notes.append(
            "More than noise is left unexplained: its sums over neighbouring frames are "
            f"{np.sqrt(found.overdispersion[worst]):.2g} times as large as noise would leave them in video "
            f"{found.base.fit.videos[worst]}. Gains are divided by the squares of such factors, and intervals "
            "are that much wider."
        )
    if doubtful:
        notes.append(
            "How strong other causes can be at most is not told: what no cause explains may be hiding any of them."
        )
    return [
        *notes,
        *([found.limit] if found.limit else []),
        *details_left(found.best.causes, found.refits.leavings.checks_of_trusted(found.best)),
        *rivals_outside((cause.effect for cause in outcome.causes if cause.named), outcome.checks),
        *mass_scale_notes(told, found.base.fit.tracks),
    ]


def not_explained(fits: Sequence[MapFit]) -> list[str]:
    """What is said of videos whose residuals are far larger than noise."""
    lost = sorted((fit for fit in fits if fit.misfit.large), key=lambda fit: -fit.misfit.ratio)
    if not lost:
        return []
    worst, name = lost[0].misfit, lost[0].clues.tracks.video
    videos, where = (
        (name, "") if len(lost) == 1 else (f"{len(lost)} of the {len(fits)} videos", f" in {name}, the worst")
    )
    return [
        f"What is seen in {videos} is not explained: after the best fit positions are off by {worst.residual_sd:.2g} m"
        f"{where}, {worst.ratio:.3g} times the noise. What happened there may not have been found, or something acts "
        "that no cause says."
    ]


def _unlisted_note(unlisted: Unlisted) -> str:
    rest = ""
    if unlisted.mimics:
        than = listed(f"'{title(name)}'" for name in unlisted.mimics)
        rest = f"; {than} may only follow it, and {'are' if len(unlisted.mimics) > 1 else 'is'} not named"
    laws = listed(f"{law.sentence[0].lower()}{law.sentence[1:].rstrip('.')}" for law in unlisted.laws)
    better = "better" if unlisted.gain > WITHIN_95 * unlisted.error else "at least as well, as far as they can tell,"
    size = f"{unlisted.gain:.0f} ± {unlisted.error:.0f} nats"
    size += "" if unlisted.asked is None else f" in all, by {unlisted.asked} of them"
    return f"A model in which {laws} predicts left-out videos {better} ({size}){rest}."


def limits(videos: Sequence[Tracks]) -> list[str]:
    """What limits any result from these tracks: of each kind of limit what is said of the first video that has it."""
    told: dict[str, list[tuple[str, str]]] = {}
    for tracks in videos:
        for kind, sentence in limits_of_tracks(tracks).items():
            told.setdefault(kind, []).append((tracks.video, sentence))
    sentences = []
    for alike in told.values():
        video, sentence = alike[0]
        if len({one for _, one in alike}) > 1 or len(alike) < len(videos):
            others = f" (and {counted(len(alike) - 1, 'other video')} alike)" if len(alike) > 1 else ""
            sentence = f"{video}{others}: {sentence}"
        sentences.append(sentence)
    return sentences


def not_asked(videos: Sequence[Tracks]) -> list[str]:
    """What is asked of no video because some do not tell it, in sentences."""
    notes = []
    untold = [
        tracks.video
        for tracks in videos
        if not tracks.turning_told and any(body.shape is not Shape.SPHERE for body in tracks.bodies)
    ]
    if untold and any(tracks.turning_told for tracks in videos):
        notes.append(
            f"Whether the motion depends on spin is not asked, since {some(untold)} "
            f"{'does' if len(untold) == 1 else 'do'} not tell the angles of all bodies that can turn; the other videos "
            "alone would allow it."
        )
    weighed = [body.mass is not None for tracks in videos for body in tracks.bodies]
    if any(weighed) and not all(weighed):
        notes.append(
            "Whether accelerations depend on mass is not asked, since the masses of some bodies only are stated."
        )
    return notes
