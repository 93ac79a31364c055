"""What is left of positions and times where the measurement is not what the model believes."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from vrdp_prob.discovery.checks.clock import LOST_FRAMES, SINGLE_FRAMES, LateFrames
from vrdp_prob.discovery.checks.measurement import MEMORY, OUTLIERS, SIZE
from vrdp_prob.discovery.checks.neighbours import FEWEST, FramesApart, apart_from_neighbours
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.page.scatter import Banded, Points, with_bands
from vrdp_prob.discovery.page.seen import REPLICAS, Figure, Seen, shortened
from vrdp_prob.report.axes import size_axis

MOST_APART = 20
"""Frames, at most, over which residuals are compared."""
LARGEST, OTHERS = 40, 40
"""Positions farthest off that are drawn, and those drawn of the rest of the farther half."""
ENDS = (0.025, 0.975)
"""Shares of what noise leaves at the ends of a grey band."""
STRETCHES = 20
"""Stretches of time, at most, of each of which the band of single frames is told."""


def _outliers(seen: Sequence[Seen]) -> str:
    """How far positions are off those before and after, against how far noise puts them."""
    found = [_quantiles(one) for one in seen]
    some = [one for one in found if one is not None]
    if not some:
        return ""
    x = size_axis(np.concatenate([one.at for one in some]).tolist())
    y = size_axis(np.concatenate([part for one in some for part in (one.value, one.low, one.high)]).tolist())
    return with_bands(
        seen,
        found,
        ("expected of the noise (noise sd)", "off neighbours (noise sd)"),
        "How far positions lie off those just before and after, the farther half in order, against how far noise puts "
        "positions of the same rank.",
        axes=(x, y),
        small=True,
    )


def _quantiles(one: Seen) -> Banded | None:
    generator = np.random.default_rng(0)
    parts = [apart_from_neighbours(video, REPLICAS, generator) for video in one.model.videos]
    apart, by_chance = (np.sort(np.concatenate(rows), axis=0) for rows in zip(*parts, strict=True))
    count = len(apart)
    if count < FEWEST:
        return None
    rest = np.linspace(count // 2, max(count - LARGEST, count // 2), OTHERS).astype(int)
    shown = np.unique([*rest, *range(max(count - LARGEST, count // 2), count)])
    low, high = np.quantile(by_chance[shown], ENDS, axis=1)
    return Banded(np.median(by_chance[shown], axis=1), apart[shown], low, high)


def _neighbours(seen: Sequence[Seen], *, memory: bool) -> str:
    """How alike, or how different, residuals of a body are some frames apart."""

    def banded(one: Seen) -> Banded | None:
        found = []
        for frames in range(1, MOST_APART + 1):
            if (apart := FramesApart.of(one.model, one.replicas, frames)) is None:
                break
            ends = (
                (-WITHIN_95 * apart.sd, WITHIN_95 * apart.sd)
                if memory
                else np.quantile(apart.drawn_differences, ENDS).tolist()
            )
            found.append((frames, apart.correlation if memory else apart.difference, *ends))
        return Banded(*np.array(found, dtype=float).T) if found else None

    words = "Correlation of residuals" if memory else "Size of differences of residuals (over the root of two)"
    return with_bands(
        seen,
        [banded(one) for one in seen],
        ("frames apart", "correlation" if memory else "size of differences (noise sd)"),
        f"{words} of the same body against the number of frames between them.",
    )


def _lost(seen: Sequence[Seen]) -> str:
    """By how much all bodies jump along their paths at each frame of the video with the clearest jump."""

    def jumps(one: Seen) -> Banded | None:
        model, best, strongest = one.flight.beside, None, 0.0
        for index, video in enumerate(model.videos):
            late = _late(one, index, lasting=True)
            if len(late.frames) and late.statistic.max() > strongest:
                strongest = float(late.statistic.max())
                against = f"time (s) in video {shortened(video.linear.name)}"
                best = Banded.about_nothing(video.motion.times[late.frames], late.lateness, late.sd, against)
        return best

    return with_bands(
        seen,
        [jumps(one) for one in seen],
        ("", "jump of all bodies (s)"),
        "By how much time all bodies would jump along their paths together, if they did so at each single frame.",
    )


def _single(seen: Sequence[Seen]) -> str:
    """By how much each frame of all videos is late."""

    def lateness(one: Seen) -> Banded:
        times, values, sds = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
        for index, video in enumerate(one.flight.beside.videos):
            late = _late(one, index, lasting=False)
            times.append(video.motion.times[late.frames] - video.motion.times[0])
            values.append(late.lateness)
            sds.append(late.sd)
        time, value, sd = (np.concatenate(parts) for parts in (times, values, sds))
        usual = np.zeros(len(time), dtype=bool)
        for stretch in np.array_split(np.argsort(time), min(STRETCHES, max(len(time), 1))):
            usual[stretch] = Points(time[stretch], value[stretch], sd[stretch]).usual
            sd[stretch] = np.sqrt((sd[stretch][usual[stretch]] ** 2).mean()) if usual[stretch].any() else 0.0
        time, value, sd = (part[usual] for part in (time, value, sd))
        return Banded.about_nothing(time, 1e3 * value, 1e3 * sd)

    return with_bands(
        seen,
        [lateness(one) for one in seen],
        ("time (s)", "late by (ms)"),
        "By how much all bodies are ahead on their paths in single frames, so that these seem late, against time.",
        small=True,
    )


def _late(one: Seen, index: int, *, lasting: bool) -> LateFrames:
    model = one.flight.beside
    return LateFrames.of(model, index, np.zeros((len(model.left[index]), 0)), lasting=lasting)


MEASUREMENT_FIGURES: Mapping[str, Figure] = {
    OUTLIERS: _outliers,
    MEMORY: partial(_neighbours, memory=True),
    SIZE: partial(_neighbours, memory=False),
    LOST_FRAMES: _lost,
    SINGLE_FRAMES: _single,
}
"""How what a check of the measurement is about is shown, by its name."""
